#include "client/appender.h"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <random>
#include <utility>

#include "client/append_connection.h"
#include "client/base/status_macros.h"
#include "client/calls/grpc_status.h"

namespace hulld {
namespace {

std::string RandomWriterId() {
  std::random_device device;
  return absl::StrCat("client-", absl::Hex(device(), absl::kZeroPad8),
                      absl::Hex(device(), absl::kZeroPad8));
}

uint64_t PointsIn(const v1::PointBlock& block) {
  return static_cast<uint64_t>(block.xyz_size() + block.xyz_float_size()) / 3;
}

// Returns the final status of an ended connection, with the server's error details.
absl::Status EndOf(AppendConnection* connection) {
  const grpc::Status status = connection->Close();
  return FromGrpcStatus(status, connection->context());
}

}  // namespace

Appender::Appender(std::shared_ptr<v1::HullService::Stub> stub, v1::AppendOpen open,
                   AppendOptions options, std::chrono::milliseconds timeout, RetryPolicy retry)
    : stub_(std::move(stub)),
      open_(std::move(open)),
      options_(std::move(options)),
      timeout_(timeout),
      retry_(std::move(retry)) {
  if (open_.writer_id().empty()) open_.set_writer_id(RandomWriterId());
}

Appender::~Appender() = default;

absl::Status Appender::Fail(absl::Status status) {
  failed_ = status;
  connection_ = nullptr;
  return status;
}

absl::StatusOr<v1::AppendOpened> Appender::Connect() {
  // Ends the old stream before opening the new one, so that the server sees one stream per writer.
  written_ = 0;
  connection_ = nullptr;
  connection_ = std::make_unique<AppendConnection>(stub_.get());
  auto request = std::make_shared<v1::AppendPointsRequest>();
  *request->mutable_open() = open_;
  connection_->Write(std::move(request));
  const Deadline deadline = std::chrono::steady_clock::now() + timeout_;
  if (!connection_->WaitForEvent(false, deadline)) {
    connection_ = nullptr;
    return absl::DeadlineExceededError(
        absl::StrCat("the server did not open the stream within ", timeout_.count(), " ms"));
  }
  v1::AppendPointsResponse response;
  if (!connection_->TakeResponse(&response)) {
    absl::Status status = EndOf(connection_.get());
    if (status.ok()) status = absl::InternalError("the server ended the stream before opening it");
    return status;
  }
  if (!response.has_opened()) {
    return absl::InternalError("the server answered an append stream without `opened`");
  }
  return std::move(*response.mutable_opened());
}

absl::Status Appender::OpenFirst() {
  const Deadline deadline = retry_.Now() + timeout_;
  absl::Status status = CallWithRetries(retry_, deadline, [this] {
    HULLD_ASSIGN_OR_RETURN(opened_, Connect());
    return absl::OkStatus();
  });
  if (!status.ok()) return Fail(std::move(status));
  next_sequence_ = opened_.last_sequence() + 1;
  totals_.hull_revision = opened_.hull().revision();
  totals_.vertex_count = opened_.hull().vertex_count();
  // The hull exists now. If it is missing on reconnect, recreating it would hide the loss of
  // points.
  open_.set_create_if_absent(false);
  return absl::OkStatus();
}

absl::Status Appender::Reconnect(absl::Status cause) {
  while (MayRetry(cause)) {
    if (failures_++ == 0) give_up_at_ = retry_.Now() + timeout_;
    if (!WaitBeforeRetry(retry_, failures_, give_up_at_, cause)) break;
    absl::StatusOr<v1::AppendOpened> opened = Connect();
    if (opened.ok()) {
      ++totals_.reconnects;
      return ResumeAfter(*opened);
    }
    cause = opened.status();
    if (absl::IsNotFound(cause)) {
      cause = absl::FailedPreconditionError(
          absl::StrCat("hull \"", open_.hull_id(),
                       "\" was deleted while the connection was down; append all points again"));
    }
  }
  return Fail(std::move(cause));
}

absl::Status Appender::ResumeAfter(const v1::AppendOpened& opened) {
  if (opened.header().store_id() != opened_.header().store_id() ||
      opened.hull().create_revision() != opened_.hull().create_revision()) {
    return Fail(absl::FailedPreconditionError(absl::StrCat(
        "hull \"", open_.hull_id(), "\" was replaced while the connection was down; ",
        totals_.points_acknowledged, " acknowledged points were lost with the old one; ",
        "append all points again")));
  }
  const uint64_t first = next_sequence_ - unacknowledged_.size();
  const uint64_t last = opened.last_sequence();
  if (last + 1 < first || last >= next_sequence_) {
    return Fail(absl::InternalError(absl::StrCat("the server's last sequence of writer \"",
                                                 open_.writer_id(), "\" is ", last,
                                                 ", which this stream cannot continue; check that "
                                                 "no other client uses the same writer ID")));
  }
  DropAcknowledged(last, /*recovered=*/true);
  return absl::OkStatus();
}

absl::Status Appender::Append(v1::PointBlock points) {
  if (!failed_.ok()) return failed_;
  Chunk chunk;
  chunk.points = PointsIn(points);
  auto request = std::make_shared<v1::AppendPointsRequest>();
  request->mutable_chunk()->set_sequence(next_sequence_++);
  *request->mutable_chunk()->mutable_points() = std::move(points);
  chunk.bytes = request->ByteSizeLong();
  chunk.request = std::move(request);
  bytes_in_flight_ += chunk.bytes;
  ++totals_.chunks_sent;
  totals_.points_sent += chunk.points;
  unacknowledged_.push_back(std::move(chunk));
  // Makes room for the next chunk.
  return PumpUntil(std::max<size_t>(options_.max_in_flight_chunks, 1) - 1,
                   std::max<size_t>(options_.max_in_flight_bytes, 1) - 1);
}

absl::Status Appender::PumpUntil(size_t chunks, size_t bytes) {
  Deadline deadline = std::chrono::steady_clock::now() + timeout_;
  for (;;) {
    v1::AppendPointsResponse response;
    while (connection_->TakeResponse(&response)) {
      HULLD_RETURN_IF_ERROR(TakeResponse(response));
      deadline = std::chrono::steady_clock::now() + timeout_;
    }
    if (unacknowledged_.empty()) return absl::OkStatus();
    if (connection_->ended()) {
      // A response may have arrived between the two checks.
      if (connection_->TakeResponse(&response)) {
        HULLD_RETURN_IF_ERROR(TakeResponse(response));
        continue;
      }
      absl::Status status = EndOf(connection_.get());
      if (status.ok())
        status = absl::InternalError("the server ended the stream before its last ack");
      if (status = Reconnect(std::move(status)); !status.ok()) return status;
      deadline = std::chrono::steady_clock::now() + timeout_;
      continue;
    }
    const bool to_write = written_ < unacknowledged_.size();
    if (to_write && connection_->writable()) {
      connection_->Write(unacknowledged_[written_++].request);
      continue;
    }
    const bool all_written = !to_write;
    if (all_written && unacknowledged_.size() <= chunks && bytes_in_flight_ <= bytes) {
      return absl::OkStatus();
    }
    if (!connection_->WaitForEvent(to_write, deadline)) {
      return Fail(absl::DeadlineExceededError(
          absl::StrCat("the server acknowledged no chunk for ", timeout_.count(), " ms; ",
                       totals_.points_acknowledged, " points are committed")));
    }
  }
}

absl::Status Appender::TakeResponse(const v1::AppendPointsResponse& response) {
  if (!response.has_ack()) return Fail(absl::InternalError("the server sent `opened` twice"));
  const v1::AppendAck& ack = response.ack();
  if (ack.sequence() >= next_sequence_) {
    return Fail(absl::InternalError(
        absl::StrCat("the server acknowledged sequence ", ack.sequence(), ", which was not sent")));
  }
  failures_ = 0;
  DropAcknowledged(ack.sequence(), /*recovered=*/false);
  v1::PointCounts& counts = totals_.counts;
  counts.set_received(counts.received() + ack.counts().received());
  counts.set_outside(counts.outside() + ack.counts().outside());
  counts.set_duplicate(counts.duplicate() + ack.counts().duplicate());
  counts.set_inside(counts.inside() + ack.counts().inside());
  totals_.last_ack = ack;
  totals_.hull_revision = ack.hull_revision();
  totals_.vertex_count = ack.vertex_count();
  return absl::OkStatus();
}

void Appender::DropAcknowledged(uint64_t sequence, bool recovered) {
  while (!unacknowledged_.empty() &&
         unacknowledged_.front().request->chunk().sequence() <= sequence) {
    const Chunk& chunk = unacknowledged_.front();
    bytes_in_flight_ -= chunk.bytes;
    totals_.points_acknowledged += chunk.points;
    if (recovered) ++totals_.chunks_recovered;
    if (written_ > 0) --written_;
    unacknowledged_.pop_front();
  }
}

absl::Status Appender::Finish() {
  if (!failed_.ok()) return failed_;
  HULLD_RETURN_IF_ERROR(PumpUntil(0, 0));
  const Deadline deadline = std::chrono::steady_clock::now() + timeout_;
  if (!connection_->ended()) connection_->WritesDone();
  while (!connection_->ended()) {
    v1::AppendPointsResponse ignored;
    if (!connection_->TakeResponse(&ignored) && !connection_->WaitForEvent(false, deadline)) break;
  }
  // Everything is acknowledged, so it does not matter if the server did not end the stream properly
  // because it was draining or lost.
  absl::Status status = connection_->ended() ? EndOf(connection_.get()) : absl::OkStatus();
  connection_ = nullptr;
  failed_ = absl::FailedPreconditionError("the append stream is finished");
  return absl::IsUnavailable(status) ? absl::OkStatus() : status;
}

}  // namespace hulld
