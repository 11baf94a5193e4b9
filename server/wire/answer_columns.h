#ifndef HULLD_SERVER_WIRE_ANSWER_COLUMNS_H_
#define HULLD_SERVER_WIRE_ANSWER_COLUMNS_H_

#include <absl/status/statusor.h>

#include <cstddef>

#include "core/query/collision.h"
#include "core/query/motion/first_contact.h"
#include "core/query/placed/query_hull.h"
#include "hulld/v1/collision.pb.h"

namespace hulld::server {

// Size at which a message of such rows is full. The row that exceeds it may have the maximum size
// of an answer (Config::kMaxFeatureVertices); the message still stays below the 4 MiB that every
// gRPC client accepts.
size_t FullMessageBytes(const v1::Wanted& wanted);

// Both functions add one row: an entry to each wanted column. They return an upper estimate of the
// bytes that the row adds to the message, including framing.

// Adds the answer for hulls a and b, or its error. Requires canonical hulls if the answer names
// vertices.
size_t AddAnswer(const absl::StatusOr<Answer>& answer, const QueryHull& a, const QueryHull& b,
                 const v1::Wanted& wanted, v1::AnswerColumns* columns);

// Like AddAnswer if only the relation is wanted.
size_t AddRelation(const Answer& answer, v1::AnswerColumns* columns);

// Like AddAnswer for a call with motions.
size_t AddFirstContact(const FirstContact& contact, const QueryHull& a, const QueryHull& b,
                       const v1::Wanted& wanted, v1::AnswerColumns* columns);
// Adds the times of the last row if it has no answer.
size_t AddNoTimes(v1::AnswerColumns* columns);

// Returns true if an entry refers to a row by index, so that the columns cannot be appended to
// other columns.
bool NamesRows(const v1::AnswerColumns& columns);

// Adds a row without an answer. The reply states the reason elsewhere, with the placement.
size_t AddUnanswered(const v1::Wanted& wanted, v1::AnswerColumns* columns);

}  // namespace hulld::server

#endif  // HULLD_SERVER_WIRE_ANSWER_COLUMNS_H_
