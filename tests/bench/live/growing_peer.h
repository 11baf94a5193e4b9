#ifndef HULLD_TESTS_BENCH_LIVE_GROWING_PEER_H_
#define HULLD_TESTS_BENCH_LIVE_GROWING_PEER_H_

#include <memory>
#include <span>

#include "core/numeric/vector.h"
#include "core/query/terms/pose.h"

namespace hulld::bench {

// Bullet's hull of a growing set of points: it keeps and scans all of them.
class GrowingPeer {
 public:
  virtual ~GrowingPeer() = default;
  virtual void Add(const Vector& point) = 0;
  // Updates its bounding box, which no query needs.
  virtual void UpdateBox() = 0;
  // Returns true if it collides with another hull at pose X_AB: by btGjkEpaSolver2, and by
  // btGjkPairDetector.
  virtual bool CollidesBySolver(const GrowingPeer& other, const Pose& X_AB) const = 0;
  virtual bool CollidesByDetector(const GrowingPeer& other, const Pose& X_AB) const = 0;
};

// Returns null if Bullet is not installed.
std::unique_ptr<GrowingPeer> MakeGrowingPeer(std::span<const Vector> points);

}  // namespace hulld::bench

#endif  // HULLD_TESTS_BENCH_LIVE_GROWING_PEER_H_
