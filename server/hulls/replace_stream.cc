#include <absl/status/status.h>
#include <absl/strings/str_cat.h>
#include <grpcpp/grpcpp.h>

#include <chrono>
#include <cstdint>
#include <utility>

#include "core/base/status_macros.h"
#include "core/hull/growth/hull_builder.h"
#include "hulld/v1/hull.pb.h"
#include "server/call/call_stream.h"
#include "server/call/service_parts.h"
#include "server/contract/errors.h"
#include "server/hulls/hull_service.h"
#include "server/wire/decode.h"
#include "server/wire/encode.h"

namespace hulld::server {
namespace {

// A ReplaceHull call: builds a separate hull, message by message on a writer thread, and passes it
// to the registry when the client has sent everything. Only one operation, a read or a build, is in
// flight at a time, so the state needs no mutex.
class ReplaceStream : public ReadingStream<CallStream<ReadReactor>, v1::ReplaceHullRequest> {
 public:
  // response: owned by gRPC until the call ends.
  ReplaceStream(CallContext& context, const ServiceParts& parts, Bytes* response)
      : ReadingStream(context, parts.admission, Rpc::kReplaceHull),
        parts_(parts),
        response_(response),
        charge_(parts.registry.memory(), MemoryUse::kWriting) {}

 private:
  void Open() override { Read(); }
  void OnMessage() override {
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

  void OnNoMessage(const absl::Status& why) override {
    if (call().ShouldStop()) return FinishCall(call().StopStatus());
    if (!why.ok()) return FinishCall(why);
    const bool opened = replacement_.builder != nullptr;
    // Only the empty block distinguishes a complete request from a client that disconnected.
    if (opened && complete_) return RunOn(parts_.writers, [this] { Commit(); });
    FinishCall(InvalidArgument(opened ? "the stream ended without the empty block of points "
                                        "that marks its end; the hull is unchanged"
                                      : "the stream ended before its first message, open"));
  }

  // Handles a message, except for building.
  absl::Status HandleMessage() {
    const bool opened = replacement_.builder != nullptr;
    if (request().has_open()) {
      if (!opened) return HandleOpen(request().open());
      return InvalidArgument("open was sent twice; start a new stream");
    }
    if (!request().has_points()) {
      return InvalidArgument("the message is empty; set open or points");
    }
    if (!opened) return InvalidArgument("the first message must be open, not points");
    complete_ = request().points().xyz().empty() && request().points().xyz_float().empty();
    return absl::OkStatus();
  }

  absl::Status HandleOpen(const v1::ReplaceOpen& open) {
    HULLD_RETURN_IF_ERROR(CheckHullId(call().caller(), open.hull_id(), "open.hull_id"));
    replacement_.hull_id = open.hull_id();
    replacement_.if_revision = IfRevision(open);
    replacement_.create_if_absent = open.create_if_absent();
    replacement_.builder = std::make_shared<HullBuilder>();
    return absl::OkStatus();
  }

  absl::Status Build() {
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
        *points, {static_cast<size_t>(limits.max_vertices_per_hull), call().should_stop()});
    if (absl::IsResourceExhausted(added.status())) {
      return LimitExceeded(name + "the hull would have too many vertices",
                           limits.max_vertices_per_hull, "max-vertices-per-hull");
    }
    if (!added.ok()) return Prefixed(name, added.status());
    charge_.Set(replacement_.builder->MemoryBytes());
    replacement_.counts += *added;
    return absl::OkStatus();
  }

  void Commit() {
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

  const ServiceParts& parts_;
  Bytes* const response_;
  // Memory charged for the builder until the registry takes ownership.
  MemoryCharge charge_;
  Replacement replacement_;
  uint64_t messages_ = 0;
  // True if the last message was an empty block.
  bool complete_ = false;
};

}  // namespace

ReadReactor* StartReplace(CallContext& context, const ServiceParts& parts, Bytes* response) {
  return ReplaceStream::Launch(std::make_shared<ReplaceStream>(context, parts, response));
}

}  // namespace hulld::server
