#include "tests/bench/motions/motion_methods.h"

#include <utility>

#include "core/query/collision.h"
#include "core/query/motion/first_contact.h"

namespace hulld::bench {
namespace {

class HulldMotion final : public MotionMethod {
 public:
  HulldMotion(std::string name, double resolution)
      : MotionMethod(std::move(name), Path::kLinear), resolution_(resolution) {}

  void Prepare(const MotionSet& set) override { set_ = &set; }

  Impact Find(size_t query) override {
    const MotionSet::Query& pair = set_->queries[query];
    const QueryHull& a = set_->query_a(pair);
    const QueryHull& b = set_->query_b(pair);
    MotionOptions options;
    if (resolution_ > 0) {
      options.max_time_error = resolution_;
      options.resolution = resolution_ * (a.max_abs_coordinate() + b.max_abs_coordinate());
    }
    const FirstContact contact =
        *FindFirstContact({a, {pair.X_WA, pair.X_WA}}, {b, pair.X_WB}, options);
    if (contact.relation == Relation::kSeparated) return {};
    if (!contact.contact_time) return {Impact::Verdict::kOpen};
    return {Impact::Verdict::kMeets, *contact.contact_time,
            *contact.contact_time - contact.separated_until};
  }

 private:
  double resolution_;
  const MotionSet* set_ = nullptr;
};

class Sampling final : public MotionMethod {
 public:
  explicit Sampling(int poses)
      : MotionMethod(std::to_string(poses) + " poses", Path::kLinear), poses_(poses) {}

  void Prepare(const MotionSet& set) override {
    set_ = &set;
    a_.clear();
    for (const MotionSet::Query& query : set.queries) {
      a_.push_back(*PlacedHull::Make(set.query_a(query), query.X_WA));
    }
  }

  Impact Find(size_t query) override {
    const Motion& X_WB = set_->queries[query].X_WB;
    const QueryHull& b = set_->query_b(set_->queries[query]);
    PairCache cache;
    for (int i = 0; i < poses_; ++i) {
      const double time = static_cast<double>(i) / (poses_ - 1);
      Pose X;
      for (int k = 0; k < 4; ++k) X.q[k] = (1 - time) * X_WB.start.q[k] + time * X_WB.end.q[k];
      X.t = (1 - time) * X_WB.start.t + time * X_WB.end.t;
      const PlacedHull placed(b, X);
      if (CheckCollision(a_[query], placed, {}, &cache)->relation != Relation::kSeparated) {
        return {Impact::Verdict::kMeets, time};
      }
    }
    return {};
  }

 private:
  int poses_;
  const MotionSet* set_ = nullptr;
  std::vector<PlacedHull> a_;
};

}  // namespace

std::unique_ptr<MotionMethod> MakeHulldMotion(std::string name, double resolution) {
  return std::make_unique<HulldMotion>(std::move(name), resolution);
}

std::unique_ptr<MotionMethod> MakeSampling(int poses) { return std::make_unique<Sampling>(poses); }

std::vector<std::unique_ptr<MotionMethod>> MakePeerMotions(bool turns) {
  std::vector<std::unique_ptr<MotionMethod>> methods;
#ifdef HULLD_HAVE_FCL
  AddFclMotions(turns, methods);
#endif
#ifdef HULLD_HAVE_BULLET
  AddBulletMotions(turns, methods);
#endif
  return methods;
}

}  // namespace hulld::bench
