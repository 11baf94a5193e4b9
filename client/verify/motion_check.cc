#include "client/verify/motion_check.h"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "client/base/status_macros.h"
#include "client/verify/certificate_check.h"

namespace hulld {
namespace {

// A time t, as the weights (1 - t) and t of the two ends of a motion, times a common divisor.
struct Moment {
  BigInteger of_start;
  BigInteger of_end;
  // A power of two.
  BigInteger divisor;
};

// Returns the moments of times in [0, 1], all with one divisor.
template <size_t count>
std::array<Moment, count> MomentsOf(const std::array<double, count>& times) {
  CommonExponent exponent;
  exponent.Include(1);
  exponent.Include(times);
  const BigInteger one = exponent.ToInteger(1);
  std::array<Moment, count> moments;
  for (size_t i = 0; i < count; ++i) {
    const BigInteger t = exponent.ToInteger(times[i]);
    moments[i] = {one - t, t, one};
  }
  return moments;
}

template <size_t count>
std::array<BigInteger, count> Between(const std::array<BigInteger, count>& start,
                                      const std::array<BigInteger, count>& end,
                                      const Moment& moment) {
  std::array<BigInteger, count> between;
  for (size_t i = 0; i < count; ++i) {
    between[i] = moment.of_start * start[i] + moment.of_end * end[i];
  }
  return between;
}

// Vertices of a piece in the frame of its body, times `scale`: R(q) p + |q|^2 t for its pose there,
// and 1 without a piece.
struct BodyVertices {
  BodyVertices(const PlacedVertices& hull, const CommonExponent& lengths)
      : vertices(ToIntegers(hull.xyz, lengths)) {
    if (hull.in_body == nullptr) return;
    CommonExponent quaternion;
    IncludeRotation(*hull.in_body, &quaternion);
    const BigQuaternion q = RotationIn(*hull.in_body, quaternion);
    const BigRotation rotation = RotationForm(q, q);
    scale = rotation.scale;
    const BigVector shift = scale * TranslationIn(*hull.in_body, lengths);
    auto in_body = std::make_shared<std::vector<BigVector>>(*vertices);
    for (BigVector& p : *in_body) {
      p = BigVector{Dot(rotation.rows[0], p), Dot(rotation.rows[1], p), Dot(rotation.rows[2], p)} +
          shift;
    }
    vertices = std::move(in_body);
  }

  BigVertices vertices;
  BigInteger scale = 1;
};

// A motion in integers: all lengths at one power of two; the rotations of both ends at another,
// because their relative length matters.
class ExactMotion {
 public:
  // Requires CheckPlacement of both ends, and an exponent that covers the lengths of both and
  // outlives this object.
  ExactMotion(const MovingVertices& moving, const CommonExponent& lengths)
      : given_(moving.start),
        lengths_(lengths),
        vertices_(moving.start, lengths),
        radius_(lengths.ToInteger(moving.start.radii[0]) +
                lengths.ToInteger(moving.start.radii[1])) {
    CommonExponent quaternions;
    IncludeRotation(moving.start.pose, &quaternions);
    IncludeRotation(moving.end, &quaternions);
    q_ = {RotationIn(moving.start.pose, quaternions), RotationIn(moving.end, quaternions)};
    x_ = {TranslationIn(moving.start.pose, lengths), TranslationIn(moving.end, lengths)};
  }

  // Times scale().
  const std::vector<BigVector>& vertices() const { return *vertices_.vertices; }
  const BigInteger& scale() const { return vertices_.scale; }
  const BigInteger& radius() const { return radius_; }
  // Rotation and translation at a moment, times its divisor.
  BigQuaternion RotationAt(const Moment& moment) const { return Between(q_[0], q_[1], moment); }
  BigVector TranslationAt(const Moment& moment) const { return Between(x_[0], x_[1], moment); }

  ExactHull HullAt(double time) const {
    const Moment moment = MomentsOf<1>({time})[0];
    const BigQuaternion q = RotationAt(moment);
    BigRotation rotation = RotationForm(q, q);
    rotation.scale *= scale();
    return ExactHull(given_, vertices_.vertices, lengths_, rotation, TranslationAt(moment),
                     moment.divisor);
  }

  // True if the rotation is the same at all times: one quaternion is a positive multiple of the
  // other.
  bool KeepsRotation() const {
    BigInteger cosine = 0;
    for (int i = 0; i < 4; ++i) {
      cosine += q_[0][i] * q_[1][i];
      for (int j = 0; j < i; ++j) {
        if (q_[0][i] * q_[1][j] != q_[0][j] * q_[1][i]) return false;
      }
    }
    return cosine > 0;
  }

 private:
  PlacedVertices given_;
  const CommonExponent& lengths_;
  BodyVertices vertices_;
  BigInteger radius_;
  std::array<BigQuaternion, 2> q_;
  std::array<BigVector, 2> x_;
};

// Polynomials by their Bernstein coefficients over an interval.
template <typename Number>
using Quadratic = std::array<Number, 3>;
template <typename Number>
using Quartic = std::array<Number, 5>;

// Returns twice a linear polynomial, given by its values at both ends.
template <typename Number>
Quadratic<Number> Twice(const Number& start, const Number& end) {
  return {start + start, start + end, end + end};
}

// Returns six times a product. Source: Farouki, "The Bernstein polynomial basis: a centennial
// retrospective", 2012.
template <typename F, typename G, typename Times>
auto Product(const Quadratic<F>& f, const Quadratic<G>& g, const Times& times) {
  using Number = decltype(times(f[0], g[0]));
  const auto scaled = [](int factor, const Number& number) -> Number {
    return BigInteger(factor) * number;
  };
  const auto product = [&](int i, int j) -> Number { return times(f[i], g[j]); };
  return Quartic<Number>{scaled(6, product(0, 0)), scaled(3, product(0, 1) + product(1, 0)),
                         product(0, 2) + scaled(4, product(1, 1)) + product(2, 0),
                         scaled(3, product(1, 2) + product(2, 1)), scaled(6, product(2, 2))};
}

// The half space n.p <= offset over an interval, with n and the offset linear in time, and n not
// zero at the ends; all lengths at one power of two.
struct HalfSpace {
  std::array<BigVector, 2> n;
  std::array<BigInteger, 2> offset;

  HalfSpace Opposite() const {
    const BigInteger minus = -1;
    return {{minus * n[0], minus * n[1]}, {-offset[0], -offset[1]}};
  }
  // An upper bound on |n|^2 over the interval.
  BigInteger GreatestSquare() const { return std::max(Dot(n[0], n[0]), Dot(n[1], n[1])); }
};

BigInteger Greatest(const BigVector& n, const std::vector<BigVector>& points) {
  BigInteger greatest = Dot(n, points.front());
  for (const BigVector& point : points) greatest = std::max(greatest, Dot(n, point));
  return greatest;
}

// The sum a + b sqrt(c).
struct Surd {
  BigInteger a;
  BigInteger b;
};

// Requires c > 0.
int SignOf(const Surd& number, const BigInteger& c) {
  const int sign = number.a.sign();
  if (number.b == 0 || sign == number.b.sign()) return sign;
  if (sign == 0) return number.b.sign();
  return sign * BigInteger(number.a * number.a - number.b * number.b * c).sign();
}

// For each vertex p, |q|^2 (n.p + radius |n| - offset) is a polynomial of time of degree 4, with a
// constant bound in place of |n|. Returns the greatest of each Bernstein coefficient over all
// vertices, as sums a + b |n|; all are times one positive number.
Quartic<Surd> GreatestHeights(const ExactMotion& hull, const HalfSpace& half_space,
                              const std::array<Moment, 2>& interval) {
  const auto& [n, offset] = half_space;
  const BigQuaternion q[2] = {hull.RotationAt(interval[0]), hull.RotationAt(interval[1])};
  const BigVector x[2] = {hull.TranslationAt(interval[0]), hull.TranslationAt(interval[1])};
  const Quadratic<BigRotation> forms = {RotationForm(q[0], q[0]), RotationForm(q[0], q[1]),
                                        RotationForm(q[1], q[1])};
  const BigInteger& divisor = interval[0].divisor;
  Quadratic<BigInteger> scale;
  for (int i = 0; i < 3; ++i) scale[i] = hull.scale() * forms[i].scale;
  const Quadratic<BigInteger> along = {BigInteger(2 * Dot(n[0], x[0])),
                                       BigInteger(Dot(n[0], x[1]) + Dot(n[1], x[0])),
                                       BigInteger(2 * Dot(n[1], x[1]))};
  const Quadratic<BigInteger> offsets = Twice(offset[0], offset[1]);
  Quadratic<BigInteger> shift;
  for (int i = 0; i < 3; ++i) shift[i] = along[i] - divisor * offsets[i];

  const auto times = [](const BigInteger& f, const BigInteger& g) { return BigInteger(f * g); };
  const auto turned = [&](const BigRotation& form, const BigVector& direction) -> BigVector {
    return divisor * Combination(direction, form.rows);
  };
  const Quartic<BigInteger> shifts = Product(scale, shift, times);
  const Quartic<BigInteger> scales = Product(scale, Twice<BigInteger>(divisor, divisor), times);
  const Quartic<BigVector> directions = Product(forms, Twice(n[0], n[1]), turned);
  Quartic<Surd> heights;
  for (int i = 0; i < 5; ++i) {
    heights[i] = {shifts[i] + Greatest(directions[i], hull.vertices()), hull.radius() * scales[i]};
  }
  return heights;
}

// Returns true if the hull is in the interior of the half space over the interval, or, if
// `may_end`, on its boundary at the end. A polynomial is negative on the interval if no Bernstein
// coefficient is positive and the outer ones, its values at both ends, are negative.
bool IsBelow(const ExactMotion& hull, const HalfSpace& half_space,
             const std::array<Moment, 2>& interval, bool may_end) {
  const BigInteger n_squared = half_space.GreatestSquare();
  std::array<int, 5> signs;
  std::ranges::transform(GreatestHeights(hull, half_space, interval), signs.begin(),
                         [&](const Surd& height) { return SignOf(height, n_squared); });
  return signs[0] < 0 && signs[1] <= 0 && signs[2] <= 0 && signs[3] <= 0 &&
         (signs[4] < 0 || (may_end && signs[4] == 0));
}

v1::Certificate DirectionOf(const v1::SeparatedInterval& interval) {
  v1::Certificate direction;
  if (interval.has_direction()) *direction.mutable_direction() = interval.direction();
  if (interval.has_integer_direction()) {
    *direction.mutable_integer_direction() = interval.integer_direction();
  }
  return direction;
}

// A pair in motion.
struct MovingPair {
  const ExactMotion& a;
  const ExactMotion& b;
  const CommonExponent& lengths;

  bool IsTranslation() const { return a.KeepsRotation() && b.KeepsRotation(); }
  int GapSignAt(const BigVector& n, double time) const {
    return GapSign(a.HullAt(time), b.HullAt(time), n);
  }
};

// A direction at a power of two, and an offset.
struct Plane {
  BigVector n;
  int exponent = 0;
  double offset = 0;
};

absl::Status CheckPlane(const MovingPair& pair, const std::array<Plane, 2>& planes,
                        const std::array<double, 2>& times, bool may_end) {
  CommonExponent of_offsets;
  int common = of_offsets.exponent();
  for (const Plane& plane : planes) {
    if (!std::isfinite(plane.offset)) return ProofFails("the offset is not finite");
    of_offsets.Include(plane.offset);
    common = std::min({common, plane.exponent + pair.lengths.exponent(), of_offsets.exponent()});
  }
  HalfSpace of_a;
  for (int i = 0; i < 2; ++i) {
    const Plane& plane = planes[i];
    const int exponent = plane.exponent + pair.lengths.exponent();
    of_a.n[i] = (BigInteger(1) << (exponent - common)) * plane.n;
    of_a.offset[i] = of_offsets.ToInteger(plane.offset) << (of_offsets.exponent() - common);
  }
  const std::array<Moment, 2> interval = MomentsOf(times);
  if (!IsBelow(pair.a, of_a, interval, may_end)) {
    return ProofFails("A does not stay on its side of the plane");
  }
  if (IsBelow(pair.b, of_a.Opposite(), interval, may_end)) return absl::OkStatus();
  return ProofFails("B does not stay on its side of the plane");
}

// n.(b - a) is linear in time for each pair of vertices, so its signs at both ends suffice.
absl::Status CheckTranslation(const MovingPair& pair, const BigVector& n,
                              const std::array<double, 2>& times, bool may_end) {
  if (!pair.IsTranslation()) {
    return ProofFails("the offset is missing, which is allowed only for translations");
  }
  const int at_end = pair.GapSignAt(n, times[1]);
  if (pair.GapSignAt(n, times[0]) > 0 && (at_end > 0 || (may_end && at_end == 0))) {
    return absl::OkStatus();
  }
  return ProofFails("the direction does not separate at both ends: max n.A >= min n.B");
}

absl::Status CheckInterval(const MovingPair& pair, const v1::SeparatedInterval& interval,
                           double begin, bool may_end) {
  Plane start;
  HULLD_RETURN_IF_ERROR(ReadDirection(DirectionOf(interval), &start.n, &start.exponent));
  const bool has_end = interval.has_end_direction();
  if (has_end != interval.has_end_offset() || (has_end && !interval.has_offset())) {
    return ProofFails("the end of a plane needs a direction, and offsets at both ends");
  }
  const std::array<double, 2> times = {begin, interval.until()};
  if (!interval.has_offset()) return CheckTranslation(pair, start.n, times, may_end);
  start.offset = interval.offset();
  Plane end = start;
  if (has_end) {
    v1::Certificate direction;
    *direction.mutable_direction() = interval.end_direction();
    HULLD_RETURN_IF_ERROR(ReadDirection(direction, &end.n, &end.exponent));
    end.offset = interval.end_offset();
  }
  return CheckPlane(pair, {start, end}, times, may_end);
}

using Intervals = google::protobuf::RepeatedPtrField<v1::SeparatedInterval>;

// Checks intervals up to contact.separated_until.
absl::Status CheckIntervals(const MovingPair& pair, const v1::FirstContact& contact,
                            const Intervals& intervals) {
  double begin = 0;
  for (int i = 0; i < intervals.size(); ++i) {
    const v1::SeparatedInterval& interval = intervals[i];
    const std::string name = absl::StrCat("intervals[", i, "]");
    // A comparison with NaN is false.
    if (!(begin < interval.until() && interval.until() <= contact.separated_until())) {
      return ProofFails(absl::StrCat(name, " ends at ", interval.until(), ", not between ", begin,
                                     " and ", contact.separated_until()));
    }
    const bool ends_at_contact =
        contact.has_contact_time() && interval.until() == contact.separated_until();
    const absl::Status checked = CheckInterval(pair, interval, begin, ends_at_contact);
    if (!checked.ok()) return ProofFails(absl::StrCat(name, ": ", checked.message()));
    begin = interval.until();
  }
  if (begin == contact.separated_until()) return absl::OkStatus();
  return ProofFails(absl::StrCat("the intervals end at ", begin, ", before separated_until, ",
                                 contact.separated_until()));
}

absl::Status CheckTimes(v1::Relation relation, const v1::FirstContact& contact) {
  const double until = contact.separated_until();
  if (!(until >= 0 && until <= 1)) {
    return ProofFails(absl::StrCat("separated_until is ", until, ", not in [0, 1]"));
  }
  if (relation == v1::RELATION_SEPARATED) {
    if (until == 1 && !contact.has_contact_time()) return absl::OkStatus();
    return ProofFails(
        "the pair is SEPARATED, but separated_until is not 1, or there is a contact_time");
  }
  if (!contact.has_contact_time()) return ProofFails("the contact has no contact_time");
  const double time = contact.contact_time();
  if (time >= until && time <= 1) return absl::OkStatus();
  return ProofFails(
      absl::StrCat("contact_time is ", time, ", not between separated_until, ", until, ", and 1"));
}

// Accepts a width of at most `max_width`, and adjacent doubles.
absl::Status CheckWidth(const v1::FirstContact& contact, double max_width) {
  const double until = contact.separated_until();
  const double time = contact.contact_time();
  CommonExponent exponent;
  exponent.Include(std::array{until, time, max_width});
  const bool is_narrow =
      exponent.ToInteger(time) - exponent.ToInteger(until) <= exponent.ToInteger(max_width);
  if (is_narrow || time <= std::nextafter(until, 2)) return absl::OkStatus();
  return absl::OutOfRangeError(absl::StrCat("the first contact is proven to be between ", until,
                                            " and ", time, ", which are more than ", max_width,
                                            " apart"));
}

// Contact of a translation between two times. All differences of vertices move alike, so their
// hulls at these times span all hulls in between; one of them contains 0 if the span does.
absl::Status CheckBriefContact(const MovingPair& pair, const v1::FirstContact& contact,
                               const v1::Certificate& certificate) {
  std::vector<BigVector> span;
  for (const double time : {contact.separated_until(), contact.contact_time()}) {
    HULLD_ASSIGN_OR_RETURN(
        const auto differences,
        DifferencesOf(certificate, kMaxTouchingPairs, pair.a.HullAt(time), pair.b.HullAt(time)));
    span.insert(span.end(), differences.begin(), differences.end());
  }
  if (ContainsOriginInside(span) || ContainsOriginOnBoundary(span)) return absl::OkStatus();
  return ProofFails("the vertex pairs show no common point up to contact_time");
}

absl::Status CheckContact(v1::Relation relation, const MovingPair& pair,
                          const v1::FirstContact& contact, const v1::Certificate& certificate) {
  const auto check = [&](v1::Relation at_contact) {
    const double time = contact.contact_time();
    return CheckExactly(at_contact, certificate, pair.a.HullAt(time), pair.b.HullAt(time));
  };
  // With radii, the time of a translation is irrational in general.
  const bool is_rounded = pair.a.radius() + pair.b.radius() > 0;
  if (is_rounded || !pair.IsTranslation()) return check(relation);
  const bool has_direction = certificate.has_direction() || certificate.has_integer_direction();
  if (has_direction) return check(v1::RELATION_TOUCHING);
  if (!check(v1::RELATION_OVERLAPPING).ok()) return CheckBriefContact(pair, contact, certificate);
  if (relation == v1::RELATION_OVERLAPPING) return absl::OkStatus();
  return ProofFails("the hulls overlap; they do not merely touch");
}

// Includes the lengths of both ends.
absl::Status IncludeMotion(const MovingVertices& hull, CommonExponent* lengths) {
  for (const PlacedVertices& end : {hull.start, PlacedVertices{{}, hull.end}}) {
    HULLD_RETURN_IF_ERROR(CheckPlacement(end));
    IncludeLengths(end, lengths);
  }
  return absl::OkStatus();
}

// The pieces of a body in motion.
class MovingPieces {
 public:
  explicit MovingPieces(std::span<const MovingVertices> pieces)
      : pieces_(pieces), exact_(pieces.size()) {}

  size_t size() const { return pieces_.size(); }
  bool empty(size_t i) const { return pieces_[i].start.xyz.empty(); }
  absl::Status Include(CommonExponent* lengths) const {
    for (size_t i = 0; i < size(); ++i) {
      if (empty(i)) continue;
      HULLD_RETURN_IF_ERROR(IncludeMotion(pieces_[i], lengths));
    }
    return absl::OkStatus();
  }
  // Requires a piece that is not empty, and an exponent that covers all.
  const ExactMotion& At(size_t i, const CommonExponent& lengths) {
    if (!exact_[i]) exact_[i].emplace(pieces_[i], lengths);
    return *exact_[i];
  }
  // True for a translation without radii.
  bool IsPlain(const CommonExponent& lengths) {
    for (size_t i = 0; i < size(); ++i) {
      if (empty(i)) continue;
      const ExactMotion& piece = At(i, lengths);
      if (piece.radius() > 0 || !piece.KeepsRotation()) return false;
    }
    return true;
  }

 private:
  std::span<const MovingVertices> pieces_;
  std::vector<std::optional<ExactMotion>> exact_;
};

}  // namespace

double MaxTimeError(const v1::Wanted& wanted) {
  return wanted.has_max_time_error() ? wanted.max_time_error() : 0x1p-30;
}

absl::Status CheckFirstContact(v1::Relation relation, const v1::FirstContact& contact,
                               const v1::Certificate& at_contact, const MovingVertices& a,
                               const MovingVertices& b, double max_time_error) {
  HULLD_RETURN_IF_ERROR(CheckRelation(relation));
  HULLD_RETURN_IF_ERROR(CheckTimes(relation, contact));
  if (a.start.xyz.empty() || b.start.xyz.empty()) {
    if (relation == v1::RELATION_SEPARATED) return absl::OkStatus();
    return ProofFails("a hull is empty, and so separated from everything");
  }
  CommonExponent lengths;
  for (const MovingVertices* hull : {&a, &b}) {
    HULLD_RETURN_IF_ERROR(IncludeMotion(*hull, &lengths));
  }
  const ExactMotion motion_a(a, lengths);
  const ExactMotion motion_b(b, lengths);
  const MovingPair pair = {motion_a, motion_b, lengths};
  HULLD_RETURN_IF_ERROR(CheckIntervals(pair, contact, contact.intervals()));
  if (relation == v1::RELATION_SEPARATED) return absl::OkStatus();
  const absl::Status checked = CheckContact(relation, pair, contact, at_contact);
  if (!checked.ok()) return ProofFails(absl::StrCat("contact: ", checked.message()));
  return CheckWidth(contact, max_time_error);
}

absl::Status CheckFirstContact(v1::Relation relation, const v1::FirstContact& contact,
                               const PieceCertificates& certificates,
                               std::span<const MovingVertices> a, std::span<const MovingVertices> b,
                               double max_time_error) {
  HULLD_RETURN_IF_ERROR(CheckRelation(relation));
  HULLD_RETURN_IF_ERROR(CheckTimes(relation, contact));
  MovingPieces pieces_a(a);
  MovingPieces pieces_b(b);
  CommonExponent lengths;
  HULLD_RETURN_IF_ERROR(pieces_a.Include(&lengths));
  HULLD_RETURN_IF_ERROR(pieces_b.Include(&lengths));
  std::set<std::pair<uint32_t, uint32_t>> proven;
  v1::Relation shown = v1::RELATION_SEPARATED;
  for (const v1::PieceCertificate& of : certificates) {
    const std::string name =
        absl::StrCat("pieces ", of.piece_a(), " of A and ", of.piece_b(), " of B: ");
    const bool is_known = of.piece_a() < a.size() && of.piece_b() < b.size() &&
                          !pieces_a.empty(of.piece_a()) && !pieces_b.empty(of.piece_b());
    if (!is_known || !proven.emplace(of.piece_a(), of.piece_b()).second) {
      return ProofFails(absl::StrCat(
          name, "there is no such pair of nonempty pieces, or it has two certificates"));
    }
    const MovingPair pair = {pieces_a.At(of.piece_a(), lengths), pieces_b.At(of.piece_b(), lengths),
                             lengths};
    absl::Status checked = CheckIntervals(pair, contact, of.intervals());
    if (checked.ok() && of.relation() != v1::RELATION_SEPARATED) {
      checked = contact.has_contact_time()
                    ? CheckContact(of.relation(), pair, contact, of.certificate())
                    : ProofFails("the pieces are in contact, but the answer has no contact_time");
      shown = std::max(shown, of.relation());
    }
    if (!checked.ok()) return ProofFails(absl::StrCat(name, checked.message()));
  }
  const bool may_overlap_later = relation == v1::RELATION_OVERLAPPING &&
                                 shown == v1::RELATION_TOUCHING && pieces_a.IsPlain(lengths) &&
                                 pieces_b.IsPlain(lengths);
  if (shown != relation && !may_overlap_later) {
    return ProofFails(absl::StrCat("the certificates show ", v1::Relation_Name(shown), ", not ",
                                   v1::Relation_Name(relation)));
  }
  for (uint32_t i = 0; i < a.size() && contact.separated_until() > 0; ++i) {
    for (uint32_t j = 0; j < b.size(); ++j) {
      if (pieces_a.empty(i) || pieces_b.empty(j) || proven.contains({i, j})) continue;
      return ProofFails(absl::StrCat("pieces ", i, " of A and ", j, " of B have no certificate"));
    }
  }
  if (relation == v1::RELATION_SEPARATED) return absl::OkStatus();
  return CheckWidth(contact, max_time_error);
}

}  // namespace hulld
