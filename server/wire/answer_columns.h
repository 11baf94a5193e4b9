#ifndef HULLD_SERVER_WIRE_ANSWER_COLUMNS_H_
#define HULLD_SERVER_WIRE_ANSWER_COLUMNS_H_

#include <absl/status/statusor.h>

#include <cstddef>
#include <cstdint>

#include "core/hull/hull.h"
#include "core/query/collision.h"
#include "hulld/v1/collision.pb.h"

namespace hulld::server {

// Answers as columns. Columns: v1::AnswerColumns, or v1::BatchCheckCollisionsResponse, whose fields
// are named alike. Both functions add one entry to each column that is wanted and return the bytes
// that it adds to the message, estimated from above, framing counted.

// The answer of hulls a and b, or why there is none. pair: how a problem names it.
template <typename Columns>
size_t AddAnswer(const absl::StatusOr<Answer>& answer, const Hull& a, const Hull& b,
                 const v1::Wanted& wanted, uint64_t pair, Columns* columns);

// No answer, for a reason that stands elsewhere.
template <typename Columns>
size_t AddUnanswered(const v1::Wanted& wanted, Columns* columns);

}  // namespace hulld::server

#endif  // HULLD_SERVER_WIRE_ANSWER_COLUMNS_H_
