#ifndef HULLD_SERVER_WIRE_UNARY_ANSWERS_H_
#define HULLD_SERVER_WIRE_UNARY_ANSWERS_H_

#include <absl/status/status.h>
#include <absl/status/statusor.h>
#include <absl/strings/str_cat.h>

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <string>
#include <utility>

#include "core/base/status_macros.h"
#include "server/access/caller.h"
#include "server/contract/rpc.h"
#include "server/process/task_pool.h"
#include "server/registry/registry.h"
#include "server/settings/config.h"
#include "server/store/store.h"
#include "server/wire/decode.h"
#include "server/wire/encode.h"

namespace hulld::server {

// Ends a unary call (UnaryCall) with the result of `answer` after the registry satisfies the
// request's freshness: immediately if it already does, otherwise on `pool`. answer: receives the
// staleness. is_quick: `answer` may run on gRPC's threads; otherwise it runs on `pool`.
template <typename UnaryCall, typename Answer>
void EndFresh(Registry& registry, TaskPool& pool, UnaryCall* call, Answer answer,
              bool is_quick = true) {
  const absl::StatusOr<Freshness> freshness =
      DecodeFreshness(call->request().freshness(), registry.store(), call->call().arrival());
  if (!freshness.ok()) return call->End(freshness.status());
  if (is_quick) {
    if (const auto staleness = registry.peers().TryFresh(*freshness))
      return call->End(answer(*staleness));
  }
  call->EndOn(pool, [&registry, call, freshness = *freshness, answer = std::move(answer)] {
    const absl::StatusOr<std::chrono::nanoseconds> staleness =
        registry.peers().AwaitFresh(freshness, call->call().should_stop());
    return staleness.ok() ? answer(*staleness) : staleness.status();
  });
}

// Returns the opaque token of the page that starts after `last_id`, in this RPC's list of the IDs
// with `prefix`.
std::string EncodePageToken(Rpc rpc, const std::string& prefix, const std::string& last_id);

// Returns the last_id of a token of the same RPC and prefix; the empty string for an empty token.
// INVALID_ARGUMENT: the token is malformed, or belongs to another RPC or prefix.
absl::StatusOr<std::string> DecodePageToken(Rpc rpc, const std::string& token,
                                            const std::string& prefix);

// Like EndFresh, for a call that lists records of these kinds. add: adds an entry to the reply.
template <typename UnaryCall, typename AddEntry>
void EndListed(Registry& registry, TaskPool& pool, UnaryCall* call, Rpc rpc, RecordKinds kinds,
               AddEntry add) {
  const auto answer = [&registry, kinds, call, rpc,
                       add](std::chrono::nanoseconds staleness) -> absl::Status {
    const auto& request = call->request();
    HULLD_ASSIGN_OR_RETURN(const std::string prefix,
                           PrefixToList(call->call().caller(), request.prefix()));
    HULLD_ASSIGN_OR_RETURN(const std::string after,
                           DecodePageToken(rpc, request.page_token(), prefix));
    const uint32_t page_size =
        request.page_size() == 0 ? Config::kDefaultPageSize : request.page_size();
    const absl::StatusOr<RecordPage> page =
        registry.records().List(prefix, after, std::min(page_size, Config::kMaxPageSize),
                                call->call().should_stop(), kinds);
    if (!page.ok()) return page.status();
    EncodeHeader(registry.store(), AsOf{page->store_revision, staleness},
                 call->response().mutable_header());
    for (const HullChange& entry : page->entries) add(entry, call->response());
    if (!page->more) return absl::OkStatus();
    call->response().set_next_page_token(
        EncodePageToken(rpc, prefix, page->entries.back().record.hull_id));
    return absl::OkStatus();
  };
  EndFresh(registry, pool, call, answer, !registry.store().supports_lookup());
}

// Ends a unary call that deletes a hull or a body after the deletion is committed. kind: "hull" or
// "body".
template <typename UnaryCall>
void EndDeleted(Registry& registry, UnaryCall* call, const char* kind, const std::string& id) {
  const absl::Status valid = CheckHullId(call->call().caller(), id, absl::StrCat(kind, "_id"));
  if (!valid.ok()) return call->End(valid);
  const auto done = [&registry, call, kind, &id](const absl::StatusOr<uint64_t>& revision) {
    if (!revision.ok()) return call->End(revision.status());
    call->call().LogChange(absl::StrCat(kind, " deleted"), {kind, id}, *revision);
    EncodeHeader(registry.store(), *revision, call->response().mutable_header());
    call->End(absl::OkStatus());
  };
  registry.changes().Delete(kind, id, IfRevision(call->request()), done);
}

}  // namespace hulld::server

#endif  // HULLD_SERVER_WIRE_UNARY_ANSWERS_H_
