#ifndef HULLD_SERVER_WIRE_FRESH_ANSWER_H_
#define HULLD_SERVER_WIRE_FRESH_ANSWER_H_

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <chrono>
#include <utility>

#include "server/process/worker_pool.h"
#include "server/shards/shards.h"
#include "server/wire/decode.h"

namespace hulld::server {

// Ends a unary call (UnaryCall) whose request has a freshness with what `answer` gives, once the
// shards are as fresh, all of them: at once where they are, otherwise on `pool`. answer: takes how
// stale that may be. is_quick: whether it may run on gRPC's threads; otherwise it runs on `pool`.
template <typename UnaryCall, typename Answer>
void EndFresh(Shards& shards, WorkerPool& pool, UnaryCall* call, Answer answer,
              bool is_quick = true) {
  const absl::StatusOr<ShardsFreshness> freshness =
      DecodeFreshness(call->request().freshness(), shards.store_ids(), call->call().arrival());
  if (!freshness.ok()) return call->End(freshness.status());
  if (is_quick) {
    if (const auto staleness = shards.TryFresh(*freshness)) return call->End(answer(*staleness));
  }
  call->EndOn(pool, [&shards, call, freshness = *freshness, answer = std::move(answer)] {
    const absl::StatusOr<std::chrono::nanoseconds> staleness =
        shards.AwaitFresh(freshness, [call] { return call->call().ShouldStop(); });
    return staleness.ok() ? answer(*staleness) : staleness.status();
  });
}

}  // namespace hulld::server

#endif  // HULLD_SERVER_WIRE_FRESH_ANSWER_H_
