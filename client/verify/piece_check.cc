#include "client/verify/piece_check.h"

#include <absl/strings/str_cat.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "client/base/check.h"
#include "client/base/status_macros.h"
#include "client/verify/certificate_check.h"

namespace hulld {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

std::string PairText(size_t a, size_t b) {
  return absl::StrCat("pieces ", a, " of A and ", b, " of B");
}

// The leading 62 bits of a number >= 1, times 2^exponent.
struct Leading {
  double value;
  int exponent;
};

Leading LeadingBits(const BigInteger& number) {
  constexpr unsigned kBits = 62;
  const unsigned bits = msb(number) + 1;
  const unsigned dropped = bits > kBits ? bits - kBits : 0;
  return {static_cast<double>(static_cast<int64_t>(number >> dropped)), static_cast<int>(dropped)};
}

// Returns doubles that bound number 2^exponent / scale. The relative error of a quotient of two
// rounded numbers is less than 2^-50.
std::pair<double, double> Between(const BigInteger& number, const BigInteger& scale, int exponent) {
  if (number == 0) return {0, 0};
  const Leading top = LeadingBits(abs(number));
  const Leading bottom = LeadingBits(scale);
  const double size =
      std::ldexp(top.value / bottom.value, top.exponent - bottom.exponent + exponent);
  // Keeps both bounds in the range with relative errors.
  if (!std::isnormal(size) || !std::isnormal(size / 2) || !std::isnormal(size * 2)) {
    return {-kInfinity, kInfinity};
  }
  const double value = number > 0 ? size : -size;
  return {value - size * 0x1p-48, value + size * 0x1p-48};
}

// The least axis-aligned box of a rounded hull in the world.
struct WorldBox {
  WorldBox(const ExactHull& hull, int exponent) : scale(hull.scale) {
    for (int k = 0; k < 3; ++k) {
      BigVector axis = {0, 0, 0};
      axis[k] = 1;
      std::tie(low[k], high[k]) = hull.Extent(axis);
      low[k] -= hull.radius * scale;
      high[k] += hull.radius * scale;
      rounded_low[k] = Between(low[k], scale, exponent).first;
      rounded_high[k] = Between(high[k], scale, exponent).second;
    }
  }

  // Times scale.
  BigVector low;
  BigVector high;
  BigInteger scale;
  // Rounded outward.
  std::array<double, 3> rounded_low;
  std::array<double, 3> rounded_high;
};

bool AreApart(const WorldBox& a, const WorldBox& b) {
  for (int k = 0; k < 3; ++k) {
    if (a.rounded_high[k] < b.rounded_low[k] || b.rounded_high[k] < a.rounded_low[k]) return true;
  }
  for (int k = 0; k < 3; ++k) {
    if (a.high[k] * b.scale < b.low[k] * a.scale) return true;
    if (b.high[k] * a.scale < a.low[k] * b.scale) return true;
  }
  return false;
}

// The pieces of a side, converted to exact numbers on demand.
class ExactPieces {
 public:
  explicit ExactPieces(std::span<const PlacedVertices> pieces)
      : pieces_(pieces), exact_(pieces.size()) {}

  size_t size() const { return pieces_.size(); }
  bool empty(size_t i) const { return pieces_[i].xyz.empty(); }

  absl::Status Check(const char* side, CommonExponent* lengths) const {
    for (size_t i = 0; i < size(); ++i) {
      if (empty(i)) continue;
      if (absl::Status s = CheckPlacement(pieces_[i]); !s.ok()) {
        return ProofFails(absl::StrCat("piece ", i, " of ", side, ": ", s.message()));
      }
      IncludeLengths(pieces_[i], lengths);
    }
    return absl::OkStatus();
  }

  // Requires a piece that is not empty, and an exponent that covers all (CommonExponent checks it).
  const ExactHull& At(size_t i, const CommonExponent& lengths) {
    HULLD_CLIENT_CHECK(!empty(i));
    if (exact_[i]) return *exact_[i];
    const std::span<const double> xyz = pieces_[i].xyz;
    BigVertices& vertices = vertices_[xyz.data()];
    if (vertices == nullptr) vertices = ToIntegers(xyz, lengths);
    return exact_[i].emplace(pieces_[i], vertices, lengths);
  }

  // No box for empty pieces.
  std::vector<std::optional<WorldBox>> Boxes(const CommonExponent& lengths) {
    std::vector<std::optional<WorldBox>> boxes(size());
    for (size_t i = 0; i < size(); ++i) {
      if (!empty(i)) boxes[i].emplace(At(i, lengths), lengths.exponent());
    }
    return boxes;
  }

 private:
  std::span<const PlacedVertices> pieces_;
  std::vector<std::optional<ExactHull>> exact_;
  // Keyed by the coordinates of a piece, so that a hull shared by several pieces is converted only
  // once.
  std::map<const double*, BigVertices> vertices_;
};

using Pairs = std::set<std::pair<uint32_t, uint32_t>>;

absl::Status CheckOne(v1::Relation relation, const v1::PieceCertificate& of, ExactPieces* a,
                      ExactPieces* b, const CommonExponent& lengths, Pairs* proven) {
  const std::string name = PairText(of.piece_a(), of.piece_b());
  if (of.piece_a() >= a->size() || of.piece_b() >= b->size()) {
    return ProofFails(absl::StrCat(name, " have a certificate, but A has ", a->size(),
                                   " pieces and B ", b->size()));
  }
  if (!proven->emplace(of.piece_a(), of.piece_b()).second) {
    return ProofFails(absl::StrCat(name, " have two certificates"));
  }
  if (absl::Status s = CheckRelation(of.relation()); !s.ok()) {
    return ProofFails(absl::StrCat(name, ": ", s.message()));
  }
  // Relations are numbered in ascending strength.
  if (of.relation() > relation) {
    return ProofFails(absl::StrCat(name, " are ", v1::Relation_Name(of.relation()),
                                   ", so the bodies are not ", v1::Relation_Name(relation)));
  }
  if (a->empty(of.piece_a()) || b->empty(of.piece_b())) {
    if (of.relation() == v1::RELATION_SEPARATED) return absl::OkStatus();
    return ProofFails(absl::StrCat(name, ": a hull is empty, and so separated from everything"));
  }
  const absl::Status checked = CheckExactly(
      of.relation(), of.certificate(), a->At(of.piece_a(), lengths), b->At(of.piece_b(), lengths));
  if (checked.ok()) return checked;
  return ProofFails(absl::StrCat(name, ": ", checked.message()));
}

// Checks that boxes settle every pair without a certificate.
absl::Status CheckUncertifiedPairs(const Pairs& proven, ExactPieces* a, ExactPieces* b,
                                   const CommonExponent& lengths) {
  const std::vector<std::optional<WorldBox>> boxes_a = a->Boxes(lengths);
  const std::vector<std::optional<WorldBox>> boxes_b = b->Boxes(lengths);
  auto next = proven.begin();
  for (uint32_t i = 0; i < boxes_a.size(); ++i) {
    for (uint32_t j = 0; j < boxes_b.size(); ++j) {
      if (next != proven.end() && *next == std::pair(i, j)) {
        ++next;
        continue;
      }
      if (!boxes_a[i] || !boxes_b[j] || AreApart(*boxes_a[i], *boxes_b[j])) continue;
      return ProofFails(absl::StrCat(PairText(i, j),
                                     " have no certificate, and their boxes along the axes meet"));
    }
  }
  return absl::OkStatus();
}

}  // namespace

absl::Status CheckPieceCertificates(v1::Relation relation, const PieceCertificates& certificates,
                                    std::span<const PlacedVertices> a,
                                    std::span<const PlacedVertices> b) {
  HULLD_RETURN_IF_ERROR(CheckRelation(relation));
  ExactPieces exact_a(a);
  ExactPieces exact_b(b);
  CommonExponent lengths;
  HULLD_RETURN_IF_ERROR(exact_a.Check("A", &lengths));
  HULLD_RETURN_IF_ERROR(exact_b.Check("B", &lengths));
  Pairs proven;
  bool is_shown = relation == v1::RELATION_SEPARATED;
  for (const v1::PieceCertificate& of : certificates) {
    HULLD_RETURN_IF_ERROR(CheckOne(relation, of, &exact_a, &exact_b, lengths, &proven));
    is_shown |= of.relation() == relation;
  }
  if (!is_shown) {
    return ProofFails(
        absl::StrCat("no certificate shows two pieces that are ", v1::Relation_Name(relation)));
  }
  if (relation == v1::RELATION_OVERLAPPING) return absl::OkStatus();
  return CheckUncertifiedPairs(proven, &exact_a, &exact_b, lengths);
}

}  // namespace hulld
