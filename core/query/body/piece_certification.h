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

namespace hulld {

// What proves the relation of a piece of A and a piece of B, as of two hulls at their poses.
struct PieceCertificate {
  PiecePair pieces;
  Relation relation;
  Certificate certificate;
};

// The certificates from which the relation of two bodies follows, ascending by A's piece, then by
// B's, found in steps. OVERLAPPING: that of the pair that decided, alone. TOUCHING and SEPARATED:
// that of each pair that its boxes do not settle, which are the least boxes of both pieces along
// the axes of the world, over the real numbers. Pairs whose boxes have no common point need none,
// as anyone can make the boxes from vertices and poses. The boxes here are rounded outwards, so
// that a few pairs may be among them which need none.
//
// Cost: six support points for each piece, O(log n) boxes for each of A, and the exact relation of
// each pair that is certified.
class PieceCertification {
 public:
  // All must outlive this. relation: that of the bodies, exact. `decided`: a pair that shows it,
  // needed for OVERLAPPING.
  PieceCertification(const PlacedBody& a, const PlacedBody& b, const QueryOptions& options,
                     Relation relation, std::optional<PiecePair> decided);
  PieceCertification(const PieceCertification&) = delete;
  PieceCertification& operator=(const PieceCertification&) = delete;

  // Places a piece, or certifies a pair of them; nothing after the end. CANCELLED: should_stop said
  // so. RESOURCE_EXHAUSTED: more pairs than options.max_piece_certificates.
  absl::Status Step();
  bool ended() const { return stage_ == Stage::kEnded; }
  // Requires that it has ended; once.
  std::vector<PieceCertificate> Take();

 private:
  enum class Stage { kBoxesOfB, kPairs, kCertificates, kEnded };

  // Begins with the next stage that has anything to do.
  void Enter(Stage stage);
  absl::Status FindPairs(uint32_t piece_a);
  absl::Status Certify(PiecePair pieces);

  const PlacedBody* a_;
  const PlacedBody* b_;
  // What is asked of each pair.
  QueryOptions each_;
  uint64_t most_;
  Relation relation_;
  Relation strongest_ = Relation::kSeparated;

  Stage stage_ = Stage::kBoxesOfB;
  // The next piece, or the next pair, of the stage.
  size_t next_ = 0;
  std::vector<Box> boxes_;
  BoxTree tree_{std::span<const Box>()};
  std::vector<uint32_t> meeting_;
  std::vector<PiecePair> pairs_;
  std::vector<PieceCertificate> certificates_;
};

}  // namespace hulld

#endif  // HULLD_CORE_QUERY_BODY_PIECE_CERTIFICATION_H_
