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

// Returns a context with a deadline far beyond any of these calls, so that a defect makes the test
// fail instead of hang.
std::unique_ptr<grpc::ClientContext> NewContext();

void TakeVersion(const v1::HullVersion& version, const v1::ResponseHeader& header, Seen& seen);

// Returns the missing hull of a body's piece, parsed from an error message; empty if the message is
// about something else.
std::string MissingPiece(const std::string& said);

}  // namespace hulld::server

#endif  // HULLD_TESTS_SERVER_HARNESS_HISTORY_ANSWERS_H_
