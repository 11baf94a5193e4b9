#ifndef HULLD_CORE_QUERY_SCENE_SCENE_H_
#define HULLD_CORE_QUERY_SCENE_SCENE_H_

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <set>
#include <span>
#include <utility>
#include <vector>

#include "core/query/batch.h"
#include "core/query/body/body_search.h"
#include "core/query/body/placed_body.h"
#include "core/query/box_tree.h"
#include "core/query/motion/swept_box.h"
#include "core/query/placed/placed_hull.h"
#include "core/query/terms/answer.h"
#include "core/query/terms/query_options.h"
#include "core/query/terms/rung.h"

namespace hulld {

// Two groups of placements. Equal groups select the pairs within that group.
struct GroupPair {
  uint32_t first;
  uint32_t second;
};

struct SceneOptions {
  // Options for each pair. A pair is found if it is not SEPARATED or, with a clearance, if its
  // separation is within the clearance. Further details are computed for found pairs only.
  QueryOptions query;
  // Group of each placement, or empty if there are no groups.
  std::span<const uint32_t> groups;
  // Pairs of groups to skip.
  std::span<const GroupPair> ignored_groups;
  // Empty, or each placement as a body. Placements that are not hulls are queried in this form.
  std::span<const PlacedBody> bodies;
  // One against many: restricts the pairs to those with at least one of the first `movers`
  // placements.
  std::optional<uint32_t> movers;
  // OpenMP threads.
  int threads = 1;
};

// A found pair, a < b, or a pair with an error.
struct SceneAnswer {
  PlacedPair pair;
  absl::StatusOr<Answer> answer;
};

struct SceneTotals {
  // Number of pairs selected by groups and movers; of these, pairs with intersecting boxes; of
  // these, found pairs.
  uint64_t pairs = 0;
  uint64_t candidates = 0;
  uint64_t found = 0;
  // Candidates by deciding rung.
  RungCounts rungs;
};

// A scene for callers with their own threads. FindCollisions is equivalent to iterating the
// SceneCandidates of every placement and calling Query for each candidate. Const functions are
// thread-safe.
class SceneSearch {
 public:
  // Both arguments must outlive this object; `bodies`, if any, has one entry for each placement.
  // Computes boxes on options.threads. INVALID_ARGUMENT: `groups` is not empty and does not have
  // one entry per placement. CANCELLED: should_stop returned true. Cost: O(n log n).
  static absl::StatusOr<SceneSearch> Make(std::span<const PlacedHull> placements,
                                          const SceneOptions& options);
  // Takes precomputed boxes: BoundingBox of each placement, at rest; otherwise MovingBoxOf. The
  // answers of Query are about placements at rest.
  static absl::StatusOr<SceneSearch> Make(std::span<const PlacedHull> placements,
                                          const SceneOptions& options, std::vector<Box> boxes);
  static absl::StatusOr<SceneSearch> Make(std::span<const PlacedHull> placements,
                                          const SceneOptions& options,
                                          std::vector<MovingBox> boxes);

  // Pairs selected by the groups and movers.
  uint64_t pairs() const { return pairs_; }
  // Number of placements for which candidates are listed: all, or the movers.
  uint32_t size() const { return size_; }

  // Returns the answer of a candidate, with the requested details if the pair is found. `of_body`:
  // if not null, receives the details specific to bodies. CANCELLED: should_stop returned true.
  // INVALID_ARGUMENT, RESOURCE_EXHAUSTED: for a candidate with a body, as in CheckBodies.
  absl::StatusOr<Answer> Query(uint32_t a, uint32_t b, PiecesAnswer* of_body = nullptr) const;
  // Returns true if the pair is not SEPARATED or is within the clearance.
  bool IsFound(const Answer& answer) const;
  // In a scene with motions: returns false only if the boxes of the pair are disjoint at each time
  // up to `until`.
  bool MayMeet(uint32_t a, uint32_t b, double until) const {
    return hulld::MayMeet(moving_[a], moving_[b], until);
  }

  // Memory of the boxes and their tree.
  size_t MemoryBytes() const {
    return boxes_.capacity() * sizeof(Box) + moving_.capacity() * sizeof(MovingBox) +
           first_others_.capacity() * sizeof(uint32_t) + tree_.MemoryBytes() + sizeof *this;
  }

 private:
  friend class SceneCandidates;

  SceneSearch(std::span<const PlacedHull> placements, const SceneOptions& options);

  static absl::StatusOr<SceneSearch> MakeWith(std::span<const PlacedHull> placements,
                                              const SceneOptions& options,
                                              std::optional<std::vector<Box>> boxes,
                                              std::vector<MovingBox> moving);
  // Both return false if should_stop returned true; the result must then be discarded.
  bool ComputeBoxes();
  bool BuildTree();
  bool IsIgnored(uint32_t a, uint32_t b) const;
  bool IsBody(uint32_t placement) const {
    return !options_->bodies.empty() && !options_->bodies[placement].body().is_hull();
  }
  absl::StatusOr<Answer> QueryWith(uint32_t a, uint32_t b, const QueryOptions& options,
                                   PiecesAnswer* of_body) const;
  uint64_t CountPairs() const;
  // Returns the first placement that may be a candidate of `placement`.
  uint32_t FirstCandidate(uint32_t placement) const {
    return first_others_.empty() ? placement + 1 : first_others_[placement];
  }

  std::span<const PlacedHull> placements_;
  const SceneOptions* options_;
  // Computes the relation, and the comparison with the clearance.
  QueryOptions first_look_;
  std::set<std::pair<uint32_t, uint32_t>> ignored_;
  // For each placement, the index of the next one, or of the first one after its own group if pairs
  // within that group are ignored. Empty if no groups are ignored. A search skips subtrees with
  // lower indices.
  std::vector<uint32_t> first_others_;
  std::vector<Box> boxes_;
  // Parallel to boxes_, which are around them; empty if all placements are at rest.
  std::vector<MovingBox> moving_;
  // The boxes from the first candidate of any placement on. If many rays precede a thousand hulls,
  // for example, the tree contains only the hulls. Index 0 of the tree is the placement
  // tree_first_.
  BoxTree tree_{std::span<const Box>()};
  uint32_t tree_first_ = 0;
  uint64_t pairs_ = 0;
  uint32_t size_ = 0;
};

// The candidates of one placement: the placements after it, in ascending order, with boxes that
// intersect its own (grown by the clearance), in motion at some time (MayMeet), and that the groups
// do not exclude. The search is resumable between any two steps. Memory: at most n / 8 bytes, for
// any number of candidates among the n placements.
class SceneCandidates {
 public:
  // Starts with placement `a` of a scene, which must outlive this object. Requires: a <
  // scene.size().
  void Start(const SceneSearch& scene, uint32_t a);

  // Visits at most `nodes` nodes of the tree. Returns true if all candidates have been gathered.
  // Cost: O(nodes); in total O(log n) plus the output.
  bool Gather(uint64_t nodes);

  // Returns the next candidate; none after the last. Requires: all candidates have been gathered.
  std::optional<uint32_t> Next();

  size_t MemoryBytes() const {
    return listed_.capacity() * sizeof(uint32_t) + marked_.capacity() * sizeof(uint64_t) +
           waiting_.capacity() * sizeof(uint32_t);
  }

 private:
  // Append candidates from at most `nodes` nodes of the tree; return true if none is left.
  bool AppendMeeting(uint64_t nodes);
  bool AppendMeetingInMotion(uint64_t nodes);

  const SceneSearch* scene_ = nullptr;
  uint32_t a_ = 0;
  uint32_t first_ = 0;
  Box box_;
  BoxTree::Cursor cursor_;
  // In motion: the box, and the nodes still to visit.
  MovingBox moving_;
  std::vector<uint32_t> waiting_;
  bool is_gathered_ = false;
  // Candidates, if there are few. For larger sets, a bit for each placement, which also sorts them.
  std::vector<uint32_t> listed_;
  std::vector<uint64_t> marked_;
  bool is_marked_ = false;
  // Index of the next candidate in the list or the bits.
  size_t next_ = 0;
};

// Maximum number of answers that FindCollisions buffers: three to four MiB with certificates, and
// enough for many threads. Not tuned.
inline constexpr size_t kMaxEmittedAnswers = 4096;

// Finds all colliding pairs of placements. A tree of bounding boxes yields the pairs with
// intersecting boxes, and each of these is answered like CheckCollision. Calls `emit` on the
// calling thread, in ascending order of (a, b); neither the answers nor their order depend on the
// number of threads. `emit` may block, which throttles the search. At most kMaxEmittedAnswers
// answers are buffered, for any number of collisions. INVALID_ARGUMENT: `groups` is not empty and
// does not have one entry per placement. CANCELLED: should_stop returned true; answers emitted
// before remain valid. Cost: O(n log n) plus the candidates.
absl::StatusOr<SceneTotals> FindCollisions(
    std::span<const PlacedHull> placements, const SceneOptions& options,
    const std::function<void(std::span<const SceneAnswer>)>& emit);

}  // namespace hulld

#endif  // HULLD_CORE_QUERY_SCENE_SCENE_H_
