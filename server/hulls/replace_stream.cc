#include "server/hulls/replace_stream.h"

#include <absl/strings/str_cat.h>

#include <chrono>
#include <utility>

#include "core/base/status_macros.h"
#include "server/contract/limit_error.h"
#include "server/contract/status_map.h"
#include "server/wire/decode.h"
#include "server/wire/encode.h"

namespace hulld::server {

void ReplaceStream::OnNoMessage(const absl::Status& why) {
  if (call().ShouldStop()) return FinishCall(call().StopStatus());
  if (!why.ok()) return FinishCall(why);
  const bool opened = replacement_.builder != nullptr;
  // Only the empty block distinguishes a complete request from a client that disconnected.
  if (opened && complete_) return RunOn(parts_.writers, [this] { Commit(); });
  FinishCall(absl::InvalidArgumentError(opened
                                            ? "the stream ended without the empty block of points "
                                              "that marks its end; the hull is unchanged"
                                            : "the stream ended before its first message, open"));
}

void ReplaceStream::OnMessage() {
  if (call().ShouldStop()) return FinishCall(call().StopStatus());
  ++messages_;
  if (absl::Status s = HandleMessage(); !s.ok()) return FinishCall(s);
  if (!request().has_points() || complete_) return Read();
  RunOn(parts_.writers, [this, arrival = std::chrono::steady_clock::now()] {
    const absl::Status built = Build();
    if (!built.ok()) return FinishCall(OrStopped(built));
    call().EndMessage(arrival);
    Read();
  });
}

// Handles a message, except for building.
absl::Status ReplaceStream::HandleMessage() {
  const bool opened = replacement_.builder != nullptr;
  if (request().has_open()) {
    if (!opened) return HandleOpen(request().open());
    return absl::InvalidArgumentError("open was sent twice; start a new stream");
  }
  if (!request().has_points()) {
    return absl::InvalidArgumentError("the message is empty; set open or points");
  }
  if (!opened) return absl::InvalidArgumentError("the first message must be open, not points");
  complete_ = request().points().xyz().empty() && request().points().xyz_float().empty();
  return absl::OkStatus();
}

absl::Status ReplaceStream::HandleOpen(const v1::ReplaceOpen& open) {
  HULLD_RETURN_IF_ERROR(CheckHullId(call().caller(), open.hull_id(), "open.hull_id"));
  replacement_.hull_id = open.hull_id();
  replacement_.if_revision = IfRevision(open);
  replacement_.create_if_absent = open.create_if_absent();
  replacement_.builder = std::make_shared<HullBuilder>();
  return absl::OkStatus();
}

absl::Status ReplaceStream::Build() {
  const std::string name = absl::StrCat("message ", messages_, ": ");
  const Limits& limits = parts_.registry.limits();
  const absl::StatusOr<std::vector<Vector>> points =
      DecodePoints(request().points(), limits.max_points_per_chunk);
  if (!points.ok()) return Prefixed(name, points.status());
  call().AddPoints(points->size());
  const uint64_t received = replacement_.counts.received + points->size();
  if (received > limits.max_points_per_hull) {
    return LimitExceeded(absl::StrCat(name, "the hull would have received ", received, " points"),
                         limits.max_points_per_hull, "max-points-per-hull");
  }
  if (absl::Status s = parts_.registry.CheckMemory(MemoryUse::kWriting); !s.ok())
    return Prefixed(name, s);
  const absl::StatusOr<PointCounts> added = replacement_.builder->Add(
      *points,
      {static_cast<size_t>(limits.max_vertices_per_hull), [this] { return call().ShouldStop(); }});
  if (absl::IsResourceExhausted(added.status())) {
    return LimitExceeded(name + "the hull would hold too many vertices",
                         limits.max_vertices_per_hull, "max-vertices-per-hull");
  }
  if (!added.ok()) return Prefixed(name, added.status());
  charge_.Set(replacement_.builder->MemoryBytes());
  replacement_.counts += *added;
  return absl::OkStatus();
}

void ReplaceStream::Commit() {
  // The registry answers on another thread after the commit.
  const Store& store = parts_.store;
  const auto done = [this, &store](const absl::StatusOr<PutHullResult>& result) {
    // The memory was counted twice after the registry took ownership, which at worst evicted a
    // snapshot.
    charge_.Set(0);
    if (!result.ok()) return FinishCall(result.status());
    call().LogChange(result->created ? "hull created" : "hull replaced",
                     {"hull", result->hull.hull_id}, result->hull.revision);
    call().metrics().CountPoints(result->hull.counts);
    v1::ReplaceHullResponse response;
    EncodeHeader(store, result->store_revision, response.mutable_header());
    EncodeRecord(result->hull, response.mutable_hull());
    response.set_created(result->created);
    response.set_durability(EncodeDurability(store.durability()));
    *response_ = SerializeReply(response);
    FinishCall(absl::OkStatus());
  };
  parts_.registry.changes().Replace(std::move(replacement_), done);
}

}  // namespace hulld::server
