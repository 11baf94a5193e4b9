#ifndef HULLD_TESTS_BENCH_MOTIONS_MOTION_METHODS_H_
#define HULLD_TESTS_BENCH_MOTIONS_MOTION_METHODS_H_

#include <memory>
#include <string>
#include <vector>

#include "tests/bench/motions/motion_sets.h"
#include "tests/bench/motions/motion_truth.h"

namespace hulld::bench {

// An answer to a motion.
struct Impact {
  enum class Verdict : uint8_t { kApart, kMeets, kOpen };
  Verdict verdict = Verdict::kApart;
  // The time of a contact.
  double time = 1;
  // Length of the interval that is proven to contain the first contact; 0 without a proof.
  double bracket = 0;
};

// A way to find the first contact of a motion.
class MotionMethod {
 public:
  MotionMethod(std::string name, Path path) : name_(std::move(name)), path_(path) {}
  virtual ~MotionMethod() = default;

  const std::string& name() const { return name_; }
  // The path that it follows between two poses.
  Path path() const { return path_; }

  // Converts hulls and poses to the method's own types. The set must outlive its use.
  virtual void Prepare(const MotionSet& set) = 0;
  // Answers a motion of that set.
  virtual Impact Find(size_t query) = 0;

 private:
  std::string name_;
  Path path_;
};

// Returns hulld. A resolution, relative to the hulls' sizes, is also the largest width of brackets;
// 0 for the defaults.
std::unique_ptr<MotionMethod> MakeHulldMotion(std::string name, double resolution = 0);
// Returns hulld's static query at evenly spaced poses, both ends included, with the cache of a
// stream.
std::unique_ptr<MotionMethod> MakeSampling(int poses);

// Returns the peers available at build time; `turns`: for motions that rotate.
//
//   FCL                continuousCollide by conservative advancement on Convex<double>, its only
//                      solver for convex shapes that does not sample; it ignores toc_err
//   Bullet             btContinuousConvexCollision; double precision, margin 0
//   Bullet, scaled     the same on lengths times 1000, because its tolerance is 0.001
//   Bullet, cast       btSubsimplexConvexCast, for translations
std::vector<std::unique_ptr<MotionMethod>> MakePeerMotions(bool turns);

// Each is linked only if its library was found: HULLD_HAVE_FCL, HULLD_HAVE_BULLET.
void AddFclMotions(bool turns, std::vector<std::unique_ptr<MotionMethod>>& methods);
void AddBulletMotions(bool turns, std::vector<std::unique_ptr<MotionMethod>>& methods);

}  // namespace hulld::bench

#endif  // HULLD_TESTS_BENCH_MOTIONS_MOTION_METHODS_H_
