#include <fcl/narrowphase/detail/gjk_solver_indep.h>
#include <fcl/narrowphase/detail/gjk_solver_libccd.h>

#include "tests/bench/queries/fcl_shape.h"
#include "tests/bench/queries/peers.h"

namespace hulld::bench {
namespace {

// Calls Solver directly, without the dispatch of fcl::collide and its bounding boxes.
template <typename Solver>
struct Fcl {
  using Shape = std::shared_ptr<fcl::Convexd>;
  struct Placed {
    const fcl::Convexd* shape;
    fcl::Transform3d X;
  };

  Solver solver;

  std::unique_ptr<Shape> MakeShape(const Hull& hull) {
    return std::make_unique<Shape>(ToFcl(hull));
  }
  Placed Place(const Shape& shape, const Pose& X_WA) { return {shape.get(), ToFcl(X_WA)}; }

  Verdict Decide(const Placed& a, const Placed& b) {
    return solver.shapeIntersect(*a.shape, a.X, *b.shape, b.X, nullptr) ? Verdict::kColliding
                                                                        : Verdict::kApart;
  }

  std::optional<double> Depth(const Placed& a, const Placed& b) {
    std::vector<fcl::ContactPointd> contacts;
    if (!solver.shapeIntersect(*a.shape, a.X, *b.shape, b.X, &contacts)) return std::nullopt;
    if (contacts.empty()) return std::nullopt;
    return contacts.front().penetration_depth;
  }

  std::optional<double> Distance(const Placed& a, const Placed& b) {
    double distance = 0;
    fcl::Vector3d p_WA;
    fcl::Vector3d p_WB;
    if (!solver.shapeDistance(*a.shape, a.X, *b.shape, b.X, &distance, &p_WA, &p_WB)) {
      return std::nullopt;
    }
    return distance;
  }
};

}  // namespace

void AddFcl(std::vector<std::unique_ptr<QueryMethod>>& methods) {
  using Libccd = Fcl<fcl::detail::GJKSolver_libccd<double>>;
  using Own = Fcl<fcl::detail::GJKSolver_indep<double>>;
  methods.push_back(std::make_unique<MethodOf<Libccd>>("FCL libccd", Libccd{}));
  methods.push_back(std::make_unique<MethodOf<Own>>("FCL indep", Own{}));
}

}  // namespace hulld::bench
