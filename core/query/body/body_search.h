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

// The part of an answer that only bodies have.
struct PiecesAnswer {
  // The deciding pair. None if only the relation was requested and no pair collides or is within
  // the clearance, or if either body is empty.
  std::optional<PiecePair> pieces;
  // If requested, the proof of the relation (PieceCertification). Answer::certificate is then none.
  std::vector<PieceCertificate> certificates;
};

struct BodyAnswer : PiecesAnswer {
  // The answer for the two bodies. Axis, witness points and analysis come from the deciding pair.
  Answer answer;
};

// Work counters of a search.
struct BodyCounts {
  // Pairs of boxes visited, and pairs of pieces queried as hulls.
  uint64_t boxes = 0;
  uint64_t pairs = 0;
};

// Finds the relation and separation of two bodies. The relation is the strongest over all pairs of
// a piece of A and a piece of B, in the order OVERLAPPING, WITHIN_TOLERANCE, TOUCHING, SEPARATED.
// The separation is the smallest over all pairs: the distance of the nearest pair, or minus the
// depth of the deepest. Each pair is decided like two hulls, at the exact products of the poses.
//
// The search descends two box trees simultaneously, nearest boxes first. If only the relation and
// the clearance are requested, it stops when both are known, and names the pair that decided the
// relation or, if no pair collides, the clearance. While only one of them is unknown, it skips all
// pairs that cannot change it, so it never visits more boxes and pairs than a search for the
// separation. If further details are requested, it names the pair with the smallest separation.
// Swapping A and B mirrors the answer, and the named pair does not depend on threads.
//
// Certificates do not count among these details. If requested, the certificates of pieces that
// prove the relation are found after the relation is known.
//
// The search proceeds in steps, so that long searches can be time-sliced. Cost: O(log n) boxes plus
// the nearby pairs, if boxes of pieces overlap little; plus the cost of PieceCertification.
class BodySearch {
 public:
  // All arguments must outlive the search. Requires: valid `options` (ValidateBodyOptions).
  BodySearch(const PlacedBody& a, const PlacedBody& b, const QueryOptions& options);
  BodySearch(const BodySearch&) = delete;
  BodySearch& operator=(const BodySearch&) = delete;

  // Makes at most `steps` steps, of one node or one pair of pieces each. Returns true if the search
  // has ended. CANCELLED: should_stop returned true. RESOURCE_EXHAUSTED: more certificates needed
  // than options.max_piece_certificates.
  absl::StatusOr<bool> Advance(uint64_t steps);
  // Requires: the search has ended. Call at most once.
  absl::StatusOr<BodyAnswer> Take();
  const BodyCounts& counts() const { return counts_; }

 private:
  // X and Y are A and B, or B and A, in an order that does not depend on the order of the
  // arguments.
  struct Nodes {
    uint32_t x;
    uint32_t y;
    double gap;
  };
  struct Candidate {
    // Positions in the leaves, and piece indices.
    uint32_t slot_x;
    uint32_t slot_y;
    uint32_t piece_x;
    uint32_t piece_y;
    double gap;
  };
  // The placed pieces of a leaf.
  struct PlacedLeaf {
    uint32_t node = std::numeric_limits<uint32_t>::max();
    std::array<std::optional<PlacedPiece>, BoxTree::kLeafBoxes> pieces;

    void Enter(uint32_t leaf);
    const PlacedHull& At(const PlacedBody& body, uint32_t slot, uint32_t piece);
  };

  double Gap(const Box& of_x, const Box& of_y);
  // Pairs farther apart than this cannot change the answer.
  double Limit() const { return wants_least_ ? min_high_ : limit_; }
  // Excludes pairs that can change neither the relation nor within_clearance. For searches without
  // details.
  void UpdateLimit();
  void Descend(const Nodes& nodes);
  void Push(uint32_t x, uint32_t y);
  void EnterLeaves(const Nodes& nodes);
  absl::Status Search();
  absl::Status Prove();
  absl::Status Query(const Candidate& candidate);
  void TakeUp(const Answer& answer, PiecePair pieces);
  void TakeUpSeparation(const Answer& answer, PiecePair pieces);
  absl::StatusOr<BodyAnswer> TakeLeast() const;
  BodyAnswer TakeRelation() const;

  const PlacedBody* a_;
  const PlacedBody* b_;
  const PlacedBody* x_;
  const PlacedBody* y_;
  const QueryOptions* options_;
  // Options for each pair. Without details, the clearance is dropped once a pair is within it.
  QueryOptions each_;
  bool wants_least_;
  double limit_ = 0;
  BoxGap gap_;
  StopPoll poll_;

  std::vector<Nodes> waiting_;
  // Pairs of pieces from two leaves. The search pops from the end, where the nearest pairs are.
  std::vector<Candidate> candidates_;
  PlacedLeaf leaf_x_;
  PlacedLeaf leaf_y_;
  // True if the relation and the deciding pair are known.
  bool found_ = false;
  bool ended_ = false;
  std::optional<PieceCertification> certification_;

  BodyCounts counts_;
  Relation relation_ = Relation::kSeparated;
  Rung rung_ = Rung::kBounds;
  bool within_clearance_ = false;
  std::optional<PiecePair> decided_;
  // The smallest separation found, and bounds on the smallest separation of all pairs found.
  double min_value_ = std::numeric_limits<double>::infinity();
  double min_low_ = std::numeric_limits<double>::infinity();
  double min_high_ = std::numeric_limits<double>::infinity();
};

// Returns OK, or INVALID_ARGUMENT for options that fail ValidateOptions or that select the textbook
// method, which supports only pairs of hulls.
absl::Status ValidateBodyOptions(const QueryOptions& options, const OptionNames& names = {});

// Runs a whole search. INVALID_ARGUMENT: see ValidateBodyOptions. CANCELLED, RESOURCE_EXHAUSTED:
// see BodySearch::Advance.
absl::StatusOr<BodyAnswer> CheckBodies(const PlacedBody& a, const PlacedBody& b,
                                       const QueryOptions& options, BodyCounts* counts = nullptr);

}  // namespace hulld

#endif  // HULLD_CORE_QUERY_BODY_BODY_SEARCH_H_
