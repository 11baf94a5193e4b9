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
#include "core/query/placed/placed_hull.h"
#include "core/query/terms/answer.h"
#include "core/query/terms/query_options.h"
#include "core/query/terms/rung.h"

namespace hulld {

// Two groups of placements; the same twice: pairs within that group.
struct GroupPair {
  uint32_t first;
  uint32_t second;
};

struct SceneOptions {
  // What is asked of each pair. A pair is found when it is not SEPARATED, or with a clearance when
  // its separation is within that. What else is wanted is computed of found pairs alone.
  QueryOptions query;
  // The group of each placement, or empty when there are no groups.
  std::span<const uint32_t> groups;
  // Pairs of groups that are never asked about.
  std::span<const GroupPair> ignored_groups;
  // Empty, or each placement as a body: those that are no hulls are asked about in this form.
  std::span<const PlacedBody> bodies;
  // One against many: only pairs that include at least one of the first `movers` placements.
  std::optional<uint32_t> movers;
  // OpenMP threads.
  int threads = 1;
};

// A found pair, a < b, or one that could not be answered.
struct SceneAnswer {
  PlacedPair pair;
  absl::StatusOr<Answer> answer;
};

struct SceneTotals {
  // Pairs that the groups and movers leave; those of them whose boxes meet; and those of the latter
  // that are found.
  uint64_t pairs = 0;
  uint64_t candidates = 0;
  uint64_t found = 0;
  // Candidates by the rung that decided.
  RungCounts rungs;
};

// A scene for callers that have threads of their own: FindCollisions is the SceneCandidates of
// every placement, and of each candidate Ask. Const functions may be called by several threads at
// once.
class SceneSearch {
 public:
  // Both must outlive this; bodies, if there are any, are one for each placement. Cost: O(n log n);
  // boxes are computed on options.threads. INVALID_ARGUMENT: `groups` is neither empty nor one for
  // each placement. CANCELLED: should_stop said so.
  static absl::StatusOr<SceneSearch> Make(std::span<const PlacedHull> placements,
                                          const SceneOptions& options);
  // The same for a caller that computed the boxes: BoundingBox of each placement.
  static absl::StatusOr<SceneSearch> Make(std::span<const PlacedHull> placements,
                                          const SceneOptions& options, std::vector<Box> boxes);

  // Pairs that the groups and movers leave.
  uint64_t pairs() const { return pairs_; }
  // Placements that have candidates of their own: all, or the movers.
  uint32_t size() const { return size_; }

  // The answer of a candidate, and what else is wanted of it if it is found. of_body: where not
  // null, takes what an answer about a body has beside that. CANCELLED: should_stop said so.
  // INVALID_ARGUMENT, RESOURCE_EXHAUSTED: a candidate with a body, as in CheckBodies.
  absl::StatusOr<Answer> Ask(uint32_t a, uint32_t b, PiecesAnswer* of_body = nullptr) const;
  // Whether the answer makes a pair found: it is not SEPARATED, or within the clearance.
  bool IsFound(const Answer& answer) const;

  // What this holds: the boxes and their tree.
  size_t MemoryBytes() const {
    return boxes_.capacity() * sizeof(Box) + tree_.MemoryBytes() + sizeof *this;
  }

 private:
  friend class SceneCandidates;

  SceneSearch(std::span<const PlacedHull> placements, const SceneOptions& options);

  static absl::StatusOr<SceneSearch> MakeWith(std::span<const PlacedHull> placements,
                                              const SceneOptions& options,
                                              std::optional<std::vector<Box>> boxes);
  // False: should_stop said so, and what was made is to be dropped.
  bool ComputeBoxes();
  bool BuildTree();
  bool IsIgnored(uint32_t a, uint32_t b) const;
  bool IsBody(uint32_t placement) const {
    return !options_->bodies.empty() && !options_->bodies[placement].body().is_hull();
  }
  absl::StatusOr<Answer> AskWith(uint32_t a, uint32_t b, const QueryOptions& options,
                                 PiecesAnswer* of_body) const;
  uint64_t CountPairs() const;

  std::span<const PlacedHull> placements_;
  const SceneOptions* options_;
  // The relation, and whether it is within the clearance.
  QueryOptions first_look_;
  std::set<std::pair<uint32_t, uint32_t>> ignored_;
  std::vector<Box> boxes_;
  BoxTree tree_{std::span<const Box>()};
  uint64_t pairs_ = 0;
  uint32_t size_ = 0;
};

// The candidates of one placement: those after it whose boxes meet its own (grown by the clearance)
// and that the groups leave, ascending. They are found piece by piece, so that a caller may leave
// off between any two, and take n / 8 bytes at most, however many of the n placements they are.
class SceneCandidates {
 public:
  // Begins with placement `a` of a scene, which must outlive this. Requires a < scene.size().
  void Start(const SceneSearch& scene, uint32_t a);

  // Looks at `nodes` nodes of the tree at most. Whether all candidates are gathered by now. Cost:
  // O(nodes); all of it is O(log n) beyond what it finds.
  bool Gather(uint64_t nodes);

  // The next candidate; none after the last. Requires that all are gathered.
  std::optional<uint32_t> Next();

  size_t MemoryBytes() const {
    return listed_.capacity() * sizeof(uint32_t) + marked_.capacity() * sizeof(uint64_t);
  }

 private:
  const SceneSearch* scene_ = nullptr;
  uint32_t a_ = 0;
  Box box_;
  BoxTree::Cursor cursor_;
  bool is_gathered_ = false;
  // A few are listed. Beyond that, a bit marks each, which also sorts them.
  std::vector<uint32_t> listed_;
  std::vector<uint64_t> marked_;
  bool is_marked_ = false;
  // The first that is not taken yet: an index into one or the other.
  size_t next_ = 0;
};

// The answers that FindCollisions holds at a time. A choice: three or four MiB with certificates,
// and enough for many threads.
inline constexpr size_t kMostEmittedAnswers = 4096;

// Which of all pairs of placements collide: a tree of bounding boxes leaves the pairs whose boxes
// meet, and each of these is answered as CheckCollision answers it. Answers are handed to `emit`,
// on the calling thread, in ascending order of (a, b); neither they nor their order depend on the
// number of threads. `emit` may wait, which holds the search back. However many pairs collide, at
// most kMostEmittedAnswers of them are held at a time.
// INVALID_ARGUMENT: `groups` is neither empty nor one for each placement. CANCELLED: should_stop
// said so; what was emitted before stands. Cost: O(n log n) beyond the candidates.
absl::StatusOr<SceneTotals> FindCollisions(
    std::span<const PlacedHull> placements, const SceneOptions& options,
    const std::function<void(std::span<const SceneAnswer>)>& emit);

}  // namespace hulld

#endif  // HULLD_CORE_QUERY_SCENE_SCENE_H_
