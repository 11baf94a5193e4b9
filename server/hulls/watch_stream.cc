#include <absl/status/status.h>
#include <absl/status/statusor.h>
#include <grpcpp/grpcpp.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cstdint>
#include <memory>
#include <optional>
#include <utility>

#include "core/base/status_macros.h"
#include "hulld/v1/hull.pb.h"
#include "server/call/call_stream.h"
#include "server/call/service_parts.h"
#include "server/contract/errors.h"
#include "server/hulls/hull_service.h"
#include "server/hulls/watch_event.h"
#include "server/registry/watch/change_feed.h"
#include "server/wire/encode.h"

namespace hulld::server {
namespace {

// Returns true if the box must be read from the store. Bodies have no box.
bool WantsBox(const HullChange& change) {
  return change.record.vertex_count > 0 && change.box.IsEmpty() && !change.damaged;
}

// The array is in the order of ChangeKind.
v1::HullEventKind EncodeKind(ChangeKind kind) {
  static constexpr std::array kKinds = {v1::HULL_EVENT_KIND_PRESENT, v1::HULL_EVENT_KIND_CREATED,
                                        v1::HULL_EVENT_KIND_CHANGED, v1::HULL_EVENT_KIND_REPLACED,
                                        v1::HULL_EVENT_KIND_DELETED};
  return kKinds[static_cast<size_t>(kind)];
}

void EncodeEvent(const HullChange& change, v1::HullEvent* event) {
  event->set_kind(EncodeKind(change.kind));
  event->set_is_body(change.is_body);
  if (change.kind == ChangeKind::kDeleted) {
    event->mutable_hull()->set_hull_id(change.record.hull_id);
    event->mutable_hull()->set_revision(change.record.revision);
    return;
  }
  if (change.is_body) {
    event->mutable_hull()->set_hull_id(change.record.hull_id);
    event->mutable_hull()->set_create_revision(change.record.create_revision);
    event->mutable_hull()->set_revision(change.record.revision);
    event->set_piece_count(change.piece_count);
  } else {
    EncodeRecord(change.record, event->mutable_hull());
  }
  event->mutable_hull()->set_damaged(change.damaged);
  EncodeBox(change.box, event);
}

// A WatchHulls call. Sends one batch of changes after another. If no change is pending, the feed
// calls back later, so no thread blocks.
class WatchStream : public RequestStream<PulledStream<WriteReactor, v1::WatchHullsResponse>,
                                         v1::WatchHullsRequest> {
 public:
  WatchStream(CallContext& context, const ServiceParts& parts, const Bytes& request)
      : RequestStream(request, context, parts.admission, Rpc::kWatchHulls), parts_(parts) {}

 private:
  void Open() override {
    RunOn(parts_.readers, [this] {
      const absl::Status begun = Begin();
      begun.ok() ? SendNext() : FinishCall(OrStopped(begun));
    });
  }

  void OnSent() override {
    reply().Clear();
    if (is_synced_) return SendNext();
    RunOn(parts_.readers, [this] { SendNext(); });
  }

  void OnCancel() override {
    PulledStream::OnCancel();
    Nudge();
  }

  void OnRevoked() override { Nudge(); }
  void OnDone() override {
    const auto self = shared_from_this();
    PulledStream::OnDone();
    if (const auto watch = watch_.exchange(nullptr)) parts_.registry.feed().Close(watch);
  }

  // Opens the watch, which includes all changes that this server or a peer server acknowledged
  // before the call.
  absl::Status Begin() {
    HULLD_ASSIGN_OR_RETURN(const WatchTarget target, ReadTarget());
    if (request().after_revision() > 0 && request().store_id().empty()) {
      return InvalidArgument("after_revision requires store_id; use the one from the same header");
    }
    HULLD_RETURN_IF_ERROR(parts_.registry.peers().AwaitPeers(call().should_stop()));
    HULLD_ASSIGN_OR_RETURN(watch_, parts_.registry.feed().Open(
                                       target, {request().after_revision(), request().store_id()},
                                       [this, self = shared_from_this()] { SendNext(); }));
    return absl::OkStatus();
  }

  absl::StatusOr<WatchTarget> ReadTarget() const {
    if (request().hull_id().empty()) {
      HULLD_ASSIGN_OR_RETURN(std::string prefix, PrefixToList(call().caller(), request().prefix()));
      return WatchTarget{std::move(prefix), {}, request().bodies()};
    }
    if (!request().prefix().empty()) {
      return InvalidArgument("prefix and hull_id are both set; set one of them");
    }
    HULLD_RETURN_IF_ERROR(CheckHullId(call().caller(), request().hull_id(), "hull_id"));
    return WatchTarget{"", {request().hull_id()}, request().bodies()};
  }

  // Sends the next batch, or waits for on_ready, which calls this function again. At most one such
  // call is running or pending.
  void SendNext() {
    while (true) {
      if (call().ShouldStop()) return FinishCall(call().StopStatus());
      absl::StatusOr<WatchBatch> batch = parts_.registry.feed().Next(watch_);
      if (!batch.ok()) return FinishCall(batch.status());
      // on_ready may already run on another thread.
      if (batch->waits) return;
      is_synced_ = batch->synced || (is_synced_ && !batch->restarted);
      const bool is_mark = batch->revision > sent_revision_;
      if (batch->changes.empty() && !batch->synced && !batch->restarted && !is_mark) continue;
      if (!std::ranges::any_of(batch->changes, WantsBox)) return SendBatch(*batch);
      return RunOn(parts_.readers, [this, loaded = *std::move(batch)]() mutable {
        const absl::Status status = LoadBoxes(&loaded);
        if (!status.ok()) return FinishCall(OrStopped(status));
        SendBatch(loaded);
      });
    }
  }

  // Reads the missing boxes at the current revisions of their hulls, one hull at a time to bound
  // memory. Drops hulls that were deleted or replaced; a later batch reports that.
  absl::Status LoadBoxes(WatchBatch* batch) {
    std::vector<HullChange> loaded;
    loaded.reserve(batch->changes.size());
    for (HullChange& change : batch->changes) {
      if (WantsBox(change)) {
        const auto resolved = parts_.registry.Resolve(change.record.hull_id, call().should_stop(),
                                                      Freshness::AnyStaleness());
        const absl::Status& status = resolved.status();
        if (absl::IsNotFound(status)) continue;
        if (!status.ok() && !absl::IsDataLoss(status)) return status;
        change.damaged = !status.ok();
        if (resolved.ok()) {
          const HullView& view = resolved->second;
          std::optional<HullChange> current =
              AtCurrentState(std::move(change), view.record, view.served->box());
          if (current.has_value()) loaded.push_back(*std::move(current));
          continue;
        }
      }
      loaded.push_back(std::move(change));
    }
    batch->changes = std::move(loaded);
    return absl::OkStatus();
  }

  void SendBatch(const WatchBatch& batch) {
    sent_revision_ = batch.revision;
    EncodeHeader(parts_.store, batch.revision, reply().mutable_header());
    reply().set_synced(batch.synced);
    reply().set_restarted(batch.restarted);
    for (const HullChange& change : batch.changes) EncodeEvent(change, reply().add_events());
    Send();
  }

  // Makes the stream check whether it should stop.
  void Nudge() {
    if (const auto watch = watch_.load()) parts_.registry.feed().Nudge(watch);
  }

  const ServiceParts& parts_;
  // Read by threads that cancel.
  std::atomic<std::shared_ptr<Watch>> watch_;
  // True after the existing hulls were sent.
  bool is_synced_ = false;
  // The revision of the last header.
  uint64_t sent_revision_ = 0;
};

}  // namespace

WriteReactor* StartWatch(CallContext& context, const ServiceParts& parts, const Bytes& request) {
  return WatchStream::Launch(std::make_shared<WatchStream>(context, parts, request));
}

}  // namespace hulld::server
