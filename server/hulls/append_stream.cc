#include <absl/status/status.h>
#include <absl/status/statusor.h>
#include <grpcpp/grpcpp.h>

#include <algorithm>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>

#include "core/base/check.h"
#include "core/base/status_macros.h"
#include "hulld/v1/hull.pb.h"
#include "server/call/call_stream.h"
#include "server/call/service_parts.h"
#include "server/contract/errors.h"
#include "server/hulls/hull_service.h"
#include "server/hulls/in_order.h"
#include "server/process/random_id.h"
#include "server/wire/decode.h"
#include "server/wire/encode.h"

namespace hulld::server {
namespace {

absl::Status ValidateWriterId(const std::string& writer_id) {
  if (writer_id.size() <= Config::kMaxIdCharacters) return absl::OkStatus();
  return InvalidArgument("open.writer_id has ", writer_id.size(), " bytes; the limit is ",
                         Config::kMaxIdCharacters);
}

// One chunk is being built and one is being decoded.
constexpr int kMaxUnbuilt = 2;
constexpr int kMaxUncommitted = 64;

void AddTo(v1::PointCounts* sums, const PointCounts& counts) {
  sums->set_received(sums->received() + counts.received);
  sums->set_outside(sums->outside() + counts.outside);
  sums->set_duplicate(sums->duplicate() + counts.duplicate);
  sums->set_inside(sums->inside() + counts.inside);
}

// An AppendPoints call. Reads a chunk, queues it in the registry, and reads at most one chunk ahead
// of the one being built, so a fast client fills gRPC's window rather than the server's memory.
// Built chunks drop their points before they wait for their commit. An ack that must wait for the
// previous one is merged with the next. Reading does not wait for writing, so a client may send
// everything before it reads an ack.
class AppendStream : public ReadingStream<QueuedStream<BidiReactor, v1::AppendPointsResponse>,
                                          v1::AppendPointsRequest> {
 public:
  AppendStream(CallContext& context, const ServiceParts& parts)
      : ReadingStream(context, parts.admission, Rpc::kAppendPoints), parts_(parts) {}

 private:
  struct SequenceResult {
    uint64_t sequence = 0;
    absl::StatusOr<ChunkResult> result;
  };

  void OnDone() override {
    const auto self = shared_from_this();
    ReadingStream::OnDone();
    Locked([this] {
      if (!session_.has_value()) return;
      LogApplied();
      parts_.registry.changes().CloseAppend(*session_);
    });
  }

  // The members below require the mutex.
  void StartWork() override {
    if (!reading() && !opening_ && unbuilt_ < kMaxUnbuilt && uncommitted_ < kMaxUncommitted) Read();
  }

  bool IsWorking() const override { return opening_ || unbuilt_ > 0 || uncommitted_ > 0; }
  void OnMessage() override {
    if (end().has_value()) return;
    absl::Status status = InvalidArgument("the message is empty; set open or chunk");
    if (request().has_open()) status = HandleOpen(request().open());
    if (request().has_chunk()) status = HandleChunk(request().chunk());
    if (!status.ok()) Fail(status);
  }

  void OnNoMessage(const absl::Status& why) override { Fail(OrStopped(why)); }

  absl::Status HandleOpen(const v1::AppendOpen& open) {
    if (session_.has_value()) {
      return InvalidArgument(
          "open was sent twice; a stream appends to one hull; start a new stream");
    }
    HULLD_RETURN_IF_ERROR(CheckHullId(call().caller(), open.hull_id(), "open.hull_id"));
    HULLD_RETURN_IF_ERROR(ValidateWriterId(open.writer_id()));
    writer_id_ = open.writer_id().empty() ? RandomId() : open.writer_id();
    opening_ = true;
    const auto on_gone = [weak = weak_from_this()](const absl::Status& reason) {
      const auto stream = weak.lock();
      if (stream == nullptr) return;
      auto& self = static_cast<AppendStream&>(*stream);
      self.Locked([&] { self.Fail(reason); });
    };
    hull_id_ = open.hull_id();
    parts_.registry.changes().OpenAppend(
        open.hull_id(), writer_id_, open.create_if_absent(), on_gone,
        [this, self = shared_from_this()](const absl::StatusOr<OpenResult>& opened) {
          Locked([&] {
            opening_ = false;
            HandleOpened(opened);
          });
        },
        call().client());
    return absl::OkStatus();
  }

  absl::Status HandleChunk(const v1::AppendChunk& message) {
    if (!session_.has_value()) {
      return InvalidArgument("the first message must be open, not a chunk");
    }
    HULLD_ASSIGN_OR_RETURN(Chunk chunk,
                           DecodeChunk(message, parts_.registry.limits().max_points_per_chunk));
    request().Clear();
    ++unbuilt_;
    ++uncommitted_;
    call().AddPoints(chunk.points.size());
    const auto self = shared_from_this();
    const uint64_t sequence = chunk.sequence;
    const uint64_t number = results_.Number();
    const auto arrival = std::chrono::steady_clock::now();
    parts_.registry.changes().Append(
        *session_, std::move(chunk), [this, self] { return call().ShouldStop(); },
        [this, self] { Locked([this] { --unbuilt_; }); },
        [this, self, sequence, number, arrival](const absl::StatusOr<ChunkResult>& result) {
          Locked([&] {
            --uncommitted_;
            if (result.ok()) call().EndMessage(arrival);
            results_.Take(number, {sequence, result},
                          [this](const SequenceResult& each) { HandleResult(each); });
          });
        });
    return absl::OkStatus();
  }

  void HandleOpened(const absl::StatusOr<OpenResult>& opened) {
    if (!opened.ok()) return Fail(opened.status());
    session_ = opened->session;
    if (session_->created_hull) {
      call().LogChange("hull created", {"hull", opened->hull.hull_id}, opened->hull.revision);
    }
    if (end().has_value()) return;
    v1::AppendPointsResponse opened_reply;
    v1::AppendOpened* reply = opened_reply.mutable_opened();
    EncodeHeader(parts_.store, opened->store_revision, reply->mutable_header());
    EncodeRecord(opened->hull, reply->mutable_hull());
    reply->set_writer_id(writer_id_);
    reply->set_last_sequence(opened->last_sequence);
    Queue(std::move(opened_reply));
  }

  void HandleResult(const SequenceResult& chunk) {
    const auto& [sequence, result] = chunk;
    HULLD_DCHECK(unbuilt_ >= 0 && uncommitted_ >= 0);
    if (!result.ok()) {
      const absl::Status status = OrStopped(result.status());
      // The client may have half-closed before the chunk was refused.
      return end().has_value() && end()->ok() ? OverrideEnd(status) : Fail(status);
    }
    call().metrics().CountPoints(result->counts);
    if (!result->already_applied) {
      ++applied_chunks_;
      applied_points_ += result->counts.received;
      last_revision_ = result->hull_revision;
    }
    if (call().ShouldStop()) return;  // the client disconnected
    // `opened` is sent before the first chunk is read, so a queued reply can only be an ack.
    if (LastWaiting() == nullptr) Queue({});
    HULLD_CHECK(!LastWaiting()->reply.has_opened());
    v1::AppendAck* ack = LastWaiting()->reply.mutable_ack();
    EncodeHeader(parts_.store, result->store_revision, ack->mutable_header());
    ack->set_sequence(std::max(ack->sequence(), sequence));
    if (ack->outcome() != v1::APPEND_OUTCOME_APPLIED) {
      ack->set_outcome(result->already_applied ? v1::APPEND_OUTCOME_ALREADY_APPLIED
                                               : v1::APPEND_OUTCOME_APPLIED);
    }
    ack->set_durability(EncodeDurability(parts_.store.durability()));
    ack->set_hull_revision(result->hull_revision);
    ack->set_vertex_count(result->vertex_count);
    AddTo(ack->mutable_counts(), result->counts);
  }

  // Requires that the call has not finished in gRPC.
  void LogApplied() {
    if (applied_chunks_ == 0) return;
    call().LogChange(
        "points appended", {"hull", hull_id_}, last_revision_,
        {{"writer", writer_id_}, {"chunks", applied_chunks_}, {"points", applied_points_}});
  }

  void Fail(const absl::Status& status) {
    if (end().has_value()) return;
    End(status);
    if (!status.ok() && session_.has_value()) {
      call().Log(LogLevel::debug, "append ended early", {{"writer", session_->writer_id}});
    }
  }

  const ServiceParts& parts_;
  std::optional<AppendSession> session_;
  std::string hull_id_;
  std::string writer_id_;
  // Committed work of this stream, for its log line.
  uint64_t applied_chunks_ = 0;
  uint64_t applied_points_ = 0;
  uint64_t last_revision_ = 0;
  bool opening_ = false;
  // Number of chunks that still have their points, and of chunks neither committed nor refused.
  int unbuilt_ = 0;
  int uncommitted_ = 0;
  // Acks are cumulative, and the error of the earliest refused chunk is the most specific.
  InOrder<SequenceResult> results_;
};

}  // namespace

BidiReactor* StartAppend(CallContext& context, const ServiceParts& parts) {
  return AppendStream::Launch(std::make_shared<AppendStream>(context, parts));
}

}  // namespace hulld::server
