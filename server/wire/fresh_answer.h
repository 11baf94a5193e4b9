#ifndef HULLD_SERVER_WIRE_FRESH_ANSWER_H_
#define HULLD_SERVER_WIRE_FRESH_ANSWER_H_

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <chrono>
#include <utility>

#include "server/process/worker_pool.h"
#include "server/registry/registry.h"
#include "server/wire/decode.h"

namespace hulld::server {

// Ends a unary call (UnaryCall) with the result of `answer` after the registry satisfies the
// request's freshness: immediately if it already does, otherwise on `pool`. answer: takes the
// staleness. is_quick: `answer` may run on gRPC's threads; otherwise it runs on `pool`.
template <typename UnaryCall, typename Answer>
void EndFresh(Registry& registry, WorkerPool& pool, UnaryCall* call, Answer answer,
              bool is_quick = true) {
  const absl::StatusOr<Freshness> freshness =
      DecodeFreshness(call->request().freshness(), registry.store(), call->call().arrival());
  if (!freshness.ok()) return call->End(freshness.status());
  if (is_quick) {
    if (const auto staleness = registry.barrier().TryFresh(*freshness))
      return call->End(answer(*staleness));
  }
  call->EndOn(pool, [&registry, call, freshness = *freshness, answer = std::move(answer)] {
    const absl::StatusOr<std::chrono::nanoseconds> staleness =
        registry.barrier().AwaitFresh(freshness, [call] { return call->call().ShouldStop(); });
    return staleness.ok() ? answer(*staleness) : staleness.status();
  });
}

}  // namespace hulld::server

#endif  // HULLD_SERVER_WIRE_FRESH_ANSWER_H_
