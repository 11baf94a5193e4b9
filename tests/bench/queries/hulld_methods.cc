#include <cstdio>
#include <cstdlib>

#include "core/hull/simplification/simplify.h"
#include "core/query/collision.h"
#include "tests/bench/queries/query_method.h"

namespace hulld::bench {
namespace {

[[noreturn]] void Fail(const absl::Status& status) {
  std::fprintf(stderr, "%s\n", status.ToString().c_str());
  std::abort();
}

template <typename T>
T OrFail(absl::StatusOr<T> value) {
  if (!value.ok()) Fail(value.status());
  return *std::move(value);
}

Verdict ToVerdict(Relation relation) {
  switch (relation) {
    case Relation::kSeparated:
      return Verdict::kApart;
    case Relation::kWithinTolerance:
      return Verdict::kOpen;
    default:
      return Verdict::kColliding;
  }
}

struct Hulld {
  using Shape = QueryHull;
  using Placed = PlacedHull;

  explicit Hulld(double tolerance) {
    relation_alone.tolerance = tolerance;
    with_separation.want_separation = true;
    with_separation.want_witness = true;
    if (tolerance > 0) with_separation.max_error = tolerance;
  }

  QueryOptions relation_alone;
  QueryOptions with_separation;

  std::unique_ptr<Shape> MakeShape(const Hull& hull) { return std::make_unique<QueryHull>(hull); }
  Placed Place(const Shape& shape, const Pose& X_WA) {
    return OrFail(PlacedHull::Make(shape, X_WA));
  }
  Verdict Decide(const Placed& a, const Placed& b) {
    return ToVerdict(CheckCollision(a, b, relation_alone)->relation);
  }
  std::optional<double> Depth(const Placed& a, const Placed& b) {
    const std::optional<double> separation = Separate(a, b);
    if (separation && *separation <= 0) return -*separation;
    return std::nullopt;
  }
  std::optional<double> Distance(const Placed& a, const Placed& b) {
    const std::optional<double> separation = Separate(a, b);
    if (separation && *separation > 0) return separation;
    return std::nullopt;
  }
  std::optional<double> Separate(const Placed& a, const Placed& b) {
    const absl::StatusOr<Answer> answer = CheckCollision(a, b, with_separation);
    if (!answer.ok()) Fail(answer.status());
    if (!answer->separation) return std::nullopt;
    return answer->separation->value;
  }
};

struct HulldSimplified {
  struct Shape {
    Shape(const Hull& full, double max_error)
        : simplified(OrFail(SimplifyInside(full, {0, max_error, {}}))),
          query_hull(simplified.hull) {}
    SimplifiedHull simplified;
    QueryHull query_hull;
  };
  using Placed = PlacedHull;

  double max_error;
  Hulld hulld;

  std::unique_ptr<Shape> MakeShape(const Hull& hull) {
    return std::make_unique<Shape>(hull, max_error);
  }
  Placed Place(const Shape& shape, const Pose& X_WA) { return hulld.Place(shape.query_hull, X_WA); }
  Verdict Decide(const Placed& a, const Placed& b) { return hulld.Decide(a, b); }
  std::optional<double> Depth(const Placed& a, const Placed& b) { return hulld.Depth(a, b); }
  std::optional<double> Distance(const Placed& a, const Placed& b) { return hulld.Distance(a, b); }
};

}  // namespace

double BestSeparation(const Hull& a, const Pose& X_WA, const Hull& b, const Pose& X_WB) {
  constexpr double kRelativeMaxError = 1e-15;
  QueryOptions options;
  options.want_separation = true;
  options.max_error = kRelativeMaxError * (QueryHull(a).radius() + QueryHull(b).radius());
  return OrFail(CheckCollision(a, X_WA, b, X_WB, options)).separation->value;
}

std::unique_ptr<QueryMethod> MakeHulld() { return MakeHulldWithin(0, "hulld"); }

std::unique_ptr<QueryMethod> MakeHulldWithin(double tolerance, std::string name) {
  return std::make_unique<MethodOf<Hulld>>(std::move(name), Hulld(tolerance));
}

std::unique_ptr<QueryMethod> MakeHulldSimplified(double max_error, std::string name) {
  return std::make_unique<MethodOf<HulldSimplified>>(std::move(name),
                                                     HulldSimplified{max_error, Hulld(0)});
}

}  // namespace hulld::bench
