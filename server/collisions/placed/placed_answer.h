#ifndef HULLD_SERVER_COLLISIONS_PLACED_PLACED_ANSWER_H_
#define HULLD_SERVER_COLLISIONS_PLACED_PLACED_ANSWER_H_

#include <absl/status/statusor.h>

#include <cstddef>
#include <cstdint>
#include <optional>

#include "core/query/body/body_search.h"
#include "core/query/motion/first_contact.h"
#include "core/query/terms/answer.h"
#include "core/query/terms/pair_cache.h"
#include "core/query/terms/query_options.h"
#include "hulld/v1/collision.pb.h"
#include "server/collisions/placed/placement_table.h"

namespace hulld::server {

// The answer for two placements, or its error, and the deciding pair of pieces if one is a body.
struct PlacedAnswer {
  absl::StatusOr<Answer> answer;
  PiecesAnswer of_body = {};
  // In a call with motions; the answer is then its relation.
  std::optional<FirstContact> contact = {};
};

// Queries a pair of placements. A pair with a body gets an error for queries restricted to hulls,
// or if it needs more certificates than a reply holds. cache: of a pair of hulls; may be null.
// Requires that both are answerable.
PlacedAnswer AskPlaced(const PlacementTable& table, uint32_t a, uint32_t b,
                       const QueryOptions& options, PairCache* cache);

// As AskPlaced for a call with motions.
PlacedAnswer AskMoving(const PlacementTable& table, uint32_t a, uint32_t b,
                       const MotionOptions& options);

// True if the query takes about as long as many pairs of hulls, so that the clock must be checked
// after it.
inline bool IsLongToAsk(const PlacementTable& table, uint32_t a, uint32_t b) {
  return table.is_body(a) || table.is_body(b);
}

// Returns the error of a query, with the limit that it hit.
absl::Status NameLimit(const PlacementTable& table, uint32_t a, uint32_t b,
                       const absl::Status& status, const QueryOptions& options);

// Adds the row of such an answer as AddAnswer does, or a row without an answer if the pieces'
// certificates exceed Config::kMaxRowProofBytes.
size_t AddPlacedAnswer(const PlacementTable& table, uint32_t a, uint32_t b,
                       const PlacedAnswer& answer, const v1::Wanted& wanted,
                       v1::AnswerColumns* columns);
size_t AddUnansweredPair(const PlacementTable& table, const v1::Wanted& wanted,
                         v1::AnswerColumns* columns);

}  // namespace hulld::server

#endif  // HULLD_SERVER_COLLISIONS_PLACED_PLACED_ANSWER_H_
