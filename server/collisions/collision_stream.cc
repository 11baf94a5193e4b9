#include "server/collisions/collision_stream.h"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <chrono>
#include <span>
#include <thread>
#include <utility>

#include "core/base/check.h"
#include "core/query/collision.h"
#include "server/collisions/placed/placed_answer.h"
#include "server/collisions/placed/query_settings.h"
#include "server/contract/status_map.h"
#include "server/wire/answer_columns.h"
#include "server/wire/decode.h"
#include "server/wire/encode.h"

namespace hulld::server {
namespace {

// Pairs between two looks at the clock.
constexpr size_t kPairsPerLook = 16;
// Decoding the poses of an update up to this size takes less than a slice.
constexpr int kMostShortUpdate = 4096;
// An update that concerns no more pairs is answered where it arrives.
constexpr int kMostQuickPairs = 8;
// A stream is opened for many updates; how many is a guess.
constexpr uint64_t kExpectedUpdates = 256;
// An index among the pairs, as a varint.
constexpr size_t kIndexBytes = 5;
// A relation and a rung.
constexpr size_t kRelationBytes = 2;
// Decided pairs that are told between two looks at the clock, in some 20 us.
constexpr size_t kToldPerLook = 4096;
// Pairs for which another thread is asked to help: they take some 20 us at the least, and a thread
// about as long to come. Observed: close pairs of UR5 links.
constexpr size_t kPairsPerHelper = 192;

}  // namespace

BidiReactor* CollisionStream::Start(grpc::CallbackServerContext& context, Admission& admission,
                                    Shards& shards, WorkerPool& readers, WorkerPool& long_readers,
                                    TaskPool& pool, WaitingCalls& waiting) {
  return Launch(std::shared_ptr<CollisionStream>(
      new CollisionStream(context, admission, shards, readers, long_readers, pool, waiting)));
}

void CollisionStream::OnMessage() {
  call().BeginMessage();
  if (IsQuick()) {
    pool_.NoteSingleCall();
    return Handle();
  }
  // What resolves hulls may wait for the store; the first message resolves all of them.
  if (!open_) return RunOn(long_readers_, [this] { Handle(); });
  if (request().update().refresh_hulls()) return RunOn(readers_, [this] { Handle(); });
  // Only the first slice of a step goes ahead of batches.
  const bool is_short = request().update().placements_size() <= kMostShortUpdate;
  if (is_short) return RunOn(pool_, [this] { Handle(); });
  RunOn(lane_, [this] { Handle(); });
}

void CollisionStream::OnSent() {
  const bool answered = reply().last();
  reply().Clear();
  reply_bytes_ = 0;
  if (answered) return Read();
  RunOn(lane_, [this] { AnswerSlice(); });
}

// Whether the message can be answered here and now, on gRPC's thread.
bool CollisionStream::IsQuick() const {
  if (!open_ || !request().has_update() || !options_.WantsRelationOnly()) return false;
  const v1::CollisionStreamUpdate& update = request().update();
  if (update.refresh_hulls() || update.placements_size() > kMostQuickPairs) return false;
  int pairs = 0;
  for (const uint32_t placement : update.placements()) {
    if (placement >= table_.size()) return true;  // an error
    for (size_t k = pairs_begin_[placement]; k < pairs_begin_[placement + 1]; ++k) {
      if (++pairs > kMostQuickPairs) return false;
      const PairState& pair = pairs_[pairs_of_[k]];
      for (const uint32_t part : {pair.a, pair.b}) {
        if (table_.is_body(part)) return false;
        if (!IsQuickToRelate(table_.placed()[part].query_hull())) return false;
      }
    }
  }
  return true;
}

void CollisionStream::Handle() {
  asked_.clear();
  moved_.clear();
  next_asked_ = 0;
  refresh_.reset();
  const absl::Status status = HandleMessage();
  if (!status.ok() || !refresh_.has_value()) return AnswerMessage(status);
  // No thread waits while stores are asked: one that does not answer would hold all of them.
  WorkerPool& threads = messages_ == 0 ? long_readers_ : readers_;
  const bool awaits = waiting_.AwaitFresh(
      shards_, table_.hull_ids(), refresh_->freshness, [this] { return call().ShouldStop(); },
      [this, &threads, self = shared_from_this()](const absl::Status& fresh) {
        RunOn(threads, [this, fresh] { AnswerMessage(OfMessage(fresh)); });
      });
  if (!awaits) AnswerMessage(absl::OkStatus());
}

// Looks the hulls up, if the message has them looked up, and answers it. status: that of what came
// before.
void CollisionStream::AnswerMessage(absl::Status status) {
  if (status.ok() && refresh_.has_value()) status = OfMessage(Refresh(*refresh_));
  if (!status.ok()) return FinishCall(OrStopped(status));
  request().Clear();
  if (!std::is_sorted(asked_.begin(), asked_.end())) std::sort(asked_.begin(), asked_.end());
  for (const uint32_t pair : asked_) is_asked_[pair] = false;
  table_.EncodeHeader(shards_, reply().mutable_header());
  reply_bytes_ = reply().ByteSizeLong();
  call().AddPairs(asked_.size());
  is_decided_ = false;
  // A few, or where one thread answers, by this one.
  if (!IsPlain() || moved_.size() < kPairsPerHelper) {
    for (const uint32_t placement : moved_) table_.PlaceAgain(placement);
    moved_.clear();
  }
  AnswerSlice();
}

// What came of an update, as the client is told.
absl::Status CollisionStream::OfMessage(const absl::Status& status) const {
  if (messages_ == 0) return status;
  return Prefixed(absl::StrCat("update ", messages_, ": "), status);
}

absl::Status CollisionStream::HandleMessage() {
  switch (request().message_case()) {
    case v1::StreamCollisionsRequest::kOpen:
      if (open_) {
        return absl::InvalidArgumentError(
            "open came twice; other placements or pairs need another stream");
      }
      return HandleOpen();
    case v1::StreamCollisionsRequest::kUpdate:
      if (!open_) return absl::InvalidArgumentError("the first message must be open, not update");
      ++messages_;
      return OfMessage(HandleUpdate(request().update()));
    case v1::StreamCollisionsRequest::MESSAGE_NOT_SET:
      break;
  }
  return absl::InvalidArgumentError("the message is empty; set open or update");
}

absl::Status CollisionStream::HandleOpen() {
  v1::CollisionStreamOpen& open = *request().mutable_open();
  absl::StatusOr<QueryOptions> options = MakeQueryOptions(
      v1::METHOD_UNSPECIFIED, open.wanted(), open.tolerance(), shards_.limits(), call().lifetime());
  if (!options.ok()) return Prefixed("open: ", options.status());
  const absl::StatusOr<ShardsFreshness> freshness =
      DecodeFreshness(open.freshness(), shards_.store_ids(), call().message_arrival());
  if (!freshness.ok()) return Prefixed("open: ", freshness.status());
  freshness_ = *freshness;
  absl::StatusOr<PlacementTable> table =
      PlacementTable::Make(open.placements(), *open.mutable_packed_placements(), call().caller(),
                           shards_.limits().max_placements, "the stream");
  if (!table.ok()) return Prefixed("open: ", table.status());
  const absl::Status valid = ValidatePairs(open.pairs(), table->size(),
                                           shards_.limits().max_pairs_per_batch, "the stream");
  if (!valid.ok()) return Prefixed("open: ", valid);
  options_ = *std::move(options);
  wanted_ = open.wanted();
  only_changes_ = open.only_changes();
  table_ = *std::move(table);

  if (absl::Status s = ChargeFor(static_cast<size_t>(open.pairs_size()) / 2); !s.ok()) {
    return Prefixed("open: ", s);
  }

  pairs_.reserve(static_cast<size_t>(open.pairs_size()) / 2);
  pairs_begin_.assign(table_.size() + 1, 0);
  for (int i = 0; i < open.pairs_size(); i += 2) {
    pairs_.push_back({open.pairs(i), open.pairs(i + 1), {}, v1::RELATION_UNSPECIFIED});
    ++pairs_begin_[pairs_.back().a];
    ++pairs_begin_[pairs_.back().b];
  }
  size_t sum = 0;
  for (size_t& begin : pairs_begin_) begin = sum += begin;
  pairs_of_.resize(sum);
  for (size_t i = pairs_.size(); i-- > 0;) {
    pairs_of_[--pairs_begin_[pairs_[i].a]] = static_cast<uint32_t>(i);
    pairs_of_[--pairs_begin_[pairs_[i].b]] = static_cast<uint32_t>(i);
  }
  open_ = true;
  is_asked_.assign(pairs_.size(), false);
  for (size_t i = 0; i < pairs_.size(); ++i) AskAbout(static_cast<uint32_t>(i));
  // It is worth the wait: the hulls are used until the client refreshes them.
  const uint64_t pairs_per_hull = 2 * pairs_.size() / std::max<size_t>(1, table_.hull_count());
  refresh_ = {kExpectedUpdates * pairs_per_hull, true, freshness_};
  return absl::OkStatus();
}

// Counts what the stream is to hold against --memory-limit, before it is held. RESOURCE_EXHAUSTED:
// there is no room for it.
absl::Status CollisionStream::ChargeFor(size_t pairs) {
  // A pair among the pairs of two placements, and among those that are asked about and decided.
  constexpr size_t kPerPair =
      sizeof(PairState) + 3 * sizeof(uint32_t) + sizeof(char) + sizeof(Decided);
  charge_.Set(table_.MemoryBytes() + (table_.size() + 1) * sizeof(size_t) + pairs * kPerPair);
  return shards_.CheckMemory(MemoryUse::kReading);
}

// Checks all of the update before it applies any.
absl::Status CollisionStream::HandleUpdate(const v1::CollisionStreamUpdate& update) {
  if (absl::Status s = ValidateMoves(update.placements(), update.poses(), table_.size()); !s.ok()) {
    return s;
  }
  for (int i = 0; i < update.placements_size(); ++i) {
    table_.SetPose(update.placements(i), ReadPose(update.poses(), static_cast<size_t>(i)));
    AskAboutPairsOf(update.placements(i));
  }
  if (update.refresh_hulls()) {
    // That places all.
    refresh_ = ShardsPlan{.freshness = freshness_};
    refresh_->freshness.began = call().message_arrival();
  } else {
    moved_.assign(update.placements().begin(), update.placements().end());
  }
  return absl::OkStatus();
}

absl::Status CollisionStream::Refresh(const ShardsPlan& plan) {
  if (absl::Status s = table_.Refresh(shards_, options_, plan); !s.ok()) return s;
  if (table_.has_bodies()) {
    if (absl::Status s = ChargeFor(pairs_.size()); !s.ok()) return s;
  }
  for (size_t i = 0; i < table_.size(); ++i) {
    if (table_.hull_changed(i)) AskAboutPairsOf(i);
    if (!table_.query_hull_changed(i)) continue;
    // The points that a cache names are those of the QueryHull before. Its axis is as good a guess
    // as it was.
    for (size_t k = pairs_begin_[i]; k < pairs_begin_[i + 1]; ++k) {
      pairs_[pairs_of_[k]].cache.pair_count = 0;
    }
  }
  next_row_ = 0;
  return absl::OkStatus();
}

void CollisionStream::AskAbout(uint32_t pair) {
  if (is_asked_[pair]) return;
  is_asked_[pair] = true;
  asked_.push_back(pair);
}

void CollisionStream::AskAboutPairsOf(size_t placement) {
  for (size_t k = pairs_begin_[placement]; k < pairs_begin_[placement + 1]; ++k) {
    AskAbout(pairs_of_[k]);
  }
}

void CollisionStream::AddAnswer(uint32_t index) {
  PairState& pair = pairs_[index];
  const bool answerable = table_.is_answerable(pair.a) && table_.is_answerable(pair.b);
  PlacedAnswer answer;
  if (answerable) answer = AskPlaced(table_, pair.a, pair.b, options_, &pair.cache);
  const bool is_answered = answerable && answer.answer.ok();
  if (answerable && !is_answered) {
    answer.answer = NameLimit(table_, pair.a, pair.b, answer.answer.status(), options_);
  }
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

// Places what moved, and then decides the pairs that are asked about, with the help of other
// threads, as far as these come in time: helpers take slices, in the turns of this call, so they
// wait where others have to.
void CollisionStream::DecideTogether() {
  decided_.resize(asked_.size());
  is_placing_ = !moved_.empty();
  if (is_placing_) {
    unclaimed_.Begin(static_cast<uint32_t>(moved_.size()));
  } else if (!BeginDeciding()) {
    return TellDecided();
  }
  const size_t wished = std::min<size_t>(pool_.threads() - 1, asked_.size() / kPairsPerHelper);
  // Helpers of an earlier step that did not have their turn yet count as well.
  for (size_t helpers = helpers_waiting_.load(); helpers < wished; ++helpers) {
    ++helpers_waiting_;
    RunOn(lane_, [this] {
      --helpers_waiting_;
      TakePart();
    });
  }
  TakePart();
}

// Requires that all is placed. False when there is nothing to decide.
bool CollisionStream::BeginDeciding() {
  is_placing_ = false;
  if (asked_.empty()) return false;
  unclaimed_.Begin(static_cast<uint32_t>(asked_.size()));
  return true;
}

// The next block. While others still place the last placements, the pairs are worth a short wait:
// another thread would have to be woken for them.
ClaimedRange::Block CollisionStream::Claim() {
  constexpr int kMostYields = 64;
  ClaimedRange::Block block = unclaimed_.Claim(kPairsPerLook);
  for (int i = 0; block.empty() && is_placing_ && i < kMostYields; ++i) {
    std::this_thread::yield();
    block = unclaimed_.Claim(kPairsPerLook);
  }
  return block;
}

// Works on blocks until none is left, or it is the turn of others. Runs on any thread, and on
// several at a time; the thread that gives back the last block goes on. Nothing of this stream may
// be touched after the last block was given back, or when there was none.
void CollisionStream::TakePart() {
  const auto end = std::chrono::steady_clock::now() + TaskPool::kSliceTime;
  while (true) {
    const ClaimedRange::Block block = Claim();
    if (block.empty()) return;
    // What is begun next waits until this block is given back.
    const bool is_placing = is_placing_;
    // When the call is to stop, blocks are given back undone, so that one thread is still the last.
    if (!call().ShouldStop()) {
      for (uint32_t i = block.begin; i < block.end; ++i) {
        is_placing ? table_.PlaceAgain(moved_[i]) : Decide(i);
      }
    }
    if (unclaimed_.GiveBack(block) && !(is_placing && BeginDeciding())) return TellDecided();
    if (std::chrono::steady_clock::now() >= end) return RunOn(lane_, [this] { TakePart(); });
  }
}

void CollisionStream::Decide(uint32_t i) {
  PairState& pair = pairs_[asked_[i]];
  v1::Relation relation = v1::RELATION_UNSPECIFIED;
  Rung rung = Rung::kBounds;
  if (table_.is_answerable(pair.a) && table_.is_answerable(pair.b)) {
    const std::span<const PlacedHull> placed = table_.placed();
    const absl::StatusOr<Answer> answer =
        CheckCollision(placed[pair.a], placed[pair.b], options_, &pair.cache);
    // Nothing else can happen to the relation of valid hulls at valid poses.
    HULLD_CHECK(answer.ok() || absl::IsCancelled(answer.status()));
    if (!answer.ok()) return;
    relation = EncodeRelation(answer->relation);
    rung = answer->rung;
  }
  const bool is_changed = std::exchange(pair.relation, relation) != relation;
  decided_[i] = {static_cast<uint8_t>(relation), rung, is_changed};
}

// Tells what was decided: as much as fits a message, or until it is the turn of others.
void CollisionStream::TellDecided() {
  const auto end = std::chrono::steady_clock::now() + TaskPool::kSliceTime;
  is_decided_ = true;
  v1::AnswerColumns* const columns = reply().mutable_columns();
  while (next_asked_ < asked_.size() && reply_bytes_ < FullMessageBytes(wanted_)) {
    if (next_asked_ % kToldPerLook == 0) {
      if (call().ShouldStop()) break;
      if (std::chrono::steady_clock::now() >= end) {
        return RunOn(lane_, [this] { TellDecided(); });
      }
    }
    const auto [number, rung, is_changed] = decided_[next_asked_];
    const uint32_t index = asked_[next_asked_++];
    const auto relation = static_cast<v1::Relation>(number);
    const bool is_answered = relation != v1::RELATION_UNSPECIFIED;
    if (is_answered) rungs_.Add(rung);
    if (only_changes_ && messages_ > 0 && !is_changed) continue;
    reply().add_pairs(index);
    columns->add_relations(relation);
    columns->add_rungs(is_answered ? EncodeRung(rung) : v1::RUNG_UNSPECIFIED);
    reply_bytes_ += kIndexBytes + kRelationBytes;
  }
  SendAnswered();
}

void CollisionStream::SendPart(bool last) {
  reply().set_update(messages_);
  reply().set_last(last);
  Send();
}

// Computes until the answer is complete, a message is full, or it is the turn of others.
void CollisionStream::AnswerSlice() {
  if (next_row_ < table_.table_rows()) {
    next_row_ = table_.EncodeHulls(next_row_, &reply());
    if (next_row_ < table_.table_rows()) return SendPart(false);
    reply_bytes_ = reply().ByteSizeLong();
  }
  if (IsPlain()) return is_decided_ ? TellDecided() : DecideTogether();
  const auto end = std::chrono::steady_clock::now() + TaskPool::kSliceTime;
  const size_t pairs_per_look = table_.has_bodies() ? 1 : kPairsPerLook;
  while (next_asked_ < asked_.size()) {
    if (reply_bytes_ >= FullMessageBytes(wanted_)) break;
    AddAnswer(asked_[next_asked_++]);
    if (next_asked_ % pairs_per_look != 0) continue;
    if (call().ShouldStop()) break;
    if (std::chrono::steady_clock::now() >= end) {
      return RunOn(lane_, [this] { AnswerSlice(); });
    }
  }
  SendAnswered();
}

void CollisionStream::SendAnswered() {
  call().metrics().CountPairs(std::exchange(rungs_, {}));
  if (call().ShouldStop()) return FinishCall(call().StopStatus());
  if (next_asked_ == asked_.size()) call().EndMessage();
  SendPart(next_asked_ == asked_.size());
}

}  // namespace hulld::server
