#ifndef HULLD_TESTS_BENCH_LIVE_GROWING_PEER_H_
#define HULLD_TESTS_BENCH_LIVE_GROWING_PEER_H_

#include <memory>
#include <span>

#include "core/numeric/vector.h"
#include "core/query/terms/pose.h"

namespace hulld::bench {

// Bullet's hull of points, to which more are added: it keeps all of them and scans them.
class GrowingPeer {
 public:
  virtual ~GrowingPeer() = default;
  virtual void Add(const Vector& point) = 0;
  // Brings its bounding box up to date, which no question needs.
  virtual void UpdateBox() = 0;
  // Whether it collides with another, at the pose X_AB of that: by btGjkEpaSolver2, and by
  // btGjkPairDetector.
  virtual bool CollidesBySolver(const GrowingPeer& other, const Pose& X_AB) const = 0;
  virtual bool CollidesByDetector(const GrowingPeer& other, const Pose& X_AB) const = 0;
};

// Null where Bullet is not installed.
std::unique_ptr<GrowingPeer> MakeGrowingPeer(std::span<const Vector> points);

}  // namespace hulld::bench

#endif  // HULLD_TESTS_BENCH_LIVE_GROWING_PEER_H_
