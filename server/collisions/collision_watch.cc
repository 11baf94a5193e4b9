#include <absl/status/status.h>
#include <absl/strings/str_cat.h>
#include <grpcpp/grpcpp.h>

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <optional>
#include <utility>
#include <vector>

#include "core/base/status_macros.h"
#include "core/query/collision.h"
#include "hulld/v1/collision.pb.h"
#include "server/call/call_stream.h"
#include "server/call/service_parts.h"
#include "server/collisions/collision_service.h"
#include "server/collisions/placed/live_pairs.h"
#include "server/collisions/placed/placed_answer.h"
#include "server/collisions/placed/placement_table.h"
#include "server/collisions/placed/query_settings.h"
#include "server/collisions/watched_hulls.h"
#include "server/contract/errors.h"
#include "server/process/task_pool.h"
#include "server/settings/config.h"
#include "server/wire/encode.h"

namespace hulld::server {
namespace {

// Pairs between two reads of the clock.
constexpr size_t kWatchedPairsPerPoll = 16;
// Rounds per watch, over which preparation pays off; a guess.
constexpr uint64_t kExpectedRounds = 256;
// Tag and length of an entry within its message.
constexpr size_t kEntryHeaderBytes = 4;

bool IsContact(v1::Relation relation) {
  return relation == v1::RELATION_TOUCHING || relation == v1::RELATION_OVERLAPPING;
}

// Returns the kind of the pair's event; UNSPECIFIED if the pair is unchanged.
v1::CollisionEventKind KindOf(const LivePair& before, v1::Relation relation, bool is_within) {
  if (IsContact(relation)) {
    if (relation == before.relation) return v1::COLLISION_EVENT_KIND_UNSPECIFIED;
    return relation == v1::RELATION_OVERLAPPING ? v1::COLLISION_EVENT_KIND_ENTER
                                                : v1::COLLISION_EVENT_KIND_TOUCH;
  }
  if (IsContact(before.relation)) return v1::COLLISION_EVENT_KIND_EXIT;
  if (is_within == before.is_within_clearance) return v1::COLLISION_EVENT_KIND_UNSPECIFIED;
  return is_within ? v1::COLLISION_EVENT_KIND_NEAR : v1::COLLISION_EVENT_KIND_FAR;
}

// A WatchCollisions call, which works in rounds. A round processes one message of the client, or
// the pending changes of hulls and bodies, answers the affected pairs again, and sends an event for
// each pair whose answer differs. A round starts after the replies of the previous one are written.
// Until then, messages wait in gRPC's window and changes coalesce in the feed, so a slow client
// costs the memory of a single message.
//
// The mutex guards which task is running. The data of a round belongs to that task alone.
class CollisionWatch : public ReadingStream<QueuedStream<BidiReactor, v1::WatchCollisionsResponse>,
                                            v1::WatchCollisionsRequest> {
 public:
  CollisionWatch(CallContext& context, const ServiceParts& parts)
      : ReadingStream(context, parts.admission, Rpc::kWatchCollisions),
        parts_(parts),
        lane_(parts.pool),
        hulls_(parts.registry),
        charge_(parts.registry.memory(), MemoryUse::kReading) {}

 private:
  void OnDone() override {
    const auto self = shared_from_this();
    ReadingStream::OnDone();
    hulls_.Close();
  }

  // The functions below require the mutex.
  void StartWork() override {
    if (!reading() && !has_message_ && !has_half_closed_) Read();
    if (is_working_ || unsent_bytes() > 0) return;
    const auto work = [this](auto& pool, void (CollisionWatch::*step)()) {
      is_working_ = true;
      RunOn(pool, [this, step] { (this->*step)(); });
    };
    if (is_sending_) return work(lane_, &CollisionWatch::SendRound);
    if (has_message_) {
      // The first message resolves all hulls.
      if (!is_open_) return work(parts_.long_readers, &CollisionWatch::TakeMessage);
      const bool is_short = request().update().placements_size() <= kMaxShortUpdate;
      if (is_short) return work(parts_.pool, &CollisionWatch::TakeMessage);
      return work(lane_, &CollisionWatch::TakeMessage);
    }
    if (has_half_closed_) return End(OrStopped(absl::OkStatus()));
    if (!std::exchange(has_changes_, false)) return;
    work(parts_.readers, &CollisionWatch::TakeChanges);
  }

  bool IsWorking() const override { return is_working_; }
  void OnMessage() override {
    call().BeginMessage();
    has_message_ = true;
  }

  void OnNoMessage(const absl::Status& why) override {
    if (!why.ok()) return End(OrStopped(why));
    has_half_closed_ = true;
  }

  // The following run as the only task.
  void TakeMessage() {
    const absl::Status status = HandleMessage();
    if (!status.ok()) return EndWork(status);
    request().Clear();
    answers_message_ = true;
    SendRound();
  }

  absl::Status HandleMessage() {
    HULLD_RETURN_IF_ERROR(
        CheckOrder(request(), is_open_,
                   "open was sent twice; start a new watch for other placements or pairs"));
    if (request().has_open()) return Prefixed("open: ", HandleOpen(*request().mutable_open()));
    ++messages_;
    return Prefixed(absl::StrCat("update ", messages_, ": "), HandleUpdate(request().update()));
  }

  absl::Status HandleOpen(v1::CollisionWatchOpen& open) {
    // Also rejects NaN.
    if (open.has_clearance() && !(open.clearance() >= 0)) {
      return InvalidArgument("clearance is ", open.clearance(),
                             "; it must be a length of at least 0");
    }
    v1::Wanted wanted;
    if (open.has_clearance()) wanted.set_clearance(open.clearance());
    const Limits& limits = parts_.registry.limits();
    HULLD_ASSIGN_OR_RETURN(
        options_, MakeQueryOptions(v1::METHOD_UNSPECIFIED, wanted, 0, limits, call().lifetime()));
    HULLD_RETURN_IF_ERROR(CheckNoMotions(open.placements(), open.packed_placements(), "a watch"));
    HULLD_ASSIGN_OR_RETURN(
        table_, PlacementTable::Make(open.placements(), *open.mutable_packed_placements(),
                                     call().caller(), limits.max_placements, "the watch"));
    const bool has_groups = open.groups_size() > 0 || open.ignored_group_pairs_size() > 0 ||
                            open.ignore_same_group() || open.has_movers();
    if (open.pairs_size() > 0 && has_groups) {
      return InvalidArgument(
          "pairs cannot be combined with groups or movers; list the pairs, or filter all pairs");
    }
    HULLD_RETURN_IF_ERROR(
        ValidatePairs(open.pairs(), table_.size(), limits.max_pairs_per_batch, "the watch"));
    HULLD_RETURN_IF_ERROR(ValidateGroups(open, table_.size()));
    table_.SortByHull();
    pairs_ = LivePairs(open, table_.size(), limits.max_pairs_per_batch);
    charge_.Set(table_.MemoryBytes() + pairs_.MemoryBytes());

    // Preparation pays off, because each hull is queried repeatedly.
    const uint64_t per_hull = 2 * table_.size() / std::max<size_t>(1, table_.hull_ids().size());
    const auto on_ready = [this, self = shared_from_this()] {
      Locked([this] { has_changes_ = true; });
    };
    HULLD_ASSIGN_OR_RETURN(
        WatchedHulls::Round round,
        hulls_.Open(table_.hull_ids(), on_ready,
                    table_.LookupFor(options_, {kExpectedRounds * per_hull, true}),
                    call().should_stop()));
    Locked([this] { has_changes_ = true; });
    table_.SetHulls(parts_.store, std::move(round.resolved), options_);
    revision_ = round.revision;
    new_piece_hulls_ = std::move(round.piece_hulls);
    for (const size_t k : round.places) {
      if (table_.hull(k).ok()) new_hulls_.push_back(k);
    }
    std::vector<uint32_t> all(table_.size());
    std::iota(all.begin(), all.end(), 0);
    for (const uint32_t i : all) {
      if (!table_.is_answerable(i)) new_problems_.push_back(i);
    }
    is_open_ = true;
    return BeginRound(all);
  }

  absl::Status HandleUpdate(const v1::CollisionWatchUpdate& update) {
    HULLD_RETURN_IF_ERROR(ValidateMoves(update.placements(), update.poses(), table_.size()));
    const std::vector<uint32_t> changed(update.placements().begin(), update.placements().end());
    for (size_t i = 0; i < changed.size(); ++i) {
      const uint32_t placement = changed[i];
      const absl::Status before = table_.problem(placement);
      table_.Move(placement, ReadPose(update.poses(), i));
      // The placement may also lack a hull.
      const absl::Status& now = table_.problem(placement);
      if (!now.ok() && now != before) new_problems_.push_back(placement);
    }
    return BeginRound(changed);
  }

  void TakeChanges() {
    absl::StatusOr<WatchedHulls::Round> round = hulls_.TakeChanges(call().should_stop());
    if (!round.ok()) return EndWork(round.status());
    if (round->waits) return EndWork(absl::OkStatus());
    // More changes may be pending.
    Locked([this] { has_changes_ = true; });
    const absl::Status status = HandleChanges(*std::move(round));
    if (!status.ok()) return EndWork(status);
    if (!is_sending_) return EndWork(absl::OkStatus());
    answers_message_ = false;
    SendRound();
  }

  absl::Status HandleChanges(WatchedHulls::Round round) {
    if (round.places.empty() && !round.has_advanced) return absl::OkStatus();
    revision_ = round.revision;
    new_piece_hulls_ = std::move(round.piece_hulls);
    if (!round.places.empty()) {
      table_.SetSomeHulls(round.places, std::move(round.resolved), options_);
    }
    std::vector<uint32_t> changed;
    for (const size_t k : round.places) {
      const std::span<const uint32_t> placements = table_.placements_of(k);
      if (placements.empty()) continue;
      if (table_.query_hull_changed(placements.front())) {
        for (const uint32_t i : placements) pairs_.ForgetPoints(i);
      }
      if (!table_.hull_changed(placements.front())) continue;
      const bool is_there = table_.hull(k).ok();
      if (is_there) new_hulls_.push_back(k);
      for (const uint32_t i : placements) {
        changed.push_back(i);
        if (!is_there) new_problems_.push_back(i);
      }
    }
    // Without a changed placement, the round only sends the new revision.
    return BeginRound(changed);
  }

  absl::Status BeginRound(const std::vector<uint32_t>& changed) {
    HULLD_RETURN_IF_ERROR(pairs_.Select(changed, table_));
    charge_.Set(table_.MemoryBytes() + pairs_.MemoryBytes() + hulls_.MemoryBytes());
    HULLD_RETURN_IF_ERROR(parts_.registry.CheckMemory(MemoryUse::kReading));
    call().AddPairs(pairs_.selected().size());
    next_hull_ = next_piece_hull_ = next_problem_ = next_pair_ = 0;
    is_sending_ = true;
    return absl::OkStatus();
  }

  // Answers pairs and adds events until the round is complete, the message is full, or the time
  // slice ends.
  void SendRound() {
    const auto end = std::chrono::steady_clock::now() + TaskPool::kSliceTime;
    bool is_full = !AddHulls();
    const std::span<const uint32_t> selected = pairs_.selected();
    while (!is_full && next_pair_ < selected.size()) {
      const absl::Status status = AnswerPair(pairs_.pair(selected[next_pair_++]));
      if (!status.ok()) return EndWork(status);
      is_full = reply_bytes_ >= Config::kReplyMessageBytes;
      if (!table_.has_bodies() && next_pair_ % kWatchedPairsPerPoll != 0) continue;
      if (call().ShouldStop()) return EndWork(call().StopStatus());
      if (std::chrono::steady_clock::now() >= end) return RunOn(lane_, [this] { SendRound(); });
    }
    call().metrics().CountPairs(std::exchange(rungs_, {}));
    const bool is_complete = !is_full;
    if (is_complete) {
      pairs_.EndRound();
      new_hulls_.clear();
      new_piece_hulls_.clear();
      new_problems_.clear();
      if (answers_message_) call().EndMessage();
    }
    EncodeHeader(parts_.store, revision_, reply_.mutable_header());
    reply_.set_update(messages_);
    reply_.set_synced(is_complete);
    Locked([&] {
      is_working_ = false;
      is_sending_ = !is_complete;
      if (is_complete && answers_message_) has_message_ = false;
      const size_t bytes = std::exchange(reply_bytes_, 0) + 1;
      Queue(std::exchange(reply_, {}), bytes);
    });
  }

  // Adds new hulls and problems to the reply. Returns false if the message is full before all are
  // added.
  bool AddHulls() {
    while (next_hull_ < new_hulls_.size() || next_piece_hull_ < new_piece_hulls_.size() ||
           next_problem_ < new_problems_.size()) {
      if (reply_bytes_ >= Config::kReplyMessageBytes) return false;
      const google::protobuf::Message* entry = nullptr;
      if (next_hull_ < new_hulls_.size()) {
        table_.EncodeHull(new_hulls_[next_hull_++], reply_.add_hulls());
        entry = &*reply_.hulls().rbegin();
      } else if (next_piece_hull_ < new_piece_hulls_.size()) {
        EncodeVersion(parts_.store, new_piece_hulls_[next_piece_hull_++], reply_.add_piece_hulls());
        entry = &*reply_.piece_hulls().rbegin();
      } else {
        table_.EncodeProblem(new_problems_[next_problem_++], reply_.add_placement_problems());
        entry = &*reply_.placement_problems().rbegin();
      }
      reply_bytes_ += kEntryHeaderBytes + entry->ByteSizeLong();
    }
    return true;
  }

  absl::Status AnswerPair(LivePair& pair) {
    if (!table_.is_answerable(pair.a) || !table_.is_answerable(pair.b)) {
      if (pair.is_reported()) AddEvent(v1::COLLISION_EVENT_KIND_LOST, pair, std::nullopt);
      pair.relation = v1::RELATION_SEPARATED;
      pair.is_within_clearance = false;
      return absl::OkStatus();
    }
    const PlacedAnswer found = QueryAtRest(table_, pair.a, pair.b, options_, &pair.cache);
    const absl::StatusOr<Answer>& answer = found.answer;
    if (!answer.ok()) return answer.status();
    rungs_.Add(answer->rung);
    const v1::Relation relation = EncodeRelation(answer->relation);
    const bool is_within = answer->within_clearance.value_or(false);
    const v1::CollisionEventKind kind = KindOf(pair, relation, is_within);
    pair.relation = relation;
    pair.is_within_clearance = is_within;
    if (kind != v1::COLLISION_EVENT_KIND_UNSPECIFIED) AddEvent(kind, pair, found.of_body.pieces);
    return absl::OkStatus();
  }

  void AddEvent(v1::CollisionEventKind kind, const LivePair& pair,
                const std::optional<PiecePair>& pieces) {
    v1::CollisionEvent* const event = reply_.add_events();
    event->set_kind(kind);
    event->set_placement_a(pair.a);
    event->set_placement_b(pair.b);
    if (kind != v1::COLLISION_EVENT_KIND_LOST) {
      event->set_relation(pair.relation);
      event->set_revision_a(table_.hull(*table_.hull_of(pair.a))->record.revision);
      event->set_revision_b(table_.hull(*table_.hull_of(pair.b))->record.revision);
      if (pieces) table_.EncodeDecidingPieces(pair.a, pair.b, *pieces, event);
      if (options_.clearance.has_value()) event->set_within_clearance(pair.is_within_clearance);
    }
    reply_bytes_ += kEntryHeaderBytes + event->ByteSizeLong();
  }

  // Ends the task, and the call if `error` is not OK.
  void EndWork(const absl::Status& error) {
    Locked([&] {
      is_working_ = false;
      if (!error.ok()) End(OrStopped(error));
    });
  }

  const ServiceParts& parts_;
  TaskPool::Lane lane_;

  // Guarded by the mutex.
  bool is_working_ = false;
  // True if a message was read and waits for its round.
  bool has_message_ = false;
  bool has_half_closed_ = false;
  // True if the feed may have changes.
  bool has_changes_ = false;

  // The following belong to the task.
  WatchedHulls hulls_;
  // Covers placements and pairs.
  MemoryCharge charge_;
  bool is_open_ = false;
  QueryOptions options_;
  PlacementTable table_;
  LivePairs pairs_;
  uint64_t messages_ = 0;
  // Every change of a hull up to this revision is included.
  uint64_t revision_ = 0;

  // The current round, and the next of its hulls, problems and pairs to send.
  bool is_sending_ = false;
  bool answers_message_ = false;
  std::vector<size_t> new_hulls_;
  std::vector<HullRecord> new_piece_hulls_;
  std::vector<uint32_t> new_problems_;
  size_t next_hull_ = 0;
  size_t next_piece_hull_ = 0;
  size_t next_problem_ = 0;
  size_t next_pair_ = 0;
  RungCounts rungs_;
  v1::WatchCollisionsResponse reply_;
  // Estimated size of the reply.
  size_t reply_bytes_ = 0;
};

}  // namespace

BidiReactor* StartCollisionWatch(CallContext& context, const ServiceParts& parts) {
  return CollisionWatch::Launch(std::make_shared<CollisionWatch>(context, parts));
}

}  // namespace hulld::server
