#include "server/collisions/scene_stream.h"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <chrono>
#include <set>
#include <utility>

#include "server/collisions/query_settings.h"
#include "server/contract/error_info.h"
#include "server/contract/status_map.h"
#include "server/settings/config.h"
#include "server/wire/answer_columns.h"

namespace hulld::server {
namespace {

// How many messages may wait for the client, and how long for the next of them to leave.
constexpr size_t kMostWaiting = 32;
constexpr std::chrono::seconds kMostPatience(5);
// How long a search may wait for its client in all: meanwhile it holds the executor.
constexpr std::chrono::seconds kMostPatienceInAll(20);
// Two indices of a pair, as varints.
constexpr size_t kPairBytes = 10;

// INVALID_ARGUMENT: groups that do not fit the placements.
absl::Status ValidateGroups(const v1::FindCollisionsRequest& request, size_t placements) {
  if (!request.groups().empty() && static_cast<size_t>(request.groups_size()) != placements) {
    return absl::InvalidArgumentError(absl::StrCat("groups holds ", request.groups_size(),
                                                   " groups for ", placements,
                                                   " placements; give one for each or none"));
  }
  if (request.ignored_group_pairs_size() % 2 != 0) {
    return absl::InvalidArgumentError(absl::StrCat("ignored_group_pairs holds ",
                                                   request.ignored_group_pairs_size(),
                                                   " groups; each pair needs two"));
  }
  if (request.groups().empty() &&
      (request.ignore_same_group() || !request.ignored_group_pairs().empty())) {
    return absl::InvalidArgumentError(
        absl::StrCat(request.ignore_same_group() ? "ignore_same_group" : "ignored_group_pairs",
                     " needs groups; give one for each placement"));
  }
  if (request.movers() > placements) {
    return absl::InvalidArgumentError(
        absl::StrCat("movers is ", request.movers(), ", but placements holds ", placements));
  }
  return absl::OkStatus();
}

std::vector<GroupPair> IgnoredGroups(const v1::FindCollisionsRequest& request) {
  std::vector<GroupPair> ignored;
  for (int i = 0; i < request.ignored_group_pairs_size(); i += 2) {
    ignored.push_back({request.ignored_group_pairs(i), request.ignored_group_pairs(i + 1)});
  }
  if (request.ignore_same_group()) {
    const std::set<uint32_t> groups(request.groups().begin(), request.groups().end());
    for (const uint32_t group : groups) ignored.push_back({group, group});
  }
  return ignored;
}

}  // namespace

grpc::ServerWriteReactor<v1::FindCollisionsResponse>* SceneStream::Start(
    grpc::CallbackServerContext& context, Admission& admission, Registry& registry,
    WorkerPool& readers, Executor& executor, const v1::FindCollisionsRequest& request) {
  const std::shared_ptr<SceneStream> stream(
      new SceneStream(context, admission, registry, executor, request));
  stream->self_ = stream;
  const absl::Status begun = stream->call_.Begin();
  if (!begun.ok()) {
    stream->Finish(stream->call_.End(begun));
    return stream.get();
  }
  readers.Submit([stream] {
    const absl::Status opened = stream->Open();
    if (!opened.ok()) return stream->End(opened);
    stream->executor_.Submit([stream] { stream->End(stream->Search()); });
  });
  return stream.get();
}

// Validates the request and resolves its hulls.
absl::Status SceneStream::Open() {
  absl::StatusOr<QueryOptions> options =
      MakeQueryOptions(v1::METHOD_UNSPECIFIED, request_.wanted(), request_.tolerance(),
                       registry_.limits(), call_.lifetime());
  if (!options.ok()) return options.status();
  absl::StatusOr<PlacementTable> table =
      PlacementTable::Make(request_.placements(), request_.packed_placements(), call_.caller(),
                           registry_.limits().max_placements, "the scene");
  if (!table.ok()) return table.status();
  table_ = *std::move(table);
  if (absl::Status s = ValidateGroups(request_, table_.size()); !s.ok()) return s;
  ignored_groups_ = IgnoredGroups(request_);
  options_.ignored_groups = ignored_groups_;
  options_.groups = {request_.groups().data(), static_cast<size_t>(request_.groups_size())};
  if (request_.has_movers()) options_.movers = request_.movers();
  patience_left_ = kMostPatienceInAll;
  options_.query = *std::move(options);
  options_.query.should_stop = [this] {
    Executor::GiveWay();
    return call_.ShouldStop() || too_slow_;
  };
  options_.threads = executor_.threads();
  if (absl::Status s = table_.Resolve(registry_, options_.query.should_stop); !s.ok()) return s;
  QueueHead();
  return absl::OkStatus();
}

// Without waiting for the client: this is a reader's thread.
void SceneStream::QueueHead() {
  const std::lock_guard lock(mutex_);
  table_.EncodeHeader(registry_.store(), filling_.mutable_header());
  size_t next = 0;
  do {
    next =
        table_.EncodeHulls(next, filling_.mutable_hulls(), filling_.mutable_placement_problems());
    ready_.push_back(std::exchange(filling_, {}));
  } while (next < table_.table_rows());
  Proceed();
}

absl::Status SceneStream::Search() {
  if (call_.ShouldStop()) return call_.StopStatus();
  const absl::StatusOr<SceneTotals> searched = hulld::FindCollisions(
      table_.placed(), options_, [this](std::span<const SceneAnswer> answers) { Take(answers); });
  if (too_slow_) {
    return WithReason(
        absl::ResourceExhaustedError(absl::StrCat(
            "the client reads too slowly: the search waited for it for ", kMostPatience.count(),
            " s at once or ", kMostPatienceInAll.count(), " s in all while ", kMostWaiting,
            " MiB were ready; read faster or ask for less")),
        v1::ERROR_REASON_CLIENT_TOO_SLOW);
  }
  if (!searched.ok()) return searched.status();
  call_.AddPairs(searched->pairs);
  call_.metrics().CountPairs({searched->by_rung});
  totals_.set_pairs(searched->pairs);
  totals_.set_candidates(searched->candidates);
  *filling_.mutable_totals() = totals_;
  Send();
  return absl::OkStatus();
}

void SceneStream::Take(std::span<const SceneAnswer> answers) {
  for (const SceneAnswer& found : answers) {
    if (filling_bytes_ >= Config::kReplyMessageBytes) Send();
    if (too_slow_) return;
    const auto& [a, b] = found.pair;
    const auto position = static_cast<uint64_t>(filling_.pairs_size()) / 2;
    filling_.add_pairs(a);
    filling_.add_pairs(b);
    filling_bytes_ +=
        kPairBytes + AddAnswer(found.answer, table_.placed()[a].hull(), table_.placed()[b].hull(),
                               request_.wanted(), filling_.mutable_columns());
    Count(filling_.columns().relations(static_cast<int>(position)));
  }
  // What was found goes out as soon as nothing is before it.
  if (IsIdle() && filling_.pairs_size() > 0) Send();
}

void SceneStream::Count(v1::Relation relation) {
  switch (relation) {
    case v1::RELATION_SEPARATED:
      return totals_.set_separated(totals_.separated() + 1);
    case v1::RELATION_TOUCHING:
      return totals_.set_touching(totals_.touching() + 1);
    case v1::RELATION_OVERLAPPING:
      return totals_.set_overlapping(totals_.overlapping() + 1);
    case v1::RELATION_WITHIN_TOLERANCE:
      return totals_.set_within_tolerance(totals_.within_tolerance() + 1);
    default:
      return totals_.set_failed(totals_.failed() + 1);
  }
}

bool SceneStream::IsIdle() {
  const std::lock_guard lock(mutex_);
  return !writing_;
}

// Queues what was filled; waits while too much is queued.
void SceneStream::Send() {
  std::unique_lock lock(mutex_);
  const auto start = std::chrono::steady_clock::now();
  const auto patience =
      std::min<std::chrono::steady_clock::duration>(kMostPatience, patience_left_);
  const bool room = sent_.wait_for(lock, patience, [this] {
    return ready_.size() < kMostWaiting || end_.has_value() || call_.ShouldStop();
  });
  patience_left_ -= std::chrono::steady_clock::now() - start;
  if (!room) too_slow_ = true;
  ready_.push_back(std::exchange(filling_, {}));
  filling_bytes_ = 0;
  Proceed();
}

void SceneStream::End(const absl::Status& status) {
  const std::lock_guard lock(mutex_);
  searching_ = false;
  if (!end_.has_value()) end_ = call_.ShouldStop() ? call_.StopStatus() : status;
  // After an error nobody waits for the rest.
  if (!end_->ok()) ready_.clear();
  Proceed();
}

void SceneStream::OnWriteDone(bool ok) {
  const std::shared_ptr<SceneStream> self = shared_from_this();
  const std::lock_guard lock(mutex_);
  writing_ = false;
  if (!ok) {
    call_.Cancel();
    ready_.clear();
    if (!end_.has_value()) end_ = call_.StopStatus();
  }
  sent_.notify_all();
  Proceed();
}

void SceneStream::OnCancel() {
  const std::lock_guard lock(mutex_);
  call_.Cancel();
  sent_.notify_all();
}

void SceneStream::Proceed() {
  if (finished_) return;
  if (!writing_ && !ready_.empty()) {
    writing_ = true;
    in_flight_ = std::move(ready_.front());
    ready_.pop_front();
    StartWrite(&in_flight_);
  }
  if (!end_.has_value() || writing_ || searching_) return;
  finished_ = true;
  Finish(call_.End(*end_));
}

}  // namespace hulld::server
