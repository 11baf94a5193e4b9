#include "server/batch_stream.h"

#include <absl/status/status.h>
#include <absl/strings/str_cat.h>

#include <algorithm>
#include <chrono>
#include <string>
#include <unordered_map>
#include <utility>

#include "server/batch_columns.h"
#include "server/decode.h"
#include "server/encode.h"
#include "server/hull_id.h"
#include "server/query_settings.h"
#include "server/status_map.h"

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

// Stands in for the hull of placements that cannot be answered.
const QueryHull& NoHull() {
  static const Hull empty;
  static const QueryHull no_hull(empty);
  return no_hull;
}

double TextbookProjections(const Hull& a, const Hull& b) {
  const double axes = static_cast<double>(a.edges().size()) * static_cast<double>(b.edges().size());
  return axes * static_cast<double>(a.vertices().size() + b.vertices().size());
}

}  // namespace

grpc::ServerWriteReactor<v1::BatchCheckCollisionsResponse>* BatchStream::Start(
    const grpc::CallbackServerContext& context, Admission& admission, Registry& registry,
    WorkerPool& readers, Executor& executor, const v1::BatchCheckCollisionsRequest& request) {
  const std::shared_ptr<BatchStream> stream(new BatchStream(context, registry, executor, request));
  stream->self_ = stream;
  absl::StatusOr<Admission::Ticket> ticket = admission.Admit();
  if (ticket.ok()) {
    stream->ticket_ = *std::move(ticket);
    readers.Submit([stream] { stream->Open(); });
  } else {
    stream->Finish(ToGrpc(ticket.status()));
  }
  return stream.get();
}

absl::Status BatchStream::Validate() {
  absl::StatusOr<QueryOptions> options =
      MakeQueryOptions(request_.method(), request_.wanted(), registry_.limits(), lifetime_);
  if (!options.ok()) return options.status();
  options_ = *std::move(options);
  if (request_.pairs_size() % 2 != 0) {
    return absl::InvalidArgumentError(
        absl::StrCat("pairs holds ", request_.pairs_size(), " indices; each pair needs two"));
  }
  const uint64_t most = registry_.limits().max_pairs_per_batch;
  if (pair_count() > most) {
    return absl::ResourceExhaustedError(absl::StrCat("the batch holds ", pair_count(),
                                                     " pairs; the limit is ", most,
                                                     " (--max-pairs-per-batch)"));
  }
  const auto placements = static_cast<uint32_t>(request_.placements_size());
  for (int i = 0; i < request_.pairs_size(); ++i) {
    if (request_.pairs(i) >= placements) {
      return absl::InvalidArgumentError(absl::StrCat("pairs[", i, "] is ", request_.pairs(i),
                                                     ", but placements holds ", placements,
                                                     "; indices start at 0"));
    }
  }
  return absl::OkStatus();
}

// Fills hulls_, placements_, answerable_ and head_.
absl::Status BatchStream::ResolvePlacements() {
  const int count = request_.placements_size();
  std::vector<absl::Status> problems(count);
  std::vector<size_t> hull_of(count);
  std::vector<std::string> ids;
  std::unordered_map<std::string, size_t> index_of;
  std::vector<Pose> poses(count);
  for (int i = 0; i < count; ++i) {
    const v1::Placement& placement = request_.placements(i);
    const std::string field = absl::StrCat("placements[", i, "]");
    problems[i] = ValidateHullId(placement.hull_id(), field + ".hull_id");
    if (!problems[i].ok()) continue;
    const absl::StatusOr<Pose> pose = DecodePose(placement.pose(), field + ".pose");
    problems[i] = pose.status();
    if (!problems[i].ok()) continue;
    poses[i] = *pose;
    const auto [known, is_new] = index_of.emplace(placement.hull_id(), ids.size());
    if (is_new) ids.push_back(placement.hull_id());
    hull_of[i] = known->second;
  }

  const absl::StatusOr<Resolved> resolved = registry_.Resolve(ids, options_.should_stop);
  if (!resolved.ok()) return resolved.status();
  EncodeHeader(registry_.store(), resolved->store_revision, head_.mutable_header());
  snapshots_.resize(ids.size());
  for (size_t i = 0; i < ids.size(); ++i) {
    if (resolved->hulls[i].ok()) snapshots_[i] = resolved->hulls[i]->snapshot;
  }
  answerable_.resize(count);
  for (int i = 0; i < count; ++i) {
    v1::HullVersion* version = head_.add_hulls();
    if (problems[i].ok()) problems[i] = resolved->hulls[hull_of[i]].status();
    if (problems[i].ok()) {
      answerable_[i] = true;
      placements_.push_back(*PlacedHull::Make(snapshots_[hull_of[i]]->query_hull(), poses[i]));
      EncodeVersion(resolved->hulls[hull_of[i]]->record, version);
      continue;
    }
    placements_.push_back(*PlacedHull::Make(NoHull(), Pose()));
    v1::PlacementProblem* problem = head_.add_placement_problems();
    problem->set_placement(i);
    problem->set_code(ToGrpc(problems[i].code()));
    problem->set_message(std::string(problems[i].message()));
  }
  return absl::OkStatus();
}

void BatchStream::Open() {
  absl::Status status = Validate();
  if (status.ok()) status = ResolvePlacements();
  if (lifetime_.ShouldStop()) status = lifetime_.StopStatus();
  const std::lock_guard lock(mutex_);
  computing_ = false;
  slice_pairs_ = kFirstSlicePairs;
  if (!status.ok()) {
    end_ = status;
  } else if (pair_count() == 0) {
    ready_.push_back(std::move(head_));
    end_ = absl::OkStatus();
  }
  Proceed();
}

PlacedPair BatchStream::PairAt(size_t i) const {
  return {request_.pairs(static_cast<int>(2 * i)), request_.pairs(static_cast<int>(2 * i + 1))};
}

bool BatchStream::IsAnswerable(const PlacedPair& pair) const {
  return answerable_[pair.a] && answerable_[pair.b];
}

// Where the slice that starts at next_pair_ ends.
size_t BatchStream::SliceEnd() const {
  const size_t most = std::min(pair_count(), next_pair_ + slice_pairs_);
  if (options_.method != Method::kTextbookSat) return most;
  double projections = 0;
  for (size_t i = next_pair_; i < most; ++i) {
    const PlacedPair pair = PairAt(i);
    projections += TextbookProjections(placements_[pair.a].hull(), placements_[pair.b].hull());
    if (projections > kSliceProjections) return std::max(i, next_pair_ + 1);
  }
  return most;
}

std::vector<absl::StatusOr<Answer>> BatchStream::AnswerPairs(
    const std::vector<PlacedPair>& pairs) const {
  if (pairs.size() != 1) {
    return CheckCollisions(placements_, pairs, options_, executor_.threads());
  }
  QueryOptions options = options_;
  options.threads = executor_.threads();
  std::vector<absl::StatusOr<Answer>> answers;
  answers.push_back(CheckCollision(placements_[pairs[0].a], placements_[pairs[0].b], options));
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
  if (lifetime_.ShouldStop()) return lifetime_.StopStatus();
  AdaptSlice(end - begin, std::chrono::steady_clock::now() - start);

  BatchColumns columns(std::move(head_), request_.wanted(), begin);
  head_.Clear();
  size_t answered = 0;
  for (size_t i = begin; i < end; ++i) {
    const PlacedPair pair = PairAt(i);
    if (!IsAnswerable(pair)) {
      columns.AddUnanswered();
      continue;
    }
    const absl::StatusOr<Answer>& answer = answers[answered++];
    const Hull& a = placements_[pair.a].hull();
    const Hull& b = placements_[pair.b].hull();
    if (answer.ok()) {
      columns.Add(answer, a, b);
    } else {
      columns.Add(NameQueryLimit(answer.status()), a, b);
    }
  }
  next_pair_ = end;
  const std::lock_guard lock(mutex_);
  for (v1::BatchCheckCollisionsResponse& message : columns.Take()) {
    ready_.push_back(std::move(message));
  }
  return absl::OkStatus();
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
    lifetime_.Cancel();
    ready_.clear();
    if (!end_.has_value()) end_ = lifetime_.StopStatus();
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
    Finish(ToGrpc(*end_));
    return;
  }
  if (computing_ || !ready_.empty()) return;
  computing_ = true;
  executor_.Submit([self = shared_from_this()] {
    const absl::Status status =
        self->lifetime_.ShouldStop() ? self->lifetime_.StopStatus() : self->ComputeSlice();
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
