#ifndef HULLD_CORE_QUERY_MOTION_MOVING_BODY_SEARCH_H_
#define HULLD_CORE_QUERY_MOTION_MOVING_BODY_SEARCH_H_

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <vector>

#include "core/query/body/body_search.h"
#include "core/query/body/meeting_pieces.h"
#include "core/query/body/placed_body.h"
#include "core/query/motion/first_contact.h"
#include "core/query/motion/moving_body.h"
#include "core/query/terms/relation.h"

namespace hulld {

// The first contact of two bodies in motion.
struct BodyContact {
  // Has no intervals and no certificate; `of_body` has those of the pairs of pieces.
  FirstContact contact;
  // The pair of pieces that meets first or, if several meet at the same time, a pair among them
  // with the strongest relation. If no pair meets, the first pair that may meet within the
  // resolution, if any.
  //
  // If requested, certificates for all pairs of nonempty pieces, in ascending order of A's piece,
  // then B's: intervals from 0 to separated_until, and relation kSeparated. The deciding pair has
  // its own relation and the proof of its contact. If separated_until is 0, only the deciding pair
  // has a certificate.
  PiecesAnswer of_body;
};

// Finds the first contact of two bodies in motion: the earliest over all pairs of a piece of A and
// a piece of B, each as in FindFirstContact. separated_until and contact_time are the minima over
// all pairs. They are farther apart than for two hulls only if another pair comes within the
// resolution before the contact. The relation is the strongest over all pairs: for translations
// without radii, over all times; otherwise at contact_time. It is kWithinTolerance only if no pair
// meets.
//
// A pair is settled without a search if the boxes around its motions are disjoint, and a search
// ends at the earliest contact known. The search proceeds in steps, so that it can be time-sliced.
class MovingBodySearch {
 public:
  // All arguments must outlive the search. Requires: valid bodies, motions, and options.
  MovingBodySearch(const MovingBody& a, const MovingBody& b, const MotionOptions& options);
  MovingBodySearch(const MovingBodySearch&) = delete;
  MovingBodySearch& operator=(const MovingBodySearch&) = delete;

  // Advances by at most `steps` steps, each for one pair of pieces. Returns true if the search has
  // ended. CANCELLED: should_stop returned true. INVALID_ARGUMENT: see FindFirstContact.
  // RESOURCE_EXHAUSTED: more pairs of pieces than max_piece_certificates need a certificate.
  absl::StatusOr<bool> Advance(uint64_t steps);
  // Requires: the search has ended. Call at most once.
  BodyContact Take();

 private:
  enum class Stage { kPairs, kCertificates, kEnded };
  // A pair that meets, or may meet within the resolution.
  struct Met {
    PiecePair pieces;
    Relation relation;
    double separated_until;
    // Infinite if no contact is proven.
    double contact_time;
  };

  absl::Status Search();
  void TakeUp(const Met& met);
  void DropLater();
  absl::Status Decide();
  absl::StatusOr<Relation> RelationAtContact(const Met& met) const;
  absl::Status EnterCertificates();
  absl::Status Prove();
  absl::StatusOr<PieceCertificate> Certify(PiecePair pieces) const;
  absl::StatusOr<FirstContact> Find(PiecePair pieces, double latest, bool want_certificate) const;
  bool IsDeciding(PiecePair pieces) const {
    return result_.contact.contact_time && result_.of_body.pieces == pieces;
  }

  const MovingBody* a_;
  const MovingBody* b_;
  const MotionOptions* options_;
  // True if the relation is the strongest over all times.
  bool is_plain_translation_;
  // MotionOptions::latest, unless the relation also depends on later times.
  double latest_;
  MeetingPieces meeting_;
  Stage stage_ = Stage::kPairs;
  // Pairs that may meet first, in the order of the search.
  std::vector<Met> met_;
  size_t kept_ = 0;
  double earliest_ = std::numeric_limits<double>::infinity();
  // All pairs without a contact up to latest_ are separated up to this time.
  double others_until_ = 1;
  bool overlaps_ = false;
  // True if the pair overlaps at time 0: no contact is earlier, and no relation is stronger.
  bool overlaps_at_start_ = false;
  // Nonempty pieces, and the index of the next of their pairs to prove.
  std::vector<uint32_t> pieces_a_;
  std::vector<uint32_t> pieces_b_;
  size_t next_ = 0;
  BodyContact result_;
};

// Runs a complete search. INVALID_ARGUMENT: see ValidateMotionOptions. Other errors: see
// MovingBodySearch::Advance.
absl::StatusOr<BodyContact> FindFirstContact(const MovingBody& a, const MovingBody& b,
                                             const MotionOptions& options = {});

}  // namespace hulld

#endif  // HULLD_CORE_QUERY_MOTION_MOVING_BODY_SEARCH_H_
