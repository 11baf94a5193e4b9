#ifndef HULLD_TESTS_BENCH_CLIMBING_HULL_H_
#define HULLD_TESTS_BENCH_CLIMBING_HULL_H_

#include <cstdint>
#include <vector>

#include "core/hull/hull.h"

namespace hulld::bench {

// Support points as peers find them: a scan of a small hull, hill climbing along edges from a fixed
// vertex of a large one. Scalar is the type that vertices are rounded to.
template <typename Scalar>
class ClimbingHull {
 public:
  using Vector3 = Eigen::Matrix<Scalar, 3, 1>;

  explicit ClimbingHull(const Hull& hull) {
    for (const hulld::Vector& v : hull.vertices()) vertices_.push_back(v.cast<Scalar>());
    center_.setZero();
    for (const Vector3& v : vertices_) center_ += v / static_cast<Scalar>(vertices_.size());
    if (vertices_.size() <= kScanLimit || hull.dimension() < 3) return;
    std::vector<std::vector<uint32_t>> neighbors(vertices_.size());
    for (const Edge& edge : hull.edges()) {
      neighbors[edge.tail].push_back(edge.head);
      neighbors[edge.head].push_back(edge.tail);
    }
    starts_.push_back(0);
    for (const std::vector<uint32_t>& list : neighbors) {
      neighbors_.insert(neighbors_.end(), list.begin(), list.end());
      starts_.push_back(static_cast<uint32_t>(neighbors_.size()));
    }
  }

  const Vector3& center() const { return center_; }

  const Vector3& Farthest(const Vector3& n) const { return starts_.empty() ? Scan(n) : Climb(n); }

 private:
  // Where FCL begins to climb.
  static constexpr size_t kScanLimit = 32;

  const Vector3& Scan(const Vector3& n) const {
    size_t best = 0;
    Scalar best_value = n.dot(vertices_[0]);
    for (size_t i = 1; i < vertices_.size(); ++i) {
      const Scalar value = n.dot(vertices_[i]);
      if (value > best_value) {
        best_value = value;
        best = i;
      }
    }
    return vertices_[best];
  }

  const Vector3& Climb(const Vector3& n) const {
    uint32_t best = 0;
    Scalar best_value = n.dot(vertices_[0]);
    for (uint32_t from = ~uint32_t{0}; from != best;) {
      from = best;
      for (uint32_t k = starts_[from]; k < starts_[from + 1]; ++k) {
        const Scalar value = n.dot(vertices_[neighbors_[k]]);
        if (value > best_value) {
          best_value = value;
          best = neighbors_[k];
        }
      }
    }
    return vertices_[best];
  }

  std::vector<Vector3> vertices_;
  Vector3 center_;
  // The neighbours of vertex i are those from starts_[i] to starts_[i + 1]. Empty when scanned.
  std::vector<uint32_t> starts_;
  std::vector<uint32_t> neighbors_;
};

}  // namespace hulld::bench

#endif  // HULLD_TESTS_BENCH_CLIMBING_HULL_H_
