#ifndef HULLD_SERVER_WIRE_ANSWER_COLUMNS_H_
#define HULLD_SERVER_WIRE_ANSWER_COLUMNS_H_

#include <absl/status/statusor.h>

#include <cstddef>

#include "core/query/collision.h"
#include "core/query/placed/query_hull.h"
#include "hulld/v1/collision.pb.h"

namespace hulld::server {

// The size at which a message of such rows is full. The row that exceeds it may be as large as an
// answer can be (Config::kMaxFeatureVertices); the message still stays under the 4 MiB that every
// gRPC client takes.
size_t FullMessageBytes(const v1::Wanted& wanted);

// Both functions add one row: an entry to each column that is wanted. They return the bytes that
// the row adds to the message, estimated from above, framing counted.

// The answer for hulls a and b, or why there is none. Requires canonical hulls where the answer
// names vertices.
size_t AddAnswer(const absl::StatusOr<Answer>& answer, const QueryHull& a, const QueryHull& b,
                 const v1::Wanted& wanted, v1::AnswerColumns* columns);

// The same for an answer where the relation is all that is wanted.
size_t AddRelation(const Answer& answer, v1::AnswerColumns* columns);

// Whether something in the columns names a row, so that they cannot follow the rows of others.
bool NamesRows(const v1::AnswerColumns& columns);

// No answer; the reply gives the cause elsewhere, with the placement.
size_t AddUnanswered(const v1::Wanted& wanted, v1::AnswerColumns* columns);

}  // namespace hulld::server

#endif  // HULLD_SERVER_WIRE_ANSWER_COLUMNS_H_
