#ifndef HULLD_CORE_QUERY_BODY_BODY_SEARCH_H_
#define HULLD_CORE_QUERY_BODY_BODY_SEARCH_H_

#include <absl/status/statusor.h>

#include <array>
#include <cstdint>
#include <limits>
#include <optional>
#include <vector>

#include "core/base/stop_poll.h"
#include "core/query/body/box_gap.h"
#include "core/query/body/piece_certification.h"
#include "core/query/body/placed_body.h"
#include "core/query/box_tree.h"
#include "core/query/terms/answer.h"
#include "core/query/terms/query_options.h"
#include "core/query/terms/rung.h"

namespace hulld {

// What an answer about bodies has beside one about hulls.
struct PiecesAnswer {
  // The pair that decided. None where the relation alone shows that no pair collides, nor is within
  // the clearance; where either body holds no points, too.
  std::optional<PiecePair> pieces;
  // When wanted, what proves the relation (PieceCertification), and Answer::certificate is none.
  std::vector<PieceCertificate> certificates;
};

struct BodyAnswer : PiecesAnswer {
  // The answer for the two bodies. Axis, witness points and analysis are those of the pair that
  // decided.
  Answer answer;
};

// What a search looked at.
struct BodyCounts {
  // Pairs of boxes, and pairs of pieces that were asked about as hulls are.
  uint64_t boxes = 0;
  uint64_t pairs = 0;
};

// The relation of two bodies: the strongest over all pairs of a piece of A and a piece of B,
// OVERLAPPING, WITHIN_TOLERANCE, TOUCHING, SEPARATED in this order; the separation: the least over
// all pairs, so the distance of the nearest pair, or minus the depth of the deepest. Each pair is
// decided as two hulls are, at the exact products of the poses.
//
// Two trees of boxes are descended together, first where boxes are nearest. Without wishes beyond
// the relation and the clearance, the first pair that no other can outdo ends the search and is the
// named pair. With other wishes, the pair of the least separation is named. So swapping A and B
// mirrors an answer, and the named pair does not depend on threads.
//
// A certificate does not count among these wishes: where it is wanted, those of pieces that prove
// the relation are found once it is known.
//
// The search is made in steps, so that long ones can be cut into slices. Cost: O(log n) boxes and
// the pairs that are near, where boxes of pieces overlap little; that of PieceCertification comes
// on top.
class BodySearch {
 public:
  // All must outlive the search. `options` must be valid (ValidateBodyOptions).
  BodySearch(const PlacedBody& a, const PlacedBody& b, const QueryOptions& options);
  BodySearch(const BodySearch&) = delete;
  BodySearch& operator=(const BodySearch&) = delete;

  // Makes at most this many steps, of one node or one pair of pieces each. Returns whether the
  // search has ended. CANCELLED: should_stop said so. RESOURCE_EXHAUSTED: more certificates would
  // be needed than options.max_piece_certificates.
  absl::StatusOr<bool> Advance(uint64_t steps);
  // Requires that the search has ended; once.
  absl::StatusOr<BodyAnswer> Take();
  const BodyCounts& counts() const { return counts_; }

 private:
  // X and Y are A and B, or B and A: the order that does not depend on which comes first.
  struct Nodes {
    uint32_t x;
    uint32_t y;
    double gap;
  };
  struct Candidate {
    // Positions in the leaves, and indices of the pieces.
    uint32_t slot_x;
    uint32_t slot_y;
    uint32_t piece_x;
    uint32_t piece_y;
    double gap;
  };
  // The pieces of a leaf that were placed.
  struct PlacedLeaf {
    uint32_t node = std::numeric_limits<uint32_t>::max();
    std::array<std::optional<PlacedPiece>, BoxTree::kLeafBoxes> pieces;

    void Enter(uint32_t leaf);
    const PlacedHull& At(const PlacedBody& body, uint32_t slot, uint32_t piece);
  };

  double Gap(const Box& of_x, const Box& of_y);
  // No pair farther apart than this can change the answer.
  double Limit() const { return wants_least_ ? least_high_ : limit_; }
  void Descend(const Nodes& nodes);
  void Push(uint32_t x, uint32_t y);
  void EnterLeaves(const Nodes& nodes);
  absl::Status Search();
  absl::Status Prove();
  absl::Status Ask(const Candidate& candidate);
  void TakeUp(const Answer& answer, PiecePair pieces);
  void TakeUpSeparation(const Answer& answer, PiecePair pieces);
  absl::StatusOr<BodyAnswer> TakeLeast() const;
  BodyAnswer TakeRelation() const;

  const PlacedBody* a_;
  const PlacedBody* b_;
  const PlacedBody* x_;
  const PlacedBody* y_;
  const QueryOptions* options_;
  // What is asked of each pair.
  QueryOptions each_;
  bool wants_least_;
  double limit_ = 0;
  BoxGap gap_;
  StopPoll poll_;

  std::vector<Nodes> waiting_;
  // Pairs of pieces from two leaves. The search takes them from the end, where the nearest ones
  // are.
  std::vector<Candidate> candidates_;
  PlacedLeaf leaf_x_;
  PlacedLeaf leaf_y_;
  // Whether the relation and what decided are known.
  bool found_ = false;
  bool ended_ = false;
  std::optional<PieceCertification> certification_;

  BodyCounts counts_;
  Relation relation_ = Relation::kSeparated;
  Rung rung_ = Rung::kBounds;
  bool within_clearance_ = false;
  std::optional<PiecePair> decided_;
  // The least separation found, and bounds of the least of all that were found.
  double least_value_ = std::numeric_limits<double>::infinity();
  double least_low_ = std::numeric_limits<double>::infinity();
  double least_high_ = std::numeric_limits<double>::infinity();
};

// OK, or INVALID_ARGUMENT: ValidateOptions; the textbook method, which is for pairs of hulls.
absl::Status ValidateBodyOptions(const QueryOptions& options, const OptionNames& names = {});

// A whole search. INVALID_ARGUMENT: ValidateBodyOptions. CANCELLED, RESOURCE_EXHAUSTED:
// BodySearch::Advance.
absl::StatusOr<BodyAnswer> CheckBodies(const PlacedBody& a, const PlacedBody& b,
                                       const QueryOptions& options, BodyCounts* counts = nullptr);

}  // namespace hulld

#endif  // HULLD_CORE_QUERY_BODY_BODY_SEARCH_H_
