#ifndef HULLD_CLIENT_HULLCTL_PAIRS_BATCH_ANSWERS_H_
#define HULLD_CLIENT_HULLCTL_PAIRS_BATCH_ANSWERS_H_

#include <absl/status/status.h>

#include <cstddef>
#include <functional>
#include <string>

#include "client/client.h"
#include "client/hullctl/printing/answer_row.h"
#include "hulld/v1/collision.pb.h"

namespace hulld {

// Receives the answer of a pair, by its position in the request. `problem`: the reason for a
// missing answer; otherwise null.
using PairReceiver =
    std::function<absl::Status(size_t pair, const AnswerRow& row, const std::string* problem)>;

// Sends a batch and passes on the answer of each pair, in order. `on_message`, if set, receives
// each message before its answers. Errors of the call and of both functions; INTERNAL: the answers
// do not match the request.
absl::Status QueryBatch(const Client& client, const v1::BatchCheckCollisionsRequest& request,
                        const Client::BatchReceiver& on_message, const PairReceiver& receive);

}  // namespace hulld

#endif  // HULLD_CLIENT_HULLCTL_PAIRS_BATCH_ANSWERS_H_
