#include "server/collisions/scene_stream.h"

#include <algorithm>
#include <memory>
#include <utility>

#include "server/collisions/placed/query_settings.h"
#include "server/collisions/placed/scene_groups.h"
#include "server/wire/answer_columns.h"
#include "server/wire/decode.h"

namespace hulld::server {
namespace {

// The first pieces are small, because the number of candidates is unknown; the largest bounds the
// damage of a wrong estimate.
constexpr uint64_t kFirstPlacements = 4;
constexpr uint64_t kMostPlacements = 1024;
// Building the tree of this many placements takes about a slice.
constexpr int kMostBoxesPerSlice = 512;
// Candidates, placements or gathering steps between two reads of the clock, and nodes per gathering
// step, which takes about as long as a candidate.
constexpr uint64_t kStepsPerPoll = 16;
constexpr uint64_t kNodesPerStep = 16;
// Placements per step of computing boxes: some 100 us.
constexpr size_t kBoxesPerStep = 256;
// Two indices of a pair, as varints.
constexpr size_t kPairBytes = 10;

void Count(v1::Relation relation, v1::SceneTotals* totals) {
  switch (relation) {
    case v1::RELATION_SEPARATED:
      return totals->set_separated(totals->separated() + 1);
    case v1::RELATION_TOUCHING:
      return totals->set_touching(totals->touching() + 1);
    case v1::RELATION_OVERLAPPING:
      return totals->set_overlapping(totals->overlapping() + 1);
    case v1::RELATION_WITHIN_TOLERANCE:
      return totals->set_within_tolerance(totals->within_tolerance() + 1);
    default:
      return totals->set_failed(totals->failed() + 1);
  }
}

void AddTo(v1::SceneTotals* sums, const v1::SceneTotals& totals) {
  sums->set_candidates(sums->candidates() + totals.candidates());
  sums->set_separated(sums->separated() + totals.separated());
  sums->set_touching(sums->touching() + totals.touching());
  sums->set_overlapping(sums->overlapping() + totals.overlapping());
  sums->set_within_tolerance(sums->within_tolerance() + totals.within_tolerance());
  sums->set_failed(sums->failed() + totals.failed());
}

}  // namespace

WriteReactor* SceneStream::Start(grpc::CallbackServerContext& context, Admission& admission,
                                 Registry& registry, const PieceThreads& threads,
                                 const grpc::ByteBuffer& request) {
  return Launch(std::shared_ptr<SceneStream>(
      new SceneStream(context, admission, registry, threads, request)));
}

SceneStream::SceneStream(grpc::CallbackServerContext& context, Admission& admission,
                         Registry& registry, const PieceThreads& threads,
                         const grpc::ByteBuffer& request)
    : PiecedReplies(request, context, admission, Rpc::kFindCollisions, registry, threads,
                    {kFirstPlacements, kMostPlacements}) {}

bool SceneStream::IsShort() const {
  return request().placements_size() + request().packed_placements().hulls_size() <=
         kMostBoxesPerSlice;
}

absl::Status SceneStream::Validate() {
  absl::StatusOr<QueryOptions> options =
      MakeQueryOptions(v1::METHOD_UNSPECIFIED, request().wanted(), request().tolerance(),
                       registry().limits(), call().lifetime());
  if (!options.ok()) return options.status();
  const absl::StatusOr<Freshness> freshness =
      DecodeFreshness(request().freshness(), registry().store(), call().arrival());
  if (!freshness.ok()) return freshness.status();
  freshness_ = *freshness;
  absl::StatusOr<PlacementTable> table =
      PlacementTable::Make(request().placements(), *own_request().mutable_packed_placements(),
                           call().caller(), registry().limits().max_placements, "the scene");
  if (!table.ok()) return table.status();
  table_ = *std::move(table);
  if (table_.has_motions()) {
    if (absl::Status s = ValidateForMotions(*options); !s.ok()) return s;
    motion_options_ = MakeMotionOptions(request().wanted(), *options);
  }
  if (absl::Status s = ValidateGroups(request(), table_.size()); !s.ok()) return s;
  ignored_groups_ = IgnoredGroups(request());
  options_.ignored_groups = ignored_groups_;
  options_.groups = {request().groups().data(), static_cast<size_t>(request().groups_size())};
  if (request().has_movers()) options_.movers = request().movers();
  options_.query = *std::move(options);
  return absl::OkStatus();
}

absl::StatusOr<bool> SceneStream::ResolveHulls(bool may_wait) {
  // Expects the box and at least one pair of each placement.
  const ReadPlan plan = {2 * table_.size() / std::max<size_t>(1, table_.hull_count()), true,
                         freshness_};
  if (!may_wait) return table_.TryResolve(registry(), options_.query, plan);
  if (absl::Status s = table_.Resolve(registry(), options_.query, plan); !s.ok()) return s;
  return true;
}

absl::Status SceneStream::Prepare() {
  options_.bodies = table_.bodies();
  std::vector<Box> boxes(table_.size());
  ShareOut(boxes.size(), kBoxesPerStep, [&](size_t begin, size_t end) {
    if (call().ShouldStop()) return;
    for (size_t i = begin; i < end; ++i) boxes[i] = table_.BoxOf(i);
  });
  if (call().ShouldStop()) return call().StopStatus();
  absl::StatusOr<SceneSearch> search =
      SceneSearch::Make(table_.placed(), options_, std::move(boxes));
  if (!search.ok()) return search.status();
  search_ = *std::move(search);
  call().AddPairs(search_->pairs());
  return absl::OkStatus();
}

size_t SceneStream::HeldBytes() const {
  return table_.MemoryBytes() + ignored_groups_.capacity() * sizeof(GroupPair) +
         (search_.has_value() ? search_->MemoryBytes() : 0);
}

bool SceneStream::QueueHead() {
  v1::FindCollisionsResponse head;
  if (next_row_ == 0) table_.EncodeHeader(registry().store(), head.mutable_header());
  next_row_ = table_.EncodeHulls(next_row_, &head);
  const size_t bytes = head.ByteSizeLong();
  Queue(std::move(head), bytes);
  return next_row_ < table_.table_rows();
}

absl::Status SceneStream::Advance(ScenePiece& piece, Clock::time_point end) {
  v1::FindCollisionsResponse reply;
  size_t reply_bytes = 0;
  const uint64_t steps_per_look = table_.has_bodies() || table_.has_motions() ? 1 : kStepsPerPoll;
  for (uint64_t step = 1; step % steps_per_look != 0 || Clock::now() < end; ++step) {
    if (piece.next == piece.end) break;
    const auto a = static_cast<uint32_t>(piece.next);
    if (!piece.has_candidates) {
      piece.candidates.Start(*search_, a);
      piece.has_candidates = true;
    }
    if (!piece.candidates.Gather(kNodesPerStep)) continue;
    const std::optional<uint32_t> b = piece.candidates.Next();
    if (!b.has_value()) {
      piece.has_candidates = false;
      ++piece.next;
      continue;
    }
    PlacedAnswer answer;
    if (table_.has_motions()) {
      answer = AskMoving(table_, a, *b, motion_options_);
    } else {
      answer.answer = search_->Ask(a, *b, &answer.of_body);
    }
    if (absl::IsCancelled(answer.answer.status())) return answer.answer.status();
    if (!answer.answer.ok()) {
      answer.answer = NameLimit(table_, a, *b, answer.answer.status(), options_.query);
    }
    piece.totals.set_candidates(piece.totals.candidates() + 1);
    if (answer.answer.ok() && !answer.contact.has_value()) piece.rungs.Add(answer.answer->rung);
    if (answer.answer.ok() && !search_->IsFound(*answer.answer)) continue;
    reply_bytes += AddFound(a, *b, answer, piece, &reply);
    if (reply_bytes < FullMessageBytes(request().wanted())) continue;
    piece.Add(std::exchange(reply, {}));
    reply_bytes = 0;
  }
  if (reply.pairs_size() > 0) piece.Add(std::move(reply));
  piece.is_done = piece.next == piece.end;
  return absl::OkStatus();
}

size_t SceneStream::AddFound(uint32_t a, uint32_t b, const PlacedAnswer& answer, ScenePiece& piece,
                             v1::FindCollisionsResponse* reply) {
  const int position = reply->pairs_size() / 2;
  reply->add_pairs(a);
  reply->add_pairs(b);
  const size_t bytes =
      AddPlacedAnswer(table_, a, b, answer, request().wanted(), reply->mutable_columns());
  Count(reply->columns().relations(position), &piece.totals);
  return kPairBytes + bytes;
}

void SceneStream::Deliver(ScenePiece& piece) {
  AddTo(&totals_, std::exchange(piece.totals, {}));
  call().metrics().CountPairs(std::exchange(piece.rungs, {}));
  DeliverReplies(piece);
}

// Messages of the head hold no answers.
bool SceneStream::Join(const v1::FindCollisionsResponse& reply,
                       v1::FindCollisionsResponse* waiting) {
  if (waiting->pairs_size() == 0 || NamesRows(reply.columns())) return false;
  waiting->MergeFrom(reply);
  return true;
}

void SceneStream::OnAllDelivered() {
  v1::FindCollisionsResponse last;
  totals_.set_pairs(search_->pairs());
  *last.mutable_totals() = totals_;
  QueueOrJoin(std::move(last), totals_.ByteSizeLong());
}

}  // namespace hulld::server
