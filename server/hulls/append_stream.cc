#include "server/hulls/append_stream.h"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <utility>

#include "server/call/stream_message.h"
#include "server/contract/status_map.h"
#include "server/process/random_id.h"
#include "server/wire/decode.h"
#include "server/wire/encode.h"

namespace hulld::server {
namespace {

absl::Status ValidateWriterId(const std::string& writer_id) {
  if (writer_id.size() <= Config::kMaxIdCharacters) return absl::OkStatus();
  return absl::InvalidArgumentError(absl::StrCat("open.writer_id holds ", writer_id.size(),
                                                 " bytes; the limit is ",
                                                 Config::kMaxIdCharacters));
}

// One chunk that is being built and one that is decoded meanwhile.
constexpr int kMaxUnbuilt = 2;
constexpr int kMaxUncommitted = 64;

void AddTo(v1::PointCounts* sums, const PointCounts& counts) {
  sums->set_received(sums->received() + counts.received);
  sums->set_outside(sums->outside() + counts.outside);
  sums->set_duplicate(sums->duplicate() + counts.duplicate);
  sums->set_inside(sums->inside() + counts.inside);
}

}  // namespace

grpc::ServerBidiReactor<v1::AppendPointsRequest, v1::AppendPointsResponse>* AppendStream::Start(
    grpc::CallbackServerContext& context, Admission& admission, Registry& registry) {
  const std::shared_ptr<AppendStream> stream(new AppendStream(context, admission, registry));
  stream->self_ = stream;
  const absl::Status begun = stream->call_.Begin();
  const std::lock_guard lock(stream->mutex_);
  if (!begun.ok()) stream->End(begun);
  stream->Proceed();
  return stream.get();
}

void AppendStream::OnReadDone(bool ok) {
  const std::shared_ptr<AppendStream> self = shared_from_this();
  const std::lock_guard lock(mutex_);
  reading_ = false;
  if (!end_.has_value()) {
    if (ok) {
      HandleMessage();
    } else {
      // The client has said all, or is gone, or speaks another language.
      End(call_.ShouldStop() ? call_.StopStatus() : WhyNotRead(request_));
    }
  }
  Proceed();
}

void AppendStream::OnWriteDone(bool ok) {
  const std::shared_ptr<AppendStream> self = shared_from_this();
  const std::lock_guard lock(mutex_);
  writing_ = false;
  if (!ok) {
    next_reply_.reset();
    End(absl::CancelledError("the client is gone"));
  }
  Proceed();
}

void AppendStream::OnCancel() {
  const std::shared_ptr<AppendStream> self = shared_from_this();
  call_.Cancel();
  const std::lock_guard lock(mutex_);
  next_reply_.reset();
  End(call_.StopStatus());
  Proceed();
}

void AppendStream::OnDone() {
  const std::shared_ptr<AppendStream> last = std::move(self_);
  const std::lock_guard lock(mutex_);
  if (session_.has_value()) registry_.CloseAppend(*session_);
}

void AppendStream::HandleMessage() {
  switch (request_.message_case()) {
    case v1::AppendPointsRequest::kOpen:
      return HandleOpen(request_.open());
    case v1::AppendPointsRequest::kChunk:
      return HandleChunk(request_.chunk());
    case v1::AppendPointsRequest::MESSAGE_NOT_SET:
      return End(absl::InvalidArgumentError("the message is empty; set open or chunk"));
  }
}

void AppendStream::HandleOpen(const v1::AppendOpen& open) {
  if (session_.has_value()) {
    return End(absl::InvalidArgumentError(
        "open came twice; one stream appends to one hull, so start another stream"));
  }
  if (absl::Status s = CheckHullId(call_.caller(), open.hull_id(), "open.hull_id"); !s.ok()) {
    return End(s);
  }
  if (absl::Status s = ValidateWriterId(open.writer_id()); !s.ok()) return End(s);
  writer_id_ = open.writer_id().empty() ? RandomId() : open.writer_id();
  opening_ = true;
  const std::weak_ptr<AppendStream> weak = weak_from_this();
  const auto on_gone = [weak](const absl::Status& reason) {
    const std::shared_ptr<AppendStream> stream = weak.lock();
    if (stream == nullptr) return;
    const std::lock_guard lock(stream->mutex_);
    stream->End(reason);
    stream->Proceed();
  };
  registry_.OpenAppend(open.hull_id(), writer_id_, open.create_if_absent(), on_gone,
                       [self = shared_from_this()](const absl::StatusOr<OpenResult>& opened) {
                         const std::lock_guard lock(self->mutex_);
                         self->opening_ = false;
                         self->HandleOpened(opened);
                         self->Proceed();
                       });
}

void AppendStream::HandleOpened(const absl::StatusOr<OpenResult>& opened) {
  if (!opened.ok()) return End(opened.status());
  session_ = opened->session;
  if (session_->created_hull) {
    call_.Log(LogLevel::kInfo, "hull created", {{"hull", opened->hull.hull_id}});
  }
  if (end_.has_value()) return;
  v1::AppendOpened* reply = next_reply_.emplace().mutable_opened();
  EncodeHeader(registry_.store(), opened->store_revision, reply->mutable_header());
  EncodeRecord(opened->hull, reply->mutable_hull());
  reply->set_writer_id(writer_id_);
  reply->set_last_sequence(opened->last_sequence);
}

void AppendStream::HandleChunk(const v1::AppendChunk& message) {
  if (!session_.has_value()) {
    return End(absl::InvalidArgumentError("the first message must be open, not a chunk"));
  }
  absl::StatusOr<Chunk> chunk = DecodeChunk(message, registry_.limits().max_points_per_chunk);
  if (!chunk.ok()) return End(chunk.status());
  request_.Clear();
  ++unbuilt_;
  ++uncommitted_;
  call_.AddPoints(chunk->points.size());
  const std::shared_ptr<AppendStream> self = shared_from_this();
  const uint64_t sequence = chunk->sequence;
  const auto arrival = std::chrono::steady_clock::now();
  registry_.Append(
      *session_, *std::move(chunk), [self] { return self->call_.ShouldStop(); },
      [self] {
        const std::lock_guard lock(self->mutex_);
        --self->unbuilt_;
        self->Proceed();
      },
      [self, sequence, arrival](const absl::StatusOr<ChunkResult>& result) {
        const std::lock_guard lock(self->mutex_);
        --self->uncommitted_;
        if (result.ok()) self->call_.EndMessage(arrival);
        self->HandleResult(sequence, result);
        self->Proceed();
      });
}

void AppendStream::HandleResult(uint64_t sequence, const absl::StatusOr<ChunkResult>& result) {
  if (!result.ok()) {
    const bool stopped = call_.ShouldStop();
    return EndAt(sequence, stopped ? call_.StopStatus() : result.status());
  }
  call_.metrics().CountPoints(result->counts);
  if (finished_) return;
  if (!next_reply_.has_value()) next_reply_.emplace();
  // `opened` is on its way before the first chunk is read, so what waits can only be an ack.
  v1::AppendAck* ack = next_reply_->mutable_ack();
  EncodeHeader(registry_.store(), result->store_revision, ack->mutable_header());
  ack->set_sequence(std::max(ack->sequence(), sequence));
  if (ack->outcome() != v1::APPEND_OUTCOME_APPLIED) {
    ack->set_outcome(result->already_applied ? v1::APPEND_OUTCOME_ALREADY_APPLIED
                                             : v1::APPEND_OUTCOME_APPLIED);
  }
  ack->set_durability(EncodeDurability(registry_.store().durability()));
  ack->set_hull_revision(result->hull_revision);
  ack->set_vertex_count(result->vertex_count);
  AddTo(ack->mutable_counts(), result->counts);
}

void AppendStream::End(const absl::Status& status) {
  if (end_.has_value()) return;
  end_ = status;
  if (!status.ok() && session_.has_value()) {
    call_.Log(LogLevel::kDebug, "append ended early", {{"writer", session_->writer_id}});
  }
}

void AppendStream::EndAt(uint64_t sequence, const absl::Status& status) {
  // The client may have said all before the chunk was refused.
  if (end_.has_value() && (end_->ok() || end_sequence_ > sequence)) end_.reset();
  if (!end_.has_value()) end_sequence_ = sequence;
  End(status);
}

// Starts whatever may start now. Reading does not wait for writing, so that a client which sends
// everything before it reads an ack is served too.
void AppendStream::Proceed() {
  if (finished_) return;
  if (!writing_ && next_reply_.has_value()) {
    writing_ = true;
    reply_in_flight_ = *std::move(next_reply_);
    next_reply_.reset();
    StartWrite(&reply_in_flight_);
  } else if (!writing_ && end_.has_value() && !opening_ && unbuilt_ == 0 && uncommitted_ == 0) {
    finished_ = true;
    Finish(call_.End(*end_));
    return;
  }
  if (!end_.has_value() && !reading_ && !opening_ && unbuilt_ < kMaxUnbuilt &&
      uncommitted_ < kMaxUncommitted) {
    reading_ = true;
    PrepareToRead(&request_);
    StartRead(&request_);
  }
}

}  // namespace hulld::server
