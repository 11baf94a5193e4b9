#ifndef HULLD_TESTS_SERVER_HARNESS_HISTORY_ANSWERS_H_
#define HULLD_TESTS_SERVER_HARNESS_HISTORY_ANSWERS_H_

#include <grpcpp/grpcpp.h>

#include <cstdint>
#include <memory>
#include <string>

#include "hulld/v1/collision.pb.h"
#include "hulld/v1/hull.pb.h"
#include "tests/server/harness/history/hull_history.h"

namespace hulld::server {

// The context of a call, with a deadline long after any of these calls ends, so that a defect ends
// as a failure and not as a hang.
std::unique_ptr<grpc::ClientContext> NewContext();

// The revision of the store with this ID, where there are several.
uint64_t RevisionOf(const v1::ResponseHeader& header, const std::string& store_id);

void TakeVersion(const v1::HullVersion& version, const v1::ResponseHeader& header, Seen& seen);

// The hull that the message of an error says a piece of a body lacks; empty: it is about another
// thing.
std::string MissingPiece(const std::string& said);

}  // namespace hulld::server

#endif  // HULLD_TESTS_SERVER_HARNESS_HISTORY_ANSWERS_H_
