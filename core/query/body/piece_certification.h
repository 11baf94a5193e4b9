#ifndef HULLD_CORE_QUERY_BODY_PIECE_CERTIFICATION_H_
#define HULLD_CORE_QUERY_BODY_PIECE_CERTIFICATION_H_

#include <absl/status/status.h>

#include <cstdint>
#include <optional>
#include <vector>

#include "core/query/body/placed_body.h"
#include "core/query/box_tree.h"
#include "core/query/terms/certificate.h"
#include "core/query/terms/query_options.h"
#include "core/query/terms/relation.h"
#include "core/query/terms/separated_interval.h"

namespace hulld {

// The proof of the relation of a piece of A and a piece of B, as for two hulls at their poses.
struct PieceCertificate {
  PiecePair pieces;
  Relation relation;
  Certificate certificate;
  // Filled for bodies in motion (BodyContact). Only the deciding pair then has a certificate.
  std::vector<SeparatedInterval> intervals = {};
};

// Finds, in steps, the certificates that prove the relation of two bodies, in ascending order of
// A's piece, then B's. OVERLAPPING: one certificate, for the deciding pair. TOUCHING and SEPARATED:
// one for each pair, except pairs of pieces with disjoint exact bounding boxes along the world
// axes: a verifier can compute these boxes from vertices and poses. The boxes here are rounded
// outwards, so a few pairs may be certified unnecessarily.
//
// Cost: six support points for each piece, O(log n) boxes for each piece of A, and the exact
// relation of each certified pair.
class PieceCertification {
 public:
  // All arguments must outlive this object. `relation`: the exact relation of the bodies.
  // `decided`: a pair with that relation, required for OVERLAPPING.
  PieceCertification(const PlacedBody& a, const PlacedBody& b, const QueryOptions& options,
                     Relation relation, std::optional<PiecePair> decided);
  PieceCertification(const PieceCertification&) = delete;
  PieceCertification& operator=(const PieceCertification&) = delete;

  // Places one piece or certifies one pair; no-op after the end. CANCELLED: should_stop returned
  // true. RESOURCE_EXHAUSTED: more pairs than options.max_piece_certificates.
  absl::Status Step();
  bool ended() const { return stage_ == Stage::kEnded; }
  // Requires: ended(). Call at most once.
  std::vector<PieceCertificate> Take();

 private:
  enum class Stage { kBoxesOfB, kPairs, kCertificates, kEnded };

  // Enters the next stage that has work.
  void Enter(Stage stage);
  absl::Status FindPairs(uint32_t piece_a);
  absl::Status Certify(PiecePair pieces);

  const PlacedBody* a_;
  const PlacedBody* b_;
  // Options for each pair.
  QueryOptions each_;
  uint64_t max_certificates_;
  Relation relation_;
  Relation strongest_ = Relation::kSeparated;

  Stage stage_ = Stage::kBoxesOfB;
  // Index of the next piece or pair of the stage.
  size_t next_ = 0;
  std::vector<Box> boxes_;
  BoxTree tree_{std::span<const Box>()};
  std::vector<uint32_t> meeting_;
  std::vector<PiecePair> pairs_;
  std::vector<PieceCertificate> certificates_;
};

}  // namespace hulld

#endif  // HULLD_CORE_QUERY_BODY_PIECE_CERTIFICATION_H_
