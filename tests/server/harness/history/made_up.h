#ifndef HULLD_TESTS_SERVER_HARNESS_HISTORY_MADE_UP_H_
#define HULLD_TESTS_SERVER_HARNESS_HISTORY_MADE_UP_H_

#include <bit>
#include <cstdint>

#include "tests/server/harness/history/hull_history.h"

// Hand-written operations for tests of the history checks.
namespace hulld::server {

// An answered operation on a hull that was created at this revision.
inline Operation Answered(Operation::Kind kind, uint64_t invoked, uint64_t returned,
                          uint64_t revision) {
  Operation operation;
  operation.kind = kind;
  operation.outcome = Operation::Outcome::kOk;
  operation.invoked = invoked;
  operation.returned = returned;
  operation.store_revision = operation.create_revision = operation.revision = revision;
  return operation;
}

// Replaces a hull with these distinct points; at revision 1, creates it.
inline Operation ReplaceAt(uint64_t invoked, uint64_t returned, uint64_t revision,
                           PointSet points) {
  Operation operation = Answered(Operation::Kind::kReplace, invoked, returned, revision);
  operation.if_absent = true;
  operation.created = revision == 1;
  operation.points = points;
  operation.sent = operation.received = operation.outside = operation.vertex_count =
      static_cast<uint64_t>(std::popcount(points));
  return operation;
}

inline Operation Unanswered(Operation operation, uint64_t returned = UINT64_MAX) {
  operation.outcome = Operation::Outcome::kUnknown;
  operation.returned = returned;
  return operation;
}

}  // namespace hulld::server

#endif  // HULLD_TESTS_SERVER_HARNESS_HISTORY_MADE_UP_H_
