#include <absl/status/status.h>
#include <absl/strings/str_cat.h>
#include <grpcpp/grpcpp.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "core/base/check.h"
#include "core/base/status_macros.h"
#include "core/query/collision.h"
#include "hulld/v1/collision.pb.h"
#include "server/call/call_stream.h"
#include "server/call/service_parts.h"
#include "server/collisions/claimed_range.h"
#include "server/collisions/collision_service.h"
#include "server/collisions/placed/live_pairs.h"
#include "server/collisions/placed/placed_answer.h"
#include "server/collisions/placed/placement_table.h"
#include "server/collisions/placed/query_settings.h"
#include "server/contract/errors.h"
#include "server/process/task_pool.h"
#include "server/wire/answer_columns.h"
#include "server/wire/decode.h"
#include "server/wire/encode.h"

namespace hulld::server {
namespace {

// Pairs between two reads of the clock.
constexpr size_t kPairsPerClaim = 16;
// An update that affects at most this many pairs is answered on arrival.
constexpr int kMaxQuickPairs = 8;
// Expected number of updates per stream: a guess, because streams are opened for many updates.
constexpr uint64_t kExpectedUpdates = 256;
// An index among the pairs, as a varint.
constexpr size_t kIndexBytes = 5;
// A relation and a rung.
constexpr size_t kRelationBytes = 2;
// Decided pairs to encode between two reads of the clock; they take about 20 us.
constexpr size_t kPairsPerClockRead = 4096;
// Pairs per helper thread. They take at least 20 us, about as long as a thread needs to arrive.
// **Observed**: close pairs of UR5 links.
constexpr size_t kPairsPerHelper = 192;

// A StreamCollisions call: reads a message, answers it, sends the answer, and only then reads the
// next message, so that a fast client fills gRPC's window rather than the server's memory. A quick
// message is answered on arrival, a message that resolves hulls on a reader thread, and any other
// on the pool. Long answers are computed in slices, which alternate with other calls, and sent in
// pieces. If only relations of hulls are wanted, other threads of the pool help with a step. They
// run slices, so they yield to other calls.
class CollisionStream
    : public ReadingStream<PulledStream<BidiReactor, v1::StreamCollisionsResponse>,
                           v1::StreamCollisionsRequest> {
 public:
  CollisionStream(CallContext& context, const ServiceParts& parts)
      : ReadingStream(context, parts.admission, Rpc::kStreamCollisions),
        parts_(parts),
        lane_(parts.pool),
        charge_(parts.registry.memory(), MemoryUse::kReading) {}

 private:
  // Result of a pair.
  struct Decided {
    // A v1::Relation; unspecified if a placement has a problem, which is reported elsewhere.
    uint8_t relation = 0;
    Rung rung = Rung::kBounds;
    // True if the previous answer differed.
    bool is_changed = false;
  };

  void Open() override { Read(); }
  void OnMessage() override {
    call().BeginMessage();
    if (IsQuick()) {
      parts_.pool.NoteSingleCall();
      return Handle();
    }
    // Resolving hulls may wait for the store; the first message resolves all of them.
    if (!open_) return RunOn(parts_.long_readers, [this] { Handle(); });
    if (request().update().refresh_hulls()) return RunOn(parts_.readers, [this] { Handle(); });
    // Only the first slice of a step runs ahead of batches.
    const bool is_short = request().update().placements_size() <= kMaxShortUpdate;
    if (is_short) return RunOn(parts_.pool, [this] { Handle(); });
    RunOn(lane_, [this] { Handle(); });
  }

  void OnNoMessage(const absl::Status& why) override { FinishCall(OrStopped(why)); }
  void OnSent() override {
    const bool answered = reply().last();
    reply().Clear();
    reply_bytes_ = 0;
    if (answered) return Read();
    RunOn(lane_, [this] { AnswerSlice(); });
  }

  // Returns true if the message can be answered immediately on gRPC's thread.
  bool IsQuick() const {
    if (!open_ || !request().has_update() || !options_.WantsRelationOnly()) return false;
    const v1::CollisionStreamUpdate& update = request().update();
    if (update.refresh_hulls() || update.placements_size() > kMaxQuickPairs) return false;
    int pairs = 0;
    for (const uint32_t placement : update.placements()) {
      if (placement >= table_.size()) return true;  // an error
      for (const uint32_t number : pairs_.pairs_of(placement)) {
        if (++pairs > kMaxQuickPairs) return false;
        const LivePair& pair = pairs_.pair(number);
        for (const uint32_t part : {pair.a, pair.b}) {
          if (table_.is_body(part)) return false;
          if (!IsQuickToRelate(table_.placed()[part].query_hull())) return false;
        }
      }
    }
    return true;
  }

  void Handle() {
    pairs_.EndRound();
    decided_.clear();
    next_pair_ = 0;
    refresh_.reset();
    const absl::Status status = HandleMessage();
    if (!status.ok() || !refresh_.has_value()) return AnswerMessage(status);
    // No thread waits for a store query, because an unresponsive store would block all threads.
    TaskPool& threads = messages_ == 0 ? parts_.long_readers : parts_.readers;
    const bool awaits = parts_.waiting.AwaitFresh(
        parts_.registry, refresh_->freshness, call().should_stop(),
        [this, &threads, self = shared_from_this()](const absl::Status& fresh) {
          RunOn(threads, [this, fresh] { AnswerMessage(OfMessage(fresh)); });
        });
    if (!awaits) AnswerMessage(absl::OkStatus());
  }

  absl::Status HandleMessage() {
    HULLD_RETURN_IF_ERROR(CheckOrder(
        request(), open_, "open was sent twice; start a new stream for other placements or pairs"));
    if (request().has_open()) return Prefixed("open: ", HandleOpen());
    ++messages_;
    return OfMessage(HandleUpdate(request().update()));
  }

  // Returns the status with the number of the current update before its message.
  absl::Status OfMessage(const absl::Status& status) const {
    if (messages_ == 0) return status;
    return Prefixed(absl::StrCat("update ", messages_, ": "), status);
  }

  absl::Status HandleOpen() {
    v1::CollisionStreamOpen& open = *request().mutable_open();
    HULLD_ASSIGN_OR_RETURN(options_,
                           MakeQueryOptions(v1::METHOD_UNSPECIFIED, open.wanted(), open.tolerance(),
                                            parts_.registry.limits(), call().lifetime()));
    HULLD_ASSIGN_OR_RETURN(
        freshness_, DecodeFreshness(open.freshness(), parts_.store, call().message_arrival()));
    HULLD_RETURN_IF_ERROR(CheckNoMotions(open.placements(), open.packed_placements(), "a stream"));
    HULLD_ASSIGN_OR_RETURN(
        table_,
        PlacementTable::Make(open.placements(), *open.mutable_packed_placements(), call().caller(),
                             parts_.registry.limits().max_placements, "the stream"));
    HULLD_RETURN_IF_ERROR(ValidatePairs(
        open.pairs(), table_.size(), parts_.registry.limits().max_pairs_per_batch, "the stream"));
    wanted_ = open.wanted();
    only_changes_ = open.only_changes();
    HULLD_RETURN_IF_ERROR(ChargeFor(static_cast<size_t>(open.pairs_size()) / 2));
    pairs_ = LivePairs(open.pairs(), table_.size(), v1::RELATION_UNSPECIFIED);
    open_ = true;
    pairs_.SelectAll();
    // Preparation pays off, because the hulls are used until the client refreshes them.
    const uint64_t pairs_per_hull = 2 * pairs_.size() / std::max<size_t>(1, table_.hull_count());
    refresh_ = {kExpectedUpdates * pairs_per_hull, true, freshness_};
    return absl::OkStatus();
  }

  // Charges the stream's memory to --memory-limit before allocating it. RESOURCE_EXHAUSTED: there
  // is no room for it.
  absl::Status ChargeFor(size_t pairs) {
    charge_.Set(table_.MemoryBytes() + LivePairs::BytesOf(pairs, table_.size()) +
                pairs * sizeof(Decided));
    return parts_.registry.CheckMemory(MemoryUse::kReading);
  }

  // Validates the whole update before applying any of it.
  absl::Status HandleUpdate(const v1::CollisionStreamUpdate& update) {
    HULLD_RETURN_IF_ERROR(ValidateMoves(update.placements(), update.poses(), table_.size()));
    for (int i = 0; i < update.placements_size(); ++i) {
      const uint32_t placement = update.placements(i);
      const Pose pose = ReadPose(update.poses(), static_cast<size_t>(i));
      // A refresh places all placements.
      update.refresh_hulls() ? table_.SetPose(placement, pose) : table_.Move(placement, pose);
      pairs_.SelectPairsOf(placement);
    }
    if (update.refresh_hulls()) {
      refresh_ = ReadPlan{.freshness = freshness_};
      refresh_->freshness.began = call().message_arrival();
    }
    return absl::OkStatus();
  }

  absl::Status Refresh(const ReadPlan& plan) {
    HULLD_RETURN_IF_ERROR(table_.Refresh(parts_.registry, options_, plan));
    if (table_.has_bodies()) {
      HULLD_RETURN_IF_ERROR(ChargeFor(pairs_.size()));
    }
    for (uint32_t i = 0; i < table_.size(); ++i) {
      if (table_.hull_changed(i)) pairs_.SelectPairsOf(i);
      if (table_.query_hull_changed(i)) pairs_.ForgetPoints(i);
    }
    next_row_ = 0;
    return absl::OkStatus();
  }

  // Looks up the hulls, if the message requires it, and answers the message. status: result of the
  // previous step.
  void AnswerMessage(absl::Status status) {
    if (status.ok() && refresh_.has_value()) status = OfMessage(Refresh(*refresh_));
    if (!status.ok()) return FinishCall(OrStopped(status));
    request().Clear();
    pairs_.SortSelected();
    EncodeHeader(parts_.store, table_.as_of(), reply().mutable_header());
    reply_bytes_ = reply().ByteSizeLong();
    call().AddPairs(pairs_.selected().size());
    AnswerSlice();
  }

  void AddAnswer(uint32_t index) {
    LivePair& pair = pairs_.pair(index);
    const bool answerable = table_.is_answerable(pair.a) && table_.is_answerable(pair.b);
    PlacedAnswer answer;
    if (answerable) answer = QueryAtRest(table_, pair.a, pair.b, options_, &pair.cache);
    const bool is_answered = answerable && answer.answer.ok();
    if (is_answered) rungs_.Add(answer.answer->rung);
    const v1::Relation relation =
        is_answered ? EncodeRelation(answer.answer->relation) : v1::RELATION_UNSPECIFIED;
    const bool changed = relation != pair.relation;
    pair.relation = relation;
    if (only_changes_ && messages_ > 0 && !changed) return;
    v1::AnswerColumns* const columns = reply().mutable_columns();
    reply().add_pairs(index);
    reply_bytes_ += kIndexBytes;
    if (!answerable) {
      reply_bytes_ += AddUnansweredPair(table_, wanted_, columns);
      return;
    }
    reply_bytes_ += AddPlacedAnswer(table_, pair.a, pair.b, answer, wanted_, columns);
  }

  // Decides the requested pairs, with the help of any threads that arrive in time. Helpers run
  // slices in this call's turns, so they yield to other calls.
  void DecideTogether() {
    decided_.resize(pairs_.selected().size());
    unclaimed_.Begin(static_cast<uint32_t>(decided_.size()));
    const size_t wanted = std::min(parts_.pool.threads() - 1, decided_.size() / kPairsPerHelper);
    // Includes queued helpers of an earlier step.
    for (size_t helpers = helpers_waiting_.load(); helpers < wanted; ++helpers) {
      ++helpers_waiting_;
      RunOn(lane_, [this] {
        --helpers_waiting_;
        DecideBlocks();
      });
    }
    DecideBlocks();
  }

  // Works on blocks until none is left, or until other calls are due. Runs on any thread, and on
  // several concurrently. The thread that completes the last block continues. No other thread may
  // access this stream after it completed its last block, or if it found none.
  void DecideBlocks() {
    const auto end = std::chrono::steady_clock::now() + TaskPool::kSliceTime;
    while (true) {
      const ClaimedRange::Block block = unclaimed_.Claim(kPairsPerClaim);
      if (block.empty()) return;
      // If the call must stop, blocks are completed without any work, so that exactly one thread is
      // still the last.
      if (!call().ShouldStop()) {
        for (uint32_t i = block.begin; i < block.end; ++i) Decide(i);
      }
      if (unclaimed_.Complete(block)) return AnswerSlice();
      if (std::chrono::steady_clock::now() >= end) return RunOn(lane_, [this] { DecideBlocks(); });
    }
  }

  void Decide(uint32_t i) {
    LivePair& pair = pairs_.pair(pairs_.selected()[i]);
    v1::Relation relation = v1::RELATION_UNSPECIFIED;
    Rung rung = Rung::kBounds;
    if (table_.is_answerable(pair.a) && table_.is_answerable(pair.b)) {
      const std::span<const PlacedHull> placed = table_.placed();
      const absl::StatusOr<Answer> answer =
          CheckCollision(placed[pair.a], placed[pair.b], options_, &pair.cache);
      // The relation of valid hulls at valid poses has no other error.
      HULLD_CHECK(answer.ok() || absl::IsCancelled(answer.status()));
      if (!answer.ok()) return;
      relation = EncodeRelation(answer->relation);
      rung = answer->rung;
    }
    const bool is_changed = std::exchange(pair.relation, relation) != relation;
    decided_[i] = {static_cast<uint8_t>(relation), rung, is_changed};
  }

  void AddDecided(size_t i) {
    const auto [number, rung, is_changed] = decided_[i];
    const auto relation = static_cast<v1::Relation>(number);
    const bool is_answered = relation != v1::RELATION_UNSPECIFIED;
    if (is_answered) rungs_.Add(rung);
    if (only_changes_ && messages_ > 0 && !is_changed) return;
    v1::AnswerColumns* const columns = reply().mutable_columns();
    reply().add_pairs(pairs_.selected()[i]);
    columns->add_relations(relation);
    columns->add_rungs(is_answered ? EncodeRung(rung) : v1::RUNG_UNSPECIFIED);
    reply_bytes_ += kIndexBytes + kRelationBytes;
  }

  // Computes until the answer is complete, the message is full, or other calls are due. A plain
  // answer is first decided as a whole.
  void AnswerSlice() {
    if (next_row_ < table_.table_rows()) {
      next_row_ = table_.EncodeHulls(next_row_, &reply());
      if (next_row_ < table_.table_rows()) return SendPart(false);
      reply_bytes_ = reply().ByteSizeLong();
    }
    const bool is_plain = WantsRelationsOfHulls(options_, table_);
    const std::span<const uint32_t> selected = pairs_.selected();
    if (is_plain && decided_.size() < selected.size()) return DecideTogether();
    const auto end = std::chrono::steady_clock::now() + TaskPool::kSliceTime;
    const size_t pairs_per_poll =
        is_plain ? kPairsPerClockRead : (table_.has_bodies() ? 1 : kPairsPerClaim);
    while (next_pair_ < selected.size() && reply_bytes_ < FullMessageBytes(wanted_)) {
      is_plain ? AddDecided(next_pair_) : AddAnswer(selected[next_pair_]);
      if (++next_pair_ % pairs_per_poll != 0) continue;
      if (call().ShouldStop()) break;
      if (std::chrono::steady_clock::now() >= end) {
        return RunOn(lane_, [this] { AnswerSlice(); });
      }
    }
    call().metrics().CountPairs(std::exchange(rungs_, {}));
    if (call().ShouldStop()) return FinishCall(call().StopStatus());
    const bool is_last = next_pair_ == pairs_.selected().size();
    if (is_last) call().EndMessage();
    SendPart(is_last);
  }

  void SendPart(bool last) {
    reply().set_update(messages_);
    reply().set_last(last);
    Send();
  }

  const ServiceParts& parts_;
  // Slices of long answers.
  TaskPool::Lane lane_;
  // Covers placements and pairs.
  MemoryCharge charge_;

  // Estimated size of the reply.
  size_t reply_bytes_ = 0;
  uint64_t messages_ = 0;

  // Set by `open`.
  bool open_ = false;
  bool only_changes_ = false;
  Freshness freshness_;
  // Plan for looking up the hulls, if the current message requires it.
  std::optional<ReadPlan> refresh_;
  v1::Wanted wanted_;
  QueryOptions options_;
  PlacementTable table_;
  // Next row of the table to send; table_rows() if none is left.
  size_t next_row_ = 0;
  // The current message queries the selected pairs, in ascending order.
  LivePairs pairs_;
  // Index of the next selected pair to answer.
  size_t next_pair_ = 0;
  RungCounts rungs_;

  // Results of a plain answer, decided by several threads; then parallel to the selected pairs.
  std::vector<Decided> decided_;
  // Selected pairs that no thread has claimed yet.
  ClaimedRange unclaimed_;
  // Queued slices of helpers.
  std::atomic<size_t> helpers_waiting_ = 0;
};

}  // namespace

BidiReactor* StartCollisionStream(CallContext& context, const ServiceParts& parts) {
  return CollisionStream::Launch(std::make_shared<CollisionStream>(context, parts));
}

}  // namespace hulld::server
