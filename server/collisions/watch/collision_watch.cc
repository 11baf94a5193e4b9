#include "server/collisions/watch/collision_watch.h"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <chrono>
#include <numeric>
#include <set>
#include <utility>

#include "server/collisions/placed/placed_answer.h"
#include "server/collisions/placed/query_settings.h"
#include "server/collisions/placed/scene_groups.h"
#include "server/contract/status_map.h"
#include "server/registry/body_resolution.h"
#include "server/settings/config.h"
#include "server/wire/encode.h"

namespace hulld::server {
namespace {

// Number of pairs between two reads of the clock.
constexpr size_t kPairsPerPoll = 16;
// Rounds per watch over which preparation pays off. A guess.
constexpr uint64_t kExpectedRounds = 256;
// Tag and length of an entry within its message.
constexpr size_t kEntryHeaderBytes = 4;
// Decoding the poses of an update up to this size takes less than a slice.
constexpr int kMostShortUpdate = 4096;

bool IsContact(v1::Relation relation) {
  return relation == v1::RELATION_TOUCHING || relation == v1::RELATION_OVERLAPPING;
}

// Returns the kind of the pair's event; UNSPECIFIED if the pair is unchanged.
v1::CollisionEventKind KindOf(const WatchedPair& before, v1::Relation relation, bool is_within) {
  switch (relation) {
    case v1::RELATION_OVERLAPPING:
      if (before.relation == relation) break;
      return v1::COLLISION_EVENT_KIND_ENTER;
    case v1::RELATION_TOUCHING:
      if (before.relation == relation) break;
      return v1::COLLISION_EVENT_KIND_TOUCH;
    default:
      if (IsContact(before.relation)) return v1::COLLISION_EVENT_KIND_EXIT;
      if (is_within == before.is_within_clearance) break;
      return is_within ? v1::COLLISION_EVENT_KIND_NEAR : v1::COLLISION_EVENT_KIND_FAR;
  }
  return v1::COLLISION_EVENT_KIND_UNSPECIFIED;
}

}  // namespace

BidiReactor* CollisionWatch::Start(grpc::CallbackServerContext& context, Admission& admission,
                                   Registry& registry, WorkerPool& readers,
                                   WorkerPool& long_readers, TaskPool& pool) {
  return Launch(std::shared_ptr<CollisionWatch>(
      new CollisionWatch(context, admission, registry, readers, long_readers, pool)));
}

void CollisionWatch::OnDone() {
  const auto self = shared_from_this();
  ReadingStream::OnDone();
  if (watch_ == nullptr) return;
  registry_.CloseWatch(watch_);
  watch_.reset();
}

void CollisionWatch::StartWork() {
  if (!reading() && !has_message_ && !has_said_all_) Read();
  if (is_working_ || unsent_bytes() > 0) return;
  const auto work = [this](auto& pool, void (CollisionWatch::*step)()) {
    is_working_ = true;
    RunOn(pool, [this, step] { (this->*step)(); });
  };
  if (is_telling_) return work(lane_, &CollisionWatch::Tell);
  if (has_message_) {
    // The first message resolves all hulls.
    if (!is_open_) return work(long_readers_, &CollisionWatch::TakeMessage);
    const bool is_short = request().update().placements_size() <= kMostShortUpdate;
    if (is_short) return work(pool_, &CollisionWatch::TakeMessage);
    return work(lane_, &CollisionWatch::TakeMessage);
  }
  if (has_said_all_) return End(absl::OkStatus());
  if (!std::exchange(are_hulls_due_, false)) return;
  work(readers_, &CollisionWatch::TakeChanges);
}

void CollisionWatch::OnMessage() {
  call().BeginMessage();
  has_message_ = true;
}

void CollisionWatch::OnNoMessage(const absl::Status& why) {
  if (!why.ok()) return End(OrStopped(why));
  has_said_all_ = true;
}

void CollisionWatch::EndWork(const absl::Status& error) {
  Locked([&] {
    is_working_ = false;
    if (!error.ok()) End(OrStopped(error));
  });
}

void CollisionWatch::TakeMessage() {
  const absl::Status status = HandleMessage();
  if (!status.ok()) return EndWork(status);
  request().Clear();
  answers_message_ = true;
  Tell();
}

absl::Status CollisionWatch::HandleMessage() {
  switch (request().message_case()) {
    case v1::WatchCollisionsRequest::kOpen:
      if (is_open_) {
        return absl::InvalidArgumentError(
            "open came twice; other placements or pairs need another watch");
      }
      return Prefixed("open: ", HandleOpen(*request().mutable_open()));
    case v1::WatchCollisionsRequest::kUpdate:
      if (!is_open_)
        return absl::InvalidArgumentError("the first message must be open, not update");
      ++messages_;
      return Prefixed(absl::StrCat("update ", messages_, ": "), HandleUpdate(request().update()));
    case v1::WatchCollisionsRequest::MESSAGE_NOT_SET:
      break;
  }
  return absl::InvalidArgumentError("the message is empty; set open or update");
}

absl::Status CollisionWatch::HandleOpen(v1::CollisionWatchOpen& open) {
  // Also refuses NaN.
  if (open.has_clearance() && !(open.clearance() >= 0)) {
    return absl::InvalidArgumentError(
        absl::StrCat("clearance is ", open.clearance(), "; it must be a length of at least 0"));
  }
  v1::Wanted wanted;
  if (open.has_clearance()) wanted.set_clearance(open.clearance());
  const Limits& limits = registry_.limits();
  absl::StatusOr<QueryOptions> options =
      MakeQueryOptions(v1::METHOD_UNSPECIFIED, wanted, 0, limits, call().lifetime());
  if (!options.ok()) return options.status();
  absl::StatusOr<PlacementTable> table =
      PlacementTable::Make(open.placements(), *open.mutable_packed_placements(), call().caller(),
                           limits.max_placements, "the watch");
  if (!table.ok()) return table.status();
  const bool has_groups = open.groups_size() > 0 || open.ignored_group_pairs_size() > 0 ||
                          open.ignore_same_group() || open.has_movers();
  if (open.pairs_size() > 0 && has_groups) {
    return absl::InvalidArgumentError(
        "pairs are set, and groups or movers too; name the pairs, or say which of all to leave "
        "out");
  }
  absl::Status valid =
      ValidatePairs(open.pairs(), table->size(), limits.max_pairs_per_batch, "the watch");
  if (valid.ok()) valid = ValidateGroups(open, table->size());
  if (!valid.ok()) return valid;
  options_ = *std::move(options);
  table_ = *std::move(table);
  table_.SortByHull();
  pairs_ = WatchedPairs(open, table_.size(), limits.max_pairs_per_batch);
  charge_.Set(table_.MemoryBytes() + pairs_.MemoryBytes());
  if (absl::Status s = WatchHulls(); !s.ok()) return s;
  std::vector<size_t> all_hulls(table_.hull_ids().size());
  std::iota(all_hulls.begin(), all_hulls.end(), size_t{0});
  if (absl::Status s = FollowPieces(all_hulls); !s.ok()) return s;

  // Preparation pays off, because each hull is queried repeatedly.
  const uint64_t per_hull = 2 * table_.size() / std::max<size_t>(1, table_.hull_ids().size());
  const absl::Status resolved =
      table_.Resolve(registry_, options_, {kExpectedRounds * per_hull, true});
  if (!resolved.ok()) return resolved;
  revision_ = table_.revision();
  for (const size_t k : all_hulls) {
    if (table_.hull(k).ok()) TellOf(k);
  }
  std::vector<uint32_t> all(table_.size());
  std::iota(all.begin(), all.end(), 0);
  for (const uint32_t i : all) {
    if (!table_.is_answerable(i)) problems_to_tell_.push_back(i);
  }
  is_open_ = true;
  return AskAbout(all);
}

// Starts watching the hulls. A change before the hulls are resolved is reported twice, and none is
// missed.
absl::Status CollisionWatch::WatchHulls() {
  WatchTarget target;
  target.bodies = target.varies = true;
  for (size_t k = 0; k < table_.hull_ids().size(); ++k) {
    const std::string& id = table_.hull_ids()[k];
    if (!hulls_of_.contains(id)) target.ids.push_back(id);
    hulls_of_.emplace(id, k);
  }
  // No hull has this ID; the watch ends when the server drains, like any other.
  if (target.ids.empty()) target.ids.emplace_back();
  absl::StatusOr<std::shared_ptr<ChangeWatch>> watch = registry_.OpenWatch(
      target, {}, [this, self = shared_from_this()] { Locked([this] { are_hulls_due_ = true; }); });
  if (!watch.ok()) return watch.status();
  watch_ = *std::move(watch);
  Locked([this] { are_hulls_due_ = true; });
  return absl::OkStatus();
}

// Starts watching the hulls of the pieces of those table entries that are bodies. A body that
// changes later is reported itself, then followed and resolved again. Errors as
// Registry::FindBodies if a body cannot be read.
absl::Status CollisionWatch::FollowPieces(std::span<const size_t> hulls) {
  if (!registry_.has_bodies() && pieces_.MemoryBytes() == 0) return absl::OkStatus();
  std::vector<std::string> ids;
  ids.reserve(hulls.size());
  for (const size_t k : hulls) ids.push_back(table_.hull_ids()[k]);
  const FoundBodies found = registry_.bodies().Find(ids, [this] { return call().ShouldStop(); });
  if (!found.status.ok()) return found.status;
  FollowedPieces::Difference difference;
  for (size_t n = 0; n < hulls.size(); ++n) {
    const std::shared_ptr<const Body>& body = found.bodies[n];
    const bool is_asked = body != nullptr && CheckPiecePrefix(*body, call().caller().prefix).ok();
    pieces_.Set(hulls[n], is_asked ? body->hull_ids() : std::vector<std::string>(), &difference);
  }
  difference.Settle();
  // Hulls that are placed themselves are always watched.
  const auto is_placed = [this](const std::string& id) { return hulls_of_.contains(id); };
  std::erase_if(difference.added, is_placed);
  std::erase_if(difference.dropped, is_placed);
  if (!difference.added.empty() || !difference.dropped.empty()) {
    registry_.WatchAlso(*watch_, difference.added, difference.dropped);
  }
  return absl::OkStatus();
}

// Queues a hull, or a body and the hulls of its pieces, to be sent.
void CollisionWatch::TellOf(size_t hull) {
  hulls_to_tell_.push_back(hull);
  TellOfPieces(hull);
}

// Queues the hulls of a body's pieces that the client lacks: a body may have been resolved before
// its pieces were followed.
void CollisionWatch::TellOfPieces(size_t hull) {
  const HullView& view = *table_.hull(hull);
  if (view.body == nullptr) return;
  for (const HullView& of_piece : view.body->hulls) {
    if (pieces_.IsNews(of_piece.record)) piece_hulls_to_tell_.push_back(of_piece.record);
  }
}

absl::Status CollisionWatch::HandleUpdate(const v1::CollisionWatchUpdate& update) {
  if (absl::Status s = ValidateMoves(update.placements(), update.poses(), table_.size()); !s.ok()) {
    return s;
  }
  const std::vector<uint32_t> changed(update.placements().begin(), update.placements().end());
  for (size_t i = 0; i < changed.size(); ++i) {
    const uint32_t placement = changed[i];
    const absl::Status before = table_.problem(placement);
    table_.Move(placement, ReadPose(update.poses(), i));
    // The placement may also lack a hull.
    const absl::Status& now = table_.problem(placement);
    if (!now.ok() && now != before) problems_to_tell_.push_back(placement);
  }
  return AskAbout(changed);
}

void CollisionWatch::TakeChanges() {
  const absl::StatusOr<WatchPiece> piece = registry_.TakeChanges(*watch_);
  if (!piece.ok()) return EndWork(piece.status());
  if (piece->waits) return EndWork(absl::OkStatus());
  // More changes may be pending.
  Locked([this] { are_hulls_due_ = true; });
  const absl::Status status = HandleChanges(*piece);
  if (!status.ok()) return EndWork(status);
  if (!is_telling_) return EndWork(absl::OkStatus());
  answers_message_ = false;
  Tell();
}

// Returns the distinct hulls and bodies of the table that the piece affects.
std::vector<size_t> CollisionWatch::ConcernedBy(const WatchPiece& piece) const {
  if (piece.anew) {
    // The changes are unknown.
    std::vector<size_t> all(table_.hull_ids().size());
    std::iota(all.begin(), all.end(), size_t{0});
    return all;
  }
  std::set<size_t> hulls;
  for (const HullChange& change : piece.changes) {
    const auto [begin, end] = hulls_of_.equal_range(change.record.hull_id);
    for (auto hull = begin; hull != end; ++hull) hulls.insert(hull->second);
    hulls.merge(pieces_.BodiesOf(change.record.hull_id));
  }
  return {hulls.begin(), hulls.end()};
}

absl::Status CollisionWatch::HandleChanges(const WatchPiece& piece) {
  const std::vector<size_t> hulls = ConcernedBy(piece);
  const bool has_moved_on = piece.revision > revision_;
  revision_ = std::max(revision_, piece.revision);
  if (hulls.empty() && !has_moved_on) return absl::OkStatus();
  if (absl::Status s = FollowPieces(hulls); !s.ok()) return s;
  if (absl::Status s = table_.ResolveSome(registry_, options_, hulls); !s.ok()) return s;
  std::vector<uint32_t> changed;
  for (const size_t k : hulls) {
    const std::span<const uint32_t> placements = table_.placements_of(k);
    if (placements.empty()) continue;
    if (table_.query_hull_changed(placements.front())) {
      for (const uint32_t i : placements) pairs_.ForgetPoints(i);
    }
    const bool is_there = table_.hull(k).ok();
    if (is_there) TellOfPieces(k);
    if (!table_.hull_changed(placements.front())) continue;
    if (is_there) hulls_to_tell_.push_back(k);
    for (const uint32_t i : placements) {
      changed.push_back(i);
      if (!is_there) problems_to_tell_.push_back(i);
    }
  }
  // Without a changed hull, only the revision is sent.
  return AskAbout(changed);
}

absl::Status CollisionWatch::AskAbout(const std::vector<uint32_t>& changed) {
  if (absl::Status s = pairs_.AskAbout(changed, table_); !s.ok()) return s;
  charge_.Set(table_.MemoryBytes() + pairs_.MemoryBytes() + pieces_.MemoryBytes());
  if (absl::Status s = registry_.CheckMemory(MemoryUse::kReading); !s.ok()) return s;
  call().AddPairs(pairs_.asked().size());
  next_hull_ = next_piece_hull_ = next_problem_ = next_pair_ = 0;
  is_telling_ = true;
  return absl::OkStatus();
}

// Answers pairs and fills replies until the round is sent, a message is full, or the slice ends.
void CollisionWatch::Tell() {
  const auto end = std::chrono::steady_clock::now() + TaskPool::kSliceTime;
  bool is_full = !TellHulls();
  const std::span<const uint32_t> asked = pairs_.asked();
  while (!is_full && next_pair_ < asked.size()) {
    const absl::Status status = TellPair(pairs_.pair(asked[next_pair_++]));
    if (!status.ok()) return EndWork(status);
    is_full = reply_bytes_ >= Config::kReplyMessageBytes;
    if (!table_.has_bodies() && next_pair_ % kPairsPerPoll != 0) continue;
    if (call().ShouldStop()) return EndWork(call().StopStatus());
    if (std::chrono::steady_clock::now() >= end) return RunOn(lane_, [this] { Tell(); });
  }
  call().metrics().CountPairs(std::exchange(rungs_, {}));
  const bool is_told = !is_full;
  if (is_told) {
    pairs_.EndAsking();
    hulls_to_tell_.clear();
    piece_hulls_to_tell_.clear();
    problems_to_tell_.clear();
    if (answers_message_) call().EndMessage();
  }
  EncodeHeader(registry_.store(), revision_, reply_.mutable_header());
  reply_.set_update(messages_);
  reply_.set_synced(is_told);
  Locked([&] {
    is_working_ = false;
    is_telling_ = !is_told;
    if (is_told && answers_message_) has_message_ = false;
    const size_t bytes = std::exchange(reply_bytes_, 0) + 1;
    Queue(std::exchange(reply_, {}), bytes);
  });
}

// Returns false if the message is full before everything is added.
bool CollisionWatch::TellHulls() {
  while (next_hull_ < hulls_to_tell_.size() || next_piece_hull_ < piece_hulls_to_tell_.size() ||
         next_problem_ < problems_to_tell_.size()) {
    if (reply_bytes_ >= Config::kReplyMessageBytes) return false;
    if (next_hull_ < hulls_to_tell_.size()) {
      v1::HullVersion* const version = reply_.add_hulls();
      table_.EncodeHull(hulls_to_tell_[next_hull_++], version);
      reply_bytes_ += kEntryHeaderBytes + version->ByteSizeLong();
    } else if (next_piece_hull_ < piece_hulls_to_tell_.size()) {
      v1::HullVersion* const version = reply_.add_piece_hulls();
      const HullRecord& hull = piece_hulls_to_tell_[next_piece_hull_++];
      EncodeVersion(registry_.store(), hull, version);
      reply_bytes_ += kEntryHeaderBytes + version->ByteSizeLong();
    } else {
      v1::PlacementProblem* const problem = reply_.add_placement_problems();
      table_.EncodeProblem(problems_to_tell_[next_problem_++], problem);
      reply_bytes_ += kEntryHeaderBytes + problem->ByteSizeLong();
    }
  }
  return true;
}

absl::Status CollisionWatch::TellPair(WatchedPair& pair) {
  if (!table_.is_answerable(pair.a) || !table_.is_answerable(pair.b)) {
    if (pair.is_told()) AddEvent(v1::COLLISION_EVENT_KIND_LOST, pair, std::nullopt);
    pair.relation = v1::RELATION_SEPARATED;
    pair.is_within_clearance = false;
    return absl::OkStatus();
  }
  const auto [answer, of_body] = AskPlaced(table_, pair.a, pair.b, options_, &pair.cache);
  if (!answer.ok()) return answer.status();
  rungs_.Add(answer->rung);
  const v1::Relation relation = EncodeRelation(answer->relation);
  const bool is_within = answer->within_clearance.value_or(false);
  const v1::CollisionEventKind kind = KindOf(pair, relation, is_within);
  pair.relation = relation;
  pair.is_within_clearance = is_within;
  if (kind != v1::COLLISION_EVENT_KIND_UNSPECIFIED) AddEvent(kind, pair, of_body.pieces);
  return absl::OkStatus();
}

void CollisionWatch::AddEvent(v1::CollisionEventKind kind, const WatchedPair& pair,
                              const std::optional<PiecePair>& pieces) {
  v1::CollisionEvent* const event = reply_.add_events();
  event->set_kind(kind);
  event->set_placement_a(pair.a);
  event->set_placement_b(pair.b);
  if (kind != v1::COLLISION_EVENT_KIND_LOST) {
    const HullView& a = *table_.hull(*table_.hull_of(pair.a));
    const HullView& b = *table_.hull(*table_.hull_of(pair.b));
    event->set_relation(pair.relation);
    event->set_revision_a(a.record.revision);
    event->set_revision_b(b.record.revision);
    const auto encode_piece = [this](const HullView& view, uint32_t piece,
                                     v1::DecidingPiece* message) {
      message->set_index(piece);
      const HullRecord& hull = view.body->hull_of(piece).record;
      EncodeVersion(registry_.store(), hull, message->mutable_hull());
    };
    if (pieces && a.body != nullptr) encode_piece(a, pieces->a, event->mutable_piece_a());
    if (pieces && b.body != nullptr) encode_piece(b, pieces->b, event->mutable_piece_b());
    if (options_.clearance.has_value()) event->set_within_clearance(pair.is_within_clearance);
  }
  reply_bytes_ += kEntryHeaderBytes + event->ByteSizeLong();
}

}  // namespace hulld::server
