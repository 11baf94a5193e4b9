#include <fcl/geometry/shape/convex.h>
#include <fcl/narrowphase/detail/gjk_solver_indep.h>
#include <fcl/narrowphase/detail/gjk_solver_libccd.h>

#include "tests/bench/peers.h"

namespace hulld::bench {
namespace {

// Solver is asked directly: that spares the dispatch of fcl::collide and its bounding boxes.
template <typename Solver>
struct Fcl {
  using Shape = fcl::Convexd;
  struct Placed {
    const Shape* shape;
    fcl::Transform3d X;
  };

  Solver solver;

  std::unique_ptr<Shape> MakeShape(const Hull& hull) {
    auto vertices = std::make_shared<std::vector<fcl::Vector3d>>(hull.vertices().begin(),
                                                                 hull.vertices().end());
    auto faces = std::make_shared<std::vector<int>>();
    int count = 0;
    for (size_t i = 0; i < hull.facet_count(); ++i) {
      const auto facet = hull.facet(i);
      faces->push_back(static_cast<int>(facet.size()));
      faces->insert(faces->end(), facet.begin(), facet.end());
      ++count;
      if (hull.dimension() < 3) {
        // The other side, so that the surface is closed.
        faces->push_back(static_cast<int>(facet.size()));
        faces->insert(faces->end(), facet.rbegin(), facet.rend());
        ++count;
      }
    }
    return std::make_unique<Shape>(std::move(vertices), count, std::move(faces));
  }

  Placed Place(const Shape& shape, const Pose& X_WA) {
    fcl::Transform3d X = fcl::Transform3d::Identity();
    X.linear() = RotationOf(X_WA);
    X.translation() = X_WA.t;
    return {&shape, X};
  }

  Verdict Ask(const Placed& a, const Placed& b) {
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
