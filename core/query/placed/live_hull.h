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

// A growing hull, ready for questions at every step at the price of a resting one.
//
// What a question needs is a support function, and that of a union is the larger of the two. So a
// hull is a prepared base, a few prepared levels, and a tail of the points that became vertices
// since, which a question scans. A version is a prefix of all of these: it is made in O(1), is
// immutable, and shares everything with other versions. Points that stopped being extreme do no
// harm; preparing drops most of them.
//
// Questions pay for what is prepared (ski rental): each counts what it scanned, and once the scans
// have cost what preparing costs, WantsPreparing() says so. So the total is at most about twice the
// best in hindsight, and a hull that nobody asks about is never prepared. Prepare() makes a level
// of the tail and merges it with those that are not much larger (Bentley and Saxe 1980,
// Decomposable searching problems), so that each point is moved O(log n) times.
//
// Thread-safe: one thread at a time appends, one at a time prepares, any number make versions.
class LiveHull {
 public:
  // A moment in the growth: what was appended up to then. It keeps alive what its version needs.
  class Mark {
   public:
    // The mark of a LiveHull that nothing was appended to.
    Mark() = default;

    int dimension() const { return dimension_; }
    // The bounding box; `low` exceeds `high` when empty.
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

  // Nothing yet.
  LiveHull();
  // `points`: at least the vertices of a hull of this dimension, and no point outside it. None for
  // dimension -1. Cost: O(n), comparisons and distances.
  LiveHull(std::vector<Vector> points, int dimension);
  // What `other` was at `mark`. Cost: O(points of its tail).
  LiveHull(const LiveHull& other, const Mark& mark);
  LiveHull& operator=(const LiveHull&) = delete;

  // Appends what a block brought: at least its points that became vertices, none outside the hull
  // after it. `dimension`: the hull's after the block. Returns the moment after it.
  // Cost: O(points), amortized; O(n) when the dimension grew.
  Mark Append(std::span<const Vector> points, int dimension);
  // The moment after the last Append.
  Mark Now() const;

  // The hull as it was at `mark`, for questions. Requires a mark of this object, or one up to which
  // it was copied (unchecked: a mark does not tell whose it is). Cost: O(1).
  std::shared_ptr<const QueryHull> VersionAt(const Mark& mark) const;
  // At least the vertices of the hull at `mark`, and no point outside it. Cost: O(n).
  std::vector<Vector> PointsAt(const Mark& mark) const;

  // Whether questions have paid for preparing what they scan; as if `more_questions` more had been
  // asked.
  bool WantsPreparing(const Mark& mark, uint64_t more_questions = 0) const;
  // Prepares what there is up to `mark`; versions made from then on use it. Appending and questions
  // go on meanwhile. Cost: O(m log m) for the m points that it moves.
  void Prepare(const Mark& mark);

  // What it holds, shared with its versions. Bytes.
  size_t MemoryBytes() const;
  // Something that it shares with versions, which may outlive it; told from others by its address,
  // which is never followed.
  struct Shared {
    const void* what;
    size_t bytes;
  };
  // What a version at `mark` shares, and what one after the last Append does; each once.
  std::vector<Shared> SharedBy(const Mark& mark) const;
  // MemoryBytes() without that.
  static size_t OwnBytes();
  // Points that Prepare() moved so far, each as often as it was moved: for tests.
  uint64_t points_moved() const { return points_moved_.load(std::memory_order_relaxed); }

 private:
  using Parts = std::shared_ptr<const LiveParts>;

  // What serves a mark best. Requires the mutex (unchecked: a std::mutex does not tell who holds
  // it).
  const Parts& PartsFor(const Mark& mark) const;
  LiveParts Prepared(const LiveParts& before, const Mark& mark);
  static void AddShared(const LiveParts& parts, std::vector<Shared>& shared);
  static void Begin(std::vector<Vector> points, int dimension, Mark& next);
  static void AppendToTail(std::span<const Vector> points, Mark& next);

  // Held by the thread that appends, and at the end of Prepare() for as long as that copies points.
  // Taken before mutex_.
  std::mutex changing_;
  // Held for moments only, so that no version waits for what is appended.
  mutable std::mutex mutex_;
  Mark now_;
  // Points scanned since the last Prepare().
  std::shared_ptr<std::atomic<uint64_t>> scanned_;
  std::atomic<uint64_t> points_moved_ = 0;
};

}  // namespace hulld

#endif  // HULLD_CORE_QUERY_PLACED_LIVE_HULL_H_
