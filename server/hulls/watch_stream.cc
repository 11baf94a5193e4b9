#include "server/hulls/watch_stream.h"

#include <algorithm>
#include <utility>

#include "core/base/check.h"
#include "server/wire/encode.h"

namespace hulld::server {
namespace {

// Returns true if the box must be read from the store. A body has neither a box nor vertices.
bool WantsBox(const HullChange& change) {
  return change.record.vertex_count > 0 && !change.has_box && !change.damaged;
}

v1::HullEventKind EncodeKind(ChangeKind kind) {
  switch (kind) {
    case ChangeKind::kPresent:
      return v1::HULL_EVENT_KIND_PRESENT;
    case ChangeKind::kCreated:
      return v1::HULL_EVENT_KIND_CREATED;
    case ChangeKind::kChanged:
      return v1::HULL_EVENT_KIND_CHANGED;
    case ChangeKind::kReplaced:
      return v1::HULL_EVENT_KIND_REPLACED;
    case ChangeKind::kDeleted:
      return v1::HULL_EVENT_KIND_DELETED;
  }
  HULLD_UNREACHABLE();
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
  if (!change.has_box) return;
  EncodeVector(change.low, event->mutable_box_min());
  EncodeVector(change.high, event->mutable_box_max());
}

}  // namespace

WriteReactor* WatchStream::Start(grpc::CallbackServerContext& context, Admission& admission,
                                 Registry& registry, WorkerPool& readers,
                                 const grpc::ByteBuffer& request) {
  return Launch(std::shared_ptr<WatchStream>(
      new WatchStream(context, admission, registry, readers, request)));
}

void WatchStream::Open() {
  const absl::StatusOr<WatchTarget> target = ReadTarget();
  if (!target.ok()) return FinishCall(target.status());
  const absl::StatusOr<WatchStart> start = ReadStart();
  if (!start.ok()) return FinishCall(start.status());
  RunOn(readers_, [this, target = *target, start = *start] { Begin(target, start); });
}

// The watch includes every change acknowledged so far by this server or by a peer.
void WatchStream::Begin(const WatchTarget& target, const WatchStart& start) {
  const auto should_stop = [this] { return call().ShouldStop(); };
  const absl::Status fresh = registry_.barrier().AwaitPeers(should_stop);
  if (call().ShouldStop()) return FinishCall(call().StopStatus());
  if (!fresh.ok()) return FinishCall(fresh);
  absl::StatusOr<std::shared_ptr<ChangeWatch>> watch =
      registry_.OpenWatch(target, start, [this, self = shared_from_this()] { TellNext(); });
  if (!watch.ok()) return FinishCall(watch.status());
  {
    const std::lock_guard lock(watch_mutex_);
    watch_ = *std::move(watch);
  }
  TellNext();
}

absl::StatusOr<WatchTarget> WatchStream::ReadTarget() const {
  if (request().hull_id().empty()) {
    absl::StatusOr<std::string> prefix = PrefixToList(call().caller(), request().prefix());
    if (!prefix.ok()) return prefix.status();
    return WatchTarget{*std::move(prefix), {}, request().bodies()};
  }
  if (!request().prefix().empty()) {
    return absl::InvalidArgumentError("prefix and hull_id are both set; set one of them");
  }
  const absl::Status valid = CheckHullId(call().caller(), request().hull_id(), "hull_id");
  if (!valid.ok()) return valid;
  return WatchTarget{"", {request().hull_id()}, request().bodies()};
}

absl::StatusOr<WatchStart> WatchStream::ReadStart() const {
  if (request().after_revision() > 0 && request().store_id().empty()) {
    return absl::InvalidArgumentError(
        "after_revision requires store_id; use the one from the same header");
  }
  return WatchStart{true, request().after_revision(), request().store_id()};
}

// Sends the next changes, or arms the watch to call this again. At most one call runs or is due.
void WatchStream::TellNext() {
  while (true) {
    if (call().ShouldStop()) return FinishCall(call().StopStatus());
    absl::StatusOr<WatchPiece> piece = registry_.TakeChanges(*watch_);
    if (!piece.ok()) return FinishCall(piece.status());
    // A concurrent call may already be running.
    if (piece->waits) return;
    is_synced_ = piece->synced || (is_synced_ && !piece->anew);
    const bool is_mark = piece->revision > sent_revision_;
    if (piece->changes.empty() && !piece->synced && !piece->anew && !is_mark) continue;
    if (!std::ranges::any_of(piece->changes, WantsBox)) return Tell(*piece);
    return RunOn(readers_, [this, loaded = *std::move(piece)]() mutable {
      const absl::Status status = LoadBoxes(&loaded);
      if (!status.ok()) return FinishCall(OrStopped(status));
      Tell(loaded);
    });
  }
}

// Reads the missing boxes at the current revisions of their hulls, hull by hull to bound memory.
// Drops hulls that were deleted; a later piece reports the deletion.
absl::Status WatchStream::LoadBoxes(WatchPiece* piece) {
  std::vector<HullChange> loaded;
  loaded.reserve(piece->changes.size());
  for (HullChange& change : piece->changes) {
    if (WantsBox(change)) {
      const auto resolved = registry_.Resolve(
          change.record.hull_id, [this] { return call().ShouldStop(); }, Freshness::AnyStaleness());
      const absl::Status& status = resolved.status();
      if (absl::IsNotFound(status)) continue;
      if (!status.ok() && !absl::IsDataLoss(status)) return status;
      change.damaged = !status.ok();
      if (resolved.ok()) {
        const HullView& view = resolved->second;
        change.record = view.record;
        change.has_box = !view.served->empty();
        change.low = view.served->low();
        change.high = view.served->high();
      }
    }
    loaded.push_back(std::move(change));
  }
  piece->changes = std::move(loaded);
  return absl::OkStatus();
}

void WatchStream::Tell(const WatchPiece& piece) {
  sent_revision_ = piece.revision;
  EncodeHeader(registry_.store(), piece.revision, reply().mutable_header());
  reply().set_synced(piece.synced);
  reply().set_anew(piece.anew);
  for (const HullChange& change : piece.changes) EncodeEvent(change, reply().add_events());
  Send();
}

void WatchStream::OnSent() {
  reply().Clear();
  if (is_synced_) return TellNext();
  RunOn(readers_, [this] { TellNext(); });
}

void WatchStream::OnCancel() {
  PulledStream::OnCancel();
  Nudge();
}

void WatchStream::Nudge() {
  std::shared_ptr<ChangeWatch> watch;
  {
    const std::lock_guard lock(watch_mutex_);
    watch = watch_;
  }
  if (watch != nullptr) registry_.NudgeWatch(watch);
}

void WatchStream::OnDone() {
  const auto self = shared_from_this();
  PulledStream::OnDone();
  std::shared_ptr<ChangeWatch> watch;
  {
    const std::lock_guard lock(watch_mutex_);
    watch = std::exchange(watch_, nullptr);
  }
  if (watch != nullptr) registry_.CloseWatch(watch);
}

}  // namespace hulld::server
