#ifndef HULLD_CORE_QUERY_PLACED_LIVE_HULL_H_
#define HULLD_CORE_QUERY_PLACED_LIVE_HULL_H_

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <mutex>
#include <span>
#include <vector>

#include "core/numeric/exponent_limits.h"
#include "core/numeric/vector.h"
#include "core/query/placed/query_hull.h"

namespace hulld {

// A growing hull that can be queried at every step at the cost of a static one.
//
// A query needs a support function, and the support function of a union is the maximum over its
// parts. A hull is therefore a prepared base, a few prepared levels, and a tail of the points that
// have become vertices since, which a query scans. A version is a prefix of all of these: it takes
// O(1) to create, is immutable, and shares all data with other versions. Points that are no longer
// extreme are harmless; preparing drops most of them.
//
// Queries pay for preparation (the ski rental rule): each query counts the points that it scans,
// and when the scans have cost as much as preparation would, WantsPreparing() returns true. The
// total is at most about twice the optimum in hindsight, and a hull that is never queried is never
// prepared. Prepare() builds a level from the tail and merges it with levels that are not much
// larger (Bentley and Saxe 1980, Decomposable searching problems), so that each point is moved
// O(log n) times.
//
// Thread-safe: one thread appends, one prepares, and any number create versions, concurrently.
class LiveHull {
 public:
  // A position in the growth: the points appended up to it. Keeps the data of its version alive.
  class Mark {
   public:
    // The mark of an empty LiveHull.
    Mark() = default;

    int dimension() const { return dimension_; }
    // The bounding box; `low` exceeds `high` if empty.
    const Vector& low() const { return low_; }
    const Vector& high() const { return high_; }

   private:
    friend class LiveHull;
    std::shared_ptr<const LiveParts> parts_;
    uint64_t count_ = 0;
    int dimension_ = -1;
    int exponent_ = kAboveAllExponents;
    Vector low_ = Vector::Constant(kLargestDouble);
    Vector high_ = Vector::Constant(-kLargestDouble);
  };

  // Empty.
  LiveHull();
  // `points`: at least the vertices of a hull of this dimension, and no point outside it. Empty for
  // dimension -1. Cost: O(n), comparisons and distances.
  LiveHull(std::vector<Vector> points, int dimension);
  // Copies the state of `other` at `mark`. Cost: O(points of its tail).
  LiveHull(const LiveHull& other, const Mark& mark);
  LiveHull& operator=(const LiveHull&) = delete;

  // Appends the points of a block: at least those that became vertices, and none outside the hull
  // after the block. `dimension`: that of the hull after the block. Returns the mark after the
  // block. Cost: O(points), amortized; O(n) if the dimension grew.
  Mark Append(std::span<const Vector> points, int dimension);
  // Returns the mark after the last Append.
  Mark Now() const;

  // Returns the hull at `mark`, for queries. Requires: a mark of this object, or one up to which it
  // was copied (unchecked: a mark does not record its owner). Cost: O(1).
  std::shared_ptr<const QueryHull> VersionAt(const Mark& mark) const;
  // Returns at least the vertices of the hull at `mark`, and no point outside it. Cost: O(n).
  std::vector<Vector> PointsAt(const Mark& mark) const;

  // Returns true if queries have paid for preparing the points that they scan, assuming
  // `more_queries` additional queries.
  bool WantsPreparing(const Mark& mark, uint64_t more_queries = 0) const;
  // Prepares the state up to `mark`; later versions use it. Appends and queries may run
  // concurrently. Cost: O(m log m) for the m points that it moves.
  void Prepare(const Mark& mark);

  // Memory, including data shared with its versions, in bytes.
  size_t MemoryBytes() const;
  // Data shared with versions, which may outlive this object. Identified by its address, which is
  // never dereferenced.
  struct Shared {
    const void* what;
    size_t bytes;
  };
  // Returns the data shared with a version at `mark` and with one after the last Append, without
  // duplicates.
  std::vector<Shared> SharedBy(const Mark& mark) const;
  // MemoryBytes() without shared data.
  static size_t OwnBytes();
  // Number of points that Prepare() has moved, counting repeated moves. For tests.
  uint64_t points_moved() const { return points_moved_.load(std::memory_order_relaxed); }

 private:
  using Parts = std::shared_ptr<const LiveParts>;

  // Returns the best parts for a mark. Requires mutex_ (unchecked: a std::mutex does not record its
  // holder).
  const Parts& PartsFor(const Mark& mark) const;
  LiveParts Prepared(const LiveParts& before, const Mark& mark);
  static void AddShared(const LiveParts& parts, std::vector<Shared>& shared);
  static void Begin(std::vector<Vector> points, int dimension, Mark& next);
  static void AppendToTail(std::span<const Vector> points, Mark& next);

  // Held during appends, and at the end of Prepare() while it copies points. Acquired before
  // mutex_.
  std::mutex changing_;
  // Held briefly, so that creating a version never waits for an append.
  mutable std::mutex mutex_;
  Mark now_;
  // Points scanned since the last Prepare().
  std::shared_ptr<std::atomic<uint64_t>> scanned_;
  std::atomic<uint64_t> points_moved_ = 0;
};

}  // namespace hulld

#endif  // HULLD_CORE_QUERY_PLACED_LIVE_HULL_H_
