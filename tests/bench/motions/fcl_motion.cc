#include <fcl/math/motion/interp_motion.h>
#include <fcl/math/motion/translation_motion.h>
#include <fcl/narrowphase/continuous_collision.h>

#include <deque>

#include "tests/bench/motions/motion_methods.h"
#include "tests/bench/queries/fcl_shape.h"

namespace hulld::bench {
namespace {

// fcl::InterpMotion rotates about a reference point that none of its constructors initializes.
struct SteadyMotion : fcl::InterpMotion<double> {
  SteadyMotion(const fcl::Transform3d& start, const fcl::Transform3d& end)
      : fcl::InterpMotion<double>(start, end) {
    reference_p.setZero();
    computeVelocity();
  }
};

class FclMotion final : public MotionMethod {
 public:
  FclMotion(std::string name, fcl::GJKSolverType solver, bool turns)
      : MotionMethod(std::move(name), Path::kSteady), turns_(turns) {
    request_.ccd_solver_type = fcl::CCDC_CONSERVATIVE_ADVANCEMENT;
    request_.gjk_solver_type = solver;
  }

  void Prepare(const MotionSet& set) override {
    set_ = &set;
    shapes_.clear();
    ends_.clear();
    for (const Hull& hull : set.hulls->hulls) {
      shapes_.push_back(ToFcl(hull));
      shapes_.back()->computeLocalAABB();
    }
    for (const MotionSet::Query& query : set.queries) {
      ends_.push_back({ToFcl(query.X_WA), ToFcl(query.X_WB.start), ToFcl(query.X_WB.end)});
    }
  }

  Impact Find(size_t query) override {
    const Ends& ends = ends_[query];
    const fcl::TranslationMotion<double> at_rest(ends.a, ends.a);
    if (turns_) return FindOn(query, at_rest, SteadyMotion(ends.start, ends.end));
    return FindOn(query, at_rest, fcl::TranslationMotion<double>(ends.start, ends.end));
  }

 private:
  struct Ends {
    fcl::Transform3d a;
    fcl::Transform3d start;
    fcl::Transform3d end;
  };

  Impact FindOn(size_t query, const fcl::MotionBase<double>& a, const fcl::MotionBase<double>& b) {
    const MotionSet::Query& pair = set_->queries[query];
    fcl::ContinuousCollisionResultd result;
    fcl::continuousCollide<double>(shapes_[pair.hull_a].get(), &a, shapes_[pair.hull_b].get(), &b,
                                   request_, result);
    if (!result.is_collide) return {};
    return {Impact::Verdict::kMeets, result.time_of_contact};
  }

  bool turns_;
  fcl::ContinuousCollisionRequestd request_;
  const MotionSet* set_ = nullptr;
  std::vector<std::shared_ptr<fcl::Convexd>> shapes_;
  std::deque<Ends> ends_;
};

}  // namespace

void AddFclMotions(bool turns, std::vector<std::unique_ptr<MotionMethod>>& methods) {
  methods.push_back(std::make_unique<FclMotion>("FCL", fcl::GST_LIBCCD, turns));
  methods.push_back(std::make_unique<FclMotion>("FCL indep", fcl::GST_INDEP, turns));
}

}  // namespace hulld::bench
