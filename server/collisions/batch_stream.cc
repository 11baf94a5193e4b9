#include "server/collisions/batch_stream.h"

#include <absl/status/status.h>

#include <algorithm>
#include <chrono>
#include <utility>

#include "server/collisions/query_settings.h"
#include "server/contract/status_map.h"
#include "server/wire/batch_columns.h"

namespace hulld::server {
namespace {

// Slices grow and shrink so that each takes about this long: short enough for batches to take turns
// and for answers to stream, long enough to hide the cost of opening a parallel region.
constexpr std::chrono::milliseconds kSliceTime(40);
constexpr size_t kFirstSlicePairs = 128;
constexpr size_t kMostSlicePairs = 1 << 16;
// Core hands out pairs to threads in pieces of 16.
constexpr size_t kLeastSlicePairsPerThread = 16;
// Projections of one slice under TEXTBOOK_SAT, whose cost can be foretold. A pair above it makes a
// slice of its own, parallel over its axes.
constexpr double kSliceProjections = 3e7;

double TextbookProjections(const Hull& a, const Hull& b) {
  const double axes = static_cast<double>(a.edges().size()) * static_cast<double>(b.edges().size());
  return axes * static_cast<double>(a.vertices().size() + b.vertices().size());
}

}  // namespace

grpc::ServerWriteReactor<v1::BatchCheckCollisionsResponse>* BatchStream::Start(
    grpc::CallbackServerContext& context, Admission& admission, Registry& registry,
    WorkerPool& readers, Executor& executor, const v1::BatchCheckCollisionsRequest& request) {
  const std::shared_ptr<BatchStream> stream(
      new BatchStream(context, admission, registry, executor, request));
  stream->self_ = stream;
  const absl::Status begun = stream->call_.Begin();
  if (begun.ok()) {
    readers.Submit([stream] { stream->Open(); });
  } else {
    stream->Finish(stream->call_.End(begun));
  }
  return stream.get();
}

absl::Status BatchStream::Validate() {
  absl::StatusOr<QueryOptions> options =
      MakeQueryOptions(request_.method(), request_.wanted(), request_.tolerance(),
                       registry_.limits(), call_.lifetime());
  if (!options.ok()) return options.status();
  options_ = *std::move(options);
  options_.should_stop = [this] {
    Executor::GiveWay();
    return call_.ShouldStop();
  };
  absl::StatusOr<PlacementTable> table =
      PlacementTable::Make(request_.placements(), request_.packed_placements(), call_.caller(),
                           registry_.limits().max_placements, "the batch");
  if (!table.ok()) return table.status();
  table_ = *std::move(table);
  call_.AddPairs(pair_count());
  return ValidatePairs(request_.pairs(), table_.size(), registry_.limits().max_pairs_per_batch,
                       "the batch");
}

void BatchStream::QueueHead() {
  table_.EncodeHeader(registry_.store(), head_.mutable_header());
  size_t next = 0;
  while ((next = table_.EncodeHulls(next, head_.mutable_hulls(),
                                    head_.mutable_placement_problems())) < table_.table_rows()) {
    ready_.push_back(std::exchange(head_, {}));
  }
}

void BatchStream::Open() {
  absl::Status status = Validate();
  if (status.ok()) status = table_.Resolve(registry_, options_.should_stop);
  if (call_.ShouldStop()) status = call_.StopStatus();
  const std::lock_guard lock(mutex_);
  computing_ = false;
  slice_pairs_ = kFirstSlicePairs;
  if (!status.ok()) {
    end_ = status;
  } else {
    QueueHead();
    if (pair_count() == 0) {
      ready_.push_back(std::move(head_));
      end_ = absl::OkStatus();
    }
  }
  Proceed();
}

PlacedPair BatchStream::PairAt(size_t i) const {
  return {request_.pairs(static_cast<int>(2 * i)), request_.pairs(static_cast<int>(2 * i + 1))};
}

bool BatchStream::IsAnswerable(const PlacedPair& pair) const {
  return table_.is_answerable(pair.a) && table_.is_answerable(pair.b);
}

// Where the slice that starts at next_pair_ ends.
size_t BatchStream::SliceEnd() const {
  const size_t most = std::min(pair_count(), next_pair_ + slice_pairs_);
  if (options_.method != Method::kTextbookSat) return most;
  double projections = 0;
  for (size_t i = next_pair_; i < most; ++i) {
    const PlacedPair pair = PairAt(i);
    projections +=
        TextbookProjections(table_.placed()[pair.a].hull(), table_.placed()[pair.b].hull());
    if (projections > kSliceProjections) return std::max(i, next_pair_ + 1);
  }
  return most;
}

std::vector<absl::StatusOr<Answer>> BatchStream::AnswerPairs(
    const std::vector<PlacedPair>& pairs) const {
  if (pairs.size() != 1) {
    return CheckCollisions(table_.placed(), pairs, options_, executor_.threads());
  }
  QueryOptions options = options_;
  options.threads = executor_.threads();
  std::vector<absl::StatusOr<Answer>> answers;
  answers.push_back(
      CheckCollision(table_.placed()[pairs[0].a], table_.placed()[pairs[0].b], options));
  return answers;
}

absl::Status BatchStream::ComputeSlice() {
  const size_t begin = next_pair_;
  const size_t end = SliceEnd();
  std::vector<PlacedPair> pairs;
  pairs.reserve(end - begin);
  for (size_t i = begin; i < end; ++i) {
    if (IsAnswerable(PairAt(i))) pairs.push_back(PairAt(i));
  }
  const auto start = std::chrono::steady_clock::now();
  const std::vector<absl::StatusOr<Answer>> answers = AnswerPairs(pairs);
  if (call_.ShouldStop()) return call_.StopStatus();
  AdaptSlice(end - begin, std::chrono::steady_clock::now() - start);

  BatchColumns columns(std::move(head_), request_.wanted(), begin);
  head_.Clear();
  size_t answered = 0;
  RungCounts counts;
  for (size_t i = begin; i < end; ++i) {
    const PlacedPair pair = PairAt(i);
    if (!IsAnswerable(pair)) {
      columns.AddUnanswered();
      continue;
    }
    const absl::StatusOr<Answer>& answer = answers[answered++];
    const Hull& a = table_.placed()[pair.a].hull();
    const Hull& b = table_.placed()[pair.b].hull();
    if (answer.ok()) {
      counts.Add(answer->rung);
      columns.Add(answer, a, b);
    } else {
      const absl::Status status = NameQueryLimit(answer.status());
      call_.CountLimit(status);
      columns.Add(status, a, b);
    }
  }
  call_.metrics().CountPairs(counts);
  Send(columns, end);
  return absl::OkStatus();
}

// Queues what answers the pairs up to `end`.
void BatchStream::Send(BatchColumns& columns, size_t end) {
  next_pair_ = end;
  const std::lock_guard lock(mutex_);
  for (v1::BatchCheckCollisionsResponse& message : columns.Take()) {
    ready_.push_back(std::move(message));
  }
}

void BatchStream::AdaptSlice(size_t pairs, std::chrono::steady_clock::duration elapsed) {
  const double factor = std::chrono::duration<double>(kSliceTime) / elapsed;
  const double wished = static_cast<double>(pairs) * std::min(factor, 4.0);
  const size_t least = kLeastSlicePairsPerThread * executor_.threads();
  slice_pairs_ = std::max(least, static_cast<size_t>(std::min<double>(wished, kMostSlicePairs)));
}

void BatchStream::OnWriteDone(bool ok) {
  const std::shared_ptr<BatchStream> self = shared_from_this();
  const std::lock_guard lock(mutex_);
  writing_ = false;
  if (!ok) {
    call_.Cancel();
    ready_.clear();
    if (!end_.has_value()) end_ = call_.StopStatus();
  }
  Proceed();
}

void BatchStream::Proceed() {
  if (finished_) return;
  if (!writing_ && !ready_.empty()) {
    writing_ = true;
    in_flight_ = std::move(ready_.front());
    ready_.pop_front();
    StartWrite(&in_flight_);
  }
  if (end_.has_value()) {
    if (writing_ || computing_) return;
    finished_ = true;
    Finish(call_.End(*end_));
    return;
  }
  if (computing_ || !ready_.empty()) return;
  computing_ = true;
  executor_.Submit([self = shared_from_this()] {
    const absl::Status status =
        self->call_.ShouldStop() ? self->call_.StopStatus() : self->ComputeSlice();
    const std::lock_guard lock(self->mutex_);
    self->computing_ = false;
    if (self->end_.has_value()) {
      // The client is gone.
    } else if (!status.ok() || self->next_pair_ == self->pair_count()) {
      self->end_ = status;
    }
    self->Proceed();
  });
}

}  // namespace hulld::server
