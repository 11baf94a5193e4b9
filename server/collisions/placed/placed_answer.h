#ifndef HULLD_SERVER_COLLISIONS_PLACED_PLACED_ANSWER_H_
#define HULLD_SERVER_COLLISIONS_PLACED_PLACED_ANSWER_H_

#include <absl/status/status.h>
#include <absl/status/statusor.h>
#include <google/protobuf/repeated_field.h>

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <variant>
#include <vector>

#include "core/query/body/body_search.h"
#include "core/query/collision.h"
#include "core/query/motion/first_contact.h"
#include "core/query/motion/moving_body.h"
#include "core/query/motion/moving_body_search.h"
#include "core/query/terms/answer.h"
#include "core/query/terms/pair_cache.h"
#include "core/query/terms/query_options.h"
#include "hulld/v1/collision.pb.h"
#include "server/collisions/placed/placement_table.h"
#include "server/registry/registry.h"

namespace hulld::server {

// The answer for two placements, or an error, and the deciding pair of pieces if either is a body.
// An error caused by a limit names the limit's flag.
struct PlacedAnswer {
  absl::StatusOr<Answer> answer;
  PiecesAnswer of_body = {};
  // Set in a call with motions; the answer is then its relation.
  std::optional<FirstContact> contact = {};
};

// The query of a pair of placements: of hulls or bodies, at rest or in motion, by any method. It is
// computed in slices, so that other calls get their turn. A query of two hulls takes one slice of
// at most a few milliseconds; the textbook test and searches of bodies take as many as they need.
class PairSearch {
 public:
  using Clock = std::chrono::steady_clock;

  // options: valid. `motion` applies if the table has motions. All arguments must outlive this
  // object. Requires that both placements are answerable and, for the textbook test, placed in
  // advance.
  PairSearch(const PlacementTable& table, uint32_t a, uint32_t b, const QueryOptions& options,
             const MotionOptions& motion)
      : table_(table), a_(a), b_(b), options_(options), motion_(motion) {}
  PairSearch(const PairSearch&) = delete;
  PairSearch& operator=(const PairSearch&) = delete;

  // RESOURCE_EXHAUSTED: the search keeps much memory between slices, and readers exceed their share
  // of --memory-limit. Call before the first Advance.
  absl::Status CheckMemory(Registry& registry) const;

  // Works until the answer is known, or until `end`, but always makes some progress. Returns true
  // if the answer is known.
  bool Advance(Clock::time_point end);

  // Requires that Advance returned true. CANCELLED: options.should_stop returned true. A pair with
  // a body has an error for queries restricted to hulls, or if it needs more certificates than fit
  // in a reply.
  PlacedAnswer& answer() { return answer_; }

  // Memory held between slices.
  size_t MemoryBytes() const;

 private:
  struct MovingBodies {
    MovingBodies(const PlacementTable& table, uint32_t i, uint32_t j, const MotionOptions& options)
        : a(table.MovingBodyAt(i)), b(table.MovingBodyAt(j)), search(a, b, options) {}

    const MovingBody a;
    const MovingBody b;
    MovingBodySearch search;
  };

  // Return true if the answer is known.
  absl::StatusOr<bool> Begin();
  absl::StatusOr<bool> Continue(Clock::time_point end);
  void Take(FirstContact contact, PiecesAnswer of_body);

  const PlacementTable& table_;
  const uint32_t a_;
  const uint32_t b_;
  const QueryOptions& options_;
  const MotionOptions& motion_;
  std::variant<std::monostate, TextbookCheck, BodySearch, MovingBodies> search_;
  PlacedAnswer answer_;
};

// Runs a complete search.
PlacedAnswer QueryPlaced(const PlacementTable& table, uint32_t a, uint32_t b,
                         const QueryOptions& options, const MotionOptions& motion);

// Like QueryPlaced, for a call without motions. cache: for a pair of hulls; may be null.
PlacedAnswer QueryAtRest(const PlacementTable& table, uint32_t a, uint32_t b,
                         const QueryOptions& options, PairCache* cache);

// Adds the certificates of pairs of pieces until they exceed `max_bytes` bytes. Returns the bytes
// added.
size_t AddCertificates(const PlacementTable& table, uint32_t a, uint32_t b,
                       const std::vector<PieceCertificate>& certificates, size_t max_bytes,
                       google::protobuf::RepeatedPtrField<v1::PieceCertificate>* messages);

// Adds the row of such an answer as AddAnswer does, or a row without an answer if the certificates
// of the pieces exceed Config::kMaxRowProofBytes.
size_t AddPlacedAnswer(const PlacementTable& table, uint32_t a, uint32_t b,
                       const PlacedAnswer& answer, const v1::Wanted& wanted,
                       v1::AnswerColumns* columns);
size_t AddUnansweredPair(const PlacementTable& table, const v1::Wanted& wanted,
                         v1::AnswerColumns* columns);

}  // namespace hulld::server

#endif  // HULLD_SERVER_COLLISIONS_PLACED_PLACED_ANSWER_H_
