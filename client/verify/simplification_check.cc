#include "client/verify/simplification_check.h"

#include <absl/strings/str_cat.h>

#include <cmath>
#include <cstdio>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "client/base/status_macros.h"
#include "client/verify/exact_vector.h"
#include "client/verify/triangle_tree.h"

namespace hulld {
namespace {

constexpr int kSimplificationReadAttempts = 5;

absl::Status NotShown(const std::string& why) { return absl::FailedPreconditionError(why); }

// Returns text that reads back as the same double.
std::string Text(double number) {
  char text[32];
  std::snprintf(text, sizeof(text), "%.17g", number);
  return text;
}

BigInteger Squared(const BigVector& v) { return Dot(v, v); }

struct Corners {
  const BigVector& a;
  const BigVector& b;
  const BigVector& c;
};

// Returns true if the distance from p to the segment from a to b is at most the root of
// distance_squared and the nearest point of their line is between them.
bool IsWithinOfSegment(const BigVector& p, const BigVector& a, const BigVector& b,
                       const BigInteger& distance_squared) {
  const BigVector along = b - a;
  const BigVector from_a = p - a;
  const BigInteger length_squared = Squared(along);
  const BigInteger place = Dot(from_a, along);
  return place > 0 && place < length_squared &&
         Squared(Cross(from_a, along)) <= distance_squared * length_squared;
}

// Same as above, for a triangle that contains the nearest point of its plane.
bool IsWithinOfFace(const BigVector& p, const Corners& t, const BigInteger& distance_squared) {
  const BigVector normal = Cross(t.b - t.a, t.c - t.a);
  if (IsZero(normal)) return false;
  const auto is_left_of = [&](const BigVector& from, const BigVector& to) {
    return Dot(Cross(to - from, p - from), normal) >= 0;
  };
  if (!is_left_of(t.a, t.b) || !is_left_of(t.b, t.c) || !is_left_of(t.c, t.a)) return false;
  const BigInteger height = Dot(normal, p - t.a);
  return height * height <= distance_squared * Squared(normal);
}

bool IsWithinOfTriangle(const BigVector& p, const Corners& t, const BigInteger& distance_squared) {
  for (const BigVector* corner : {&t.a, &t.b, &t.c}) {
    if (Squared(p - *corner) <= distance_squared) return true;
  }
  return IsWithinOfSegment(p, t.a, t.b, distance_squared) ||
         IsWithinOfSegment(p, t.b, t.c, distance_squared) ||
         IsWithinOfSegment(p, t.c, t.a, distance_squared) || IsWithinOfFace(p, t, distance_squared);
}

// Returns true if the closed tetrahedron of apex and triangle contains p; false for one without
// volume. Cramer's rule: p - apex is a sum of the three edges with nonnegative weights that add up
// to at most 1.
bool IsInTetrahedron(const BigVector& p, const BigVector& apex, const Corners& t) {
  const BigVector a = t.a - apex;
  const BigVector b = t.b - apex;
  const BigVector c = t.c - apex;
  const BigVector at = p - apex;
  const BigVector bc = Cross(b, c);
  const BigInteger volume = Dot(a, bc);
  if (volume == 0) return false;
  const BigInteger weights[] = {Dot(at, bc), Dot(at, Cross(c, a)), Dot(at, Cross(a, b))};
  BigInteger rest = volume;
  for (const BigInteger& weight : weights) {
    if (weight.sign() * volume.sign() < 0) return false;
    rest -= weight;
  }
  return rest.sign() * volume.sign() >= 0;
}

// Common units of both hulls.
struct Measure {
  Measure(const HullMesh& hull, const HullMesh& simplified, double error)
      : unit(Joined(hull, simplified)) {
    grid.Include(hull.xyz);
    grid.Include(simplified.xyz);
    if (std::isfinite(error)) grid.Include(error);
  }
  static std::vector<double> Joined(const HullMesh& a, const HullMesh& b) {
    std::vector<double> xyz = a.xyz;
    xyz.insert(xyz.end(), b.xyz.begin(), b.xyz.end());
    return xyz;
  }

  CommonExponent grid;
  UnitBox unit;
};

// A hull prepared for point queries.
class PreparedHull {
 public:
  // Both must outlive the result. FAILED_PRECONDITION: facets that do not match the vertices.
  static absl::StatusOr<PreparedHull> Make(const HullMesh& mesh, const Measure& measure) {
    PreparedHull hull(measure);
    for (size_t i = 0; i < mesh.vertex_count(); ++i) {
      const Point3 p = PointAt(mesh.xyz, i);
      hull.vertices_.push_back(hull.OnGrid(p));
      hull.unit_.push_back(measure.unit.ToUnit(p));
      hull.known_.insert(Key(p));
    }
    HULLD_RETURN_IF_ERROR(hull.AddTriangles(mesh));
    hull.is_flat_ = mesh.facet_sizes.size() < 2;
    hull.tree_.emplace(hull.unit_, hull.triangles_);
    hull.FindApexes();
    return hull;
  }

  bool HasVertex(const Point3& p) const { return known_.contains(Key(p)); }

  // Returns true if p is within the distance, which is finite and was included in the grid.
  bool IsWithin(const Point3& p, double distance) const {
    if (HasVertex(p)) return true;
    const BigVector exact = OnGrid(p);
    const BigInteger length = measure_.grid.ToInteger(distance);
    const BigInteger squared = length * length;
    return tree_->AnyNear(
        measure_.unit.ToUnit(p), measure_.unit.LengthToUnit(distance),
        [&](size_t i) { return IsWithinOfTriangle(exact, CornersOf(triangles_[i]), squared); });
  }

  bool Contains(const Point3& p) const {
    if (HasVertex(p)) return true;
    if (is_flat_) return IsWithin(p, 0);
    const BigVector exact = OnGrid(p);
    const Point3 unit = measure_.unit.ToUnit(p);
    // Uses a distant vertex as apex, so that rounding does not dominate the direction.
    const size_t apex =
        DistanceSquared(unit_[apexes_[0]], unit) > DistanceSquared(unit_[apexes_[1]], unit)
            ? apexes_[0]
            : apexes_[1];
    return tree_->AnyBeyond(unit_[apex], unit, [&](size_t i) {
      return IsInTetrahedron(exact, vertices_[apex], CornersOf(triangles_[i]));
    });
  }

 private:
  explicit PreparedHull(const Measure& measure) : measure_(measure) {}

  // Adding 0 turns -0 into 0.
  static Point3 Key(const Point3& p) { return {p[0] + 0, p[1] + 0, p[2] + 0}; }
  static double DistanceSquared(const Point3& a, const Point3& b) {
    double sum = 0;
    for (size_t axis = 0; axis < 3; ++axis) sum += (a[axis] - b[axis]) * (a[axis] - b[axis]);
    return sum;
  }

  BigVector OnGrid(const Point3& p) const {
    return {measure_.grid.ToInteger(p[0]), measure_.grid.ToInteger(p[1]),
            measure_.grid.ToInteger(p[2])};
  }
  Corners CornersOf(const Triangle& t) const {
    return {vertices_[t[0]], vertices_[t[1]], vertices_[t[2]]};
  }

  // Splits facets into fans from their first vertex. A hull without facets is a segment or a point.
  absl::Status AddTriangles(const HullMesh& mesh) {
    if (mesh.facet_sizes.empty() && !vertices_.empty()) {
      const auto last = static_cast<uint32_t>(vertices_.size() - 1);
      triangles_.push_back({0, last, last});
    }
    size_t begin = 0;
    for (const uint32_t size : mesh.facet_sizes) {
      const size_t end = begin + size;
      if (end > mesh.facet_indices.size()) return NotShown("a facet ends beyond all indices");
      for (size_t i = begin; i < end; ++i) {
        if (mesh.facet_indices[i] >= vertices_.size()) {
          return NotShown(absl::StrCat("a facet has a vertex ", mesh.facet_indices[i], ", of ",
                                       vertices_.size()));
        }
      }
      for (size_t i = begin + 2; i < end; ++i) {
        triangles_.push_back(
            {mesh.facet_indices[begin], mesh.facet_indices[i - 1], mesh.facet_indices[i]});
      }
      begin = end;
    }
    return absl::OkStatus();
  }

  // Finds two distant vertices, so that one of them is far from any point.
  void FindApexes() {
    for (size_t i = 1; i < unit_.size(); ++i) {
      if (DistanceSquared(unit_[i], unit_[0]) > DistanceSquared(unit_[apexes_[1]], unit_[0])) {
        apexes_[1] = i;
      }
    }
  }

  const Measure& measure_;
  std::vector<BigVector> vertices_;
  std::vector<Point3> unit_;
  std::set<Point3> known_;
  std::vector<Triangle> triangles_;
  std::array<size_t, 2> apexes_ = {0, 0};
  bool is_flat_ = false;
  // Refers to unit_ and triangles_, whose elements keep their addresses when this is moved.
  std::optional<TriangleTree> tree_;
};

absl::Status CheckHeader(const v1::Simplification& requested, const HullMesh& simplified) {
  if (!simplified.header.has_error()) return NotShown("the reply contains no error");
  const double error = simplified.header.error();
  if (std::isnan(error) || error < 0) {
    return NotShown(absl::StrCat("the error is ", Text(error), ", which is not a distance"));
  }
  if (requested.max_vertices() > 0 && simplified.vertex_count() > requested.max_vertices()) {
    return NotShown(absl::StrCat("the simplification has ", simplified.vertex_count(),
                                 " vertices; at most ", requested.max_vertices(),
                                 " were requested"));
  }
  if (requested.max_vertices() == 0 && error > requested.max_error()) {
    return NotShown(absl::StrCat("the error is ", Text(error), "; at most ",
                                 Text(requested.max_error()), " was requested"));
  }
  return absl::OkStatus();
}

absl::Status CheckInside(const HullMesh& hull, const HullMesh& simplified, double error,
                         const PreparedHull& of_hull, const PreparedHull& of_simplified) {
  for (size_t i = 0; i < simplified.vertex_count(); ++i) {
    if (!of_hull.HasVertex(PointAt(simplified.xyz, i))) {
      return NotShown(
          absl::StrCat("vertex ", i, " of the simplification is not a vertex of the hull"));
    }
  }
  if (std::isinf(error)) return absl::OkStatus();
  for (size_t i = 0; i < hull.vertex_count(); ++i) {
    if (!of_simplified.IsWithin(PointAt(hull.xyz, i), error)) {
      return NotShown(absl::StrCat("vertex ", i, " of the hull is farther than ", Text(error),
                                   " from the simplification"));
    }
  }
  return absl::OkStatus();
}

absl::Status CheckOutside(const HullMesh& hull, const HullMesh& simplified, double error,
                          const PreparedHull& of_hull, const PreparedHull& of_simplified) {
  for (size_t i = 0; i < hull.vertex_count(); ++i) {
    if (!of_simplified.Contains(PointAt(hull.xyz, i))) {
      return NotShown(absl::StrCat("vertex ", i, " of the hull is not in the simplification"));
    }
  }
  if (std::isinf(error)) return absl::OkStatus();
  for (size_t i = 0; i < simplified.vertex_count(); ++i) {
    if (!of_hull.IsWithin(PointAt(simplified.xyz, i), error)) {
      return NotShown(absl::StrCat("vertex ", i, " of the simplification is farther than ",
                                   Text(error), " from the hull"));
    }
  }
  return absl::OkStatus();
}

bool IsSameVersion(const v1::MeshHeader& a, const v1::MeshHeader& b) {
  return a.header().store_id() == b.header().store_id() &&
         a.hull().create_revision() == b.hull().create_revision() &&
         a.hull().revision() == b.hull().revision();
}

}  // namespace

absl::Status CheckSimplification(const v1::Simplification& requested, const HullMesh& hull,
                                 const HullMesh& simplified) {
  HULLD_RETURN_IF_ERROR(CheckHeader(requested, simplified));
  if (hull.xyz.empty() != simplified.xyz.empty()) {
    return NotShown("one of hull and simplification is empty, and the other is not");
  }
  if (hull.xyz.empty()) return absl::OkStatus();
  for (const std::vector<double>* xyz : {&hull.xyz, &simplified.xyz}) {
    for (const double x : *xyz) {
      if (!std::isfinite(x)) return NotShown("a coordinate is not finite");
    }
  }
  const double error = simplified.header.error();
  const Measure measure(hull, simplified, error);
  HULLD_ASSIGN_OR_RETURN(const auto of_hull, PreparedHull::Make(hull, measure));
  HULLD_ASSIGN_OR_RETURN(const auto of_simplified, PreparedHull::Make(simplified, measure));
  return requested.side() == v1::SIMPLIFICATION_SIDE_OUTSIDE
             ? CheckOutside(hull, simplified, error, of_hull, of_simplified)
             : CheckInside(hull, simplified, error, of_hull, of_simplified);
}

absl::StatusOr<VerifiedMesh> GetSimplificationVerified(
    const Client& client, const v1::GetHullMeshRequest& request,
    const std::function<void(const HullMesh&)>& on_part) {
  if (!request.has_simplification()) {
    return absl::InvalidArgumentError("the request has no simplification to verify");
  }
  VerifiedMesh verified;
  for (int attempt = 0; attempt < kSimplificationReadAttempts; ++attempt) {
    HULLD_ASSIGN_OR_RETURN(verified.mesh, client.GetHullMesh(request, on_part));
    HULLD_ASSIGN_OR_RETURN(const HullMesh hull, client.GetHullMesh(request.hull_id()));
    if (!IsSameVersion(hull.header, verified.mesh.header)) {
      verified.verification = {
          Verdict::kMoved,
          absl::StrCat("hull ", request.hull_id(), " is at revision ",
                       hull.header.hull().revision(), "; the simplification is of revision ",
                       verified.mesh.header.hull().revision())};
      continue;
    }
    const absl::Status checked = CheckSimplification(request.simplification(), hull, verified.mesh);
    verified.verification = checked.ok()
                                ? Verification{Verdict::kValid, ""}
                                : Verification{Verdict::kInvalid, std::string(checked.message())};
    break;
  }
  return verified;
}

}  // namespace hulld
