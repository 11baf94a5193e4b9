#include "server/collisions/scene_stream.h"

#include <algorithm>
#include <limits>
#include <memory>
#include <utility>

#include "core/query/collision.h"
#include "server/collisions/placed/query_settings.h"
#include "server/collisions/placed/scene_groups.h"
#include "server/wire/answer_columns.h"
#include "server/wire/decode.h"
#include "server/wire/encode.h"

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

// Adds `by` pairs of a relation, or without an answer. -1: modulo 2^64, as in the sums of AddTo.
void Count(v1::Relation relation, uint64_t by, v1::SceneTotals* totals) {
  switch (relation) {
    case v1::RELATION_SEPARATED:
      return totals->set_separated(totals->separated() + by);
    case v1::RELATION_TOUCHING:
      return totals->set_touching(totals->touching() + by);
    case v1::RELATION_OVERLAPPING:
      return totals->set_overlapping(totals->overlapping() + by);
    case v1::RELATION_WITHIN_TOLERANCE:
      return totals->set_within_tolerance(totals->within_tolerance() + by);
    default:
      return totals->set_failed(totals->failed() + by);
  }
}

// Returns the query for relation and clearance alone.
QueryOptions WithoutDetails(QueryOptions options) {
  options.want_axis = false;
  options.want_analysis = false;
  options.want_certificate = false;
  options.want_separation = false;
  options.want_witness = false;
  options.want_normal = false;
  return options;
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

SceneStream::SceneStream(CallContext& context, const CollisionParts& parts, const Bytes& request)
    : PiecedReplies(request, context, Rpc::kFindCollisions, parts,
                    {kFirstPlacements, kMostPlacements, kMostBoxesPerSlice}) {}

absl::Status SceneStream::Validate() {
  if (absl::Status s = DecodePlacements(v1::METHOD_UNSPECIFIED, "the scene"); !s.ok()) return s;
  if (absl::Status s = ValidateGroups(request(), table_.size()); !s.ok()) return s;
  ignored_groups_ = IgnoredGroups(request());
  options_.ignored_groups = ignored_groups_;
  options_.groups = {request().groups().data(), static_cast<size_t>(request().groups_size())};
  if (request().has_movers()) options_.movers = request().movers();
  // The box and at least one pair of each placement.
  expected_pairs_ = table_.size();
  return ValidateChoice();
}

absl::Status SceneStream::ValidateChoice() const {
  if (request().first_only() && request().has_limit()) {
    return absl::InvalidArgumentError("first_only and limit cannot be combined; omit one of them");
  }
  if (request().first_only() && !table_.has_motions()) {
    return absl::InvalidArgumentError(
        "first_only orders pairs by their first contact, but no placement has an end_pose; set "
        "one, or omit first_only");
  }
  if (request().every_piece() && request().has_limit()) {
    return absl::InvalidArgumentError("every_piece and limit cannot be combined; omit one of them");
  }
  if (request().every_piece() && table_.has_motions()) {
    return absl::InvalidArgumentError(
        "every_piece and end_pose cannot be combined; omit one of them, or query the pairs of "
        "pieces");
  }
  return request().has_limit() ? ValidateLimit() : absl::OkStatus();
}

absl::Status SceneStream::ValidateLimit() const {
  if (request().limit() == 0) {
    return absl::InvalidArgumentError("limit is 0; set it to at least 1, or omit it");
  }
  if (request().wanted().separation() && request().wanted().has_clearance()) {
    return absl::OkStatus();
  }
  return absl::InvalidArgumentError(
      "limit orders the pairs within a clearance by separation; set wanted.separation and "
      "wanted.clearance, which may be infinite");
}

absl::Status SceneStream::Prepare() {
  options_.bodies = table_.bodies();
  const bool moves = table_.has_motions();
  std::vector<Box> boxes(moves ? 0 : table_.size());
  std::vector<MovingBox> moving(moves ? table_.size() : 0);
  ShareOut(table_.size(), kBoxesPerStep, [&](size_t begin, size_t end) {
    if (call().ShouldStop()) return;
    for (size_t i = begin; i < end; ++i) {
      if (moves) {
        moving[i] = table_.MovingBoxAt(i);
      } else {
        boxes[i] = table_.BoxOf(i);
      }
    }
  });
  if (call().ShouldStop()) return call().StopStatus();
  if (request().has_limit()) {
    nearest_ =
        std::make_unique<NearestPairs>(request().limit(), boxes, query_.max_error.value_or(0));
    ranked_query_ = std::exchange(query_, WithoutDetails(query_));
  }
  if (request().first_only()) {
    first_ = std::make_unique<FirstPairs>(MemoryCharge(registry().memory(), MemoryUse::kReading));
    ranked_query_ = query_;
    ranked_motion_ = motion_options_;
    motion_options_.want_certificate = false;
  }
  piece_query_ = query_;
  piece_query_.threads = 1;
  options_.query = query_;
  absl::StatusOr<SceneSearch> search =
      moves ? SceneSearch::Make(table_.placed(), options_, std::move(moving))
            : SceneSearch::Make(table_.placed(), options_, std::move(boxes));
  if (!search.ok()) return search.status();
  search_ = *std::move(search);
  call().AddPairs(search_->pairs());
  return absl::OkStatus();
}

size_t SceneStream::HeldBytes() const {
  return table_.MemoryBytes() + ignored_groups_.capacity() * sizeof(GroupPair) +
         (search_.has_value() ? search_->MemoryBytes() : 0) +
         (nearest_ != nullptr && search_.has_value() ? nearest_->MaxMemoryBytes(search_->pairs())
                                                     : 0);
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
  if (piece.next >= search_->size()) return AdvanceRanked(piece, end);
  const uint64_t steps_per_look = table_.has_bodies() || table_.has_motions() ? 1 : kStepsPerPoll;
  for (uint64_t step = 1; step % steps_per_look != 0 || Clock::now() < end; ++step) {
    if (piece.next == piece.end) break;
    const auto a = static_cast<uint32_t>(piece.next);
    if (piece.bodies.has_value()) {
      if (absl::Status s = AdvanceBodies(a, piece); !s.ok()) return s;
      continue;
    }
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
    if (request().every_piece() && (table_.is_body(a) || table_.is_body(*b))) {
      OpenBodies(a, *b, piece);
      continue;
    }
    absl::StatusOr<PlacedAnswer> found = AskCandidate(a, *b, piece);
    if (!found.ok()) return found.status();
    if (found->answer.ok() && !search_->IsFound(*found->answer)) continue;
    if (nearest_ == nullptr && first_ == nullptr) {
      Count(AddFound(a, *b, *found, piece), 1, &piece.totals);
      continue;
    }
    const absl::Status ranked = first_ != nullptr ? RankFirst(a, *b, *found, piece)
                                                  : Rank(a, *b, std::move(found->answer), piece);
    if (!ranked.ok()) return ranked;
  }
  piece.EndReply();
  piece.is_done = piece.next == piece.end;
  return absl::OkStatus();
}

absl::Status SceneStream::AdvanceRanked(ScenePiece& piece, Clock::time_point end) {
  do {
    const RankedPair& pair = ranked_[piece.next - search_->size()];
    const PlacedAnswer found = AskPlaced(table_, pair.a, pair.b, ranked_query_, ranked_motion_);
    if (absl::IsCancelled(found.answer.status())) return found.answer.status();
    const v1::Relation relation = AddFound(pair.a, pair.b, found, piece);
    // Details such as a certificate may be refused.
    Count(pair.relation, uint64_t{0} - 1, &piece.totals);
    Count(relation, 1, &piece.totals);
    ++piece.next;
  } while (piece.next < piece.end && Clock::now() < end);
  piece.EndReply();
  piece.is_done = piece.next == piece.end;
  return absl::OkStatus();
}

absl::StatusOr<PlacedAnswer> SceneStream::AskCandidate(uint32_t a, uint32_t b, ScenePiece& piece) {
  PlacedAnswer found;
  if (table_.has_motions()) {
    found = AskPlaced(table_, a, b, query_, motion_options_);
  } else {
    found.answer = search_->Ask(a, b, &found.of_body);
    if (!found.answer.ok()) {
      found.answer = NameLimit(table_, a, b, found.answer.status(), query_);
    }
  }
  if (absl::IsCancelled(found.answer.status())) return found.answer.status();
  piece.totals.set_candidates(piece.totals.candidates() + 1);
  if (found.answer.ok() && !found.contact.has_value()) piece.rungs.Add(found.answer->rung);
  return found;
}

absl::Status SceneStream::Rank(uint32_t a, uint32_t b, absl::StatusOr<Answer> answer,
                               ScenePiece& piece) {
  const bool may_be_near =
      answer.ok() && (answer->relation == Relation::kOverlapping || nearest_->MayBeNear(a, b));
  if (may_be_near) {
    QueryOptions query = query_;
    query.want_separation = true;
    answer = AskAtRest(table_, a, b, query, nullptr).answer;
  }
  if (absl::IsCancelled(answer.status())) return answer.status();
  const v1::Relation relation =
      answer.ok() ? EncodeRelation(answer->relation) : v1::RELATION_UNSPECIFIED;
  Count(relation, 1, &piece.totals);
  if (!answer.ok()) {
    nearest_->AddUnanswered(a, b);
  } else if (may_be_near) {
    nearest_->Add({answer->separation->value, a, b, relation});
  }
  return absl::OkStatus();
}

absl::Status SceneStream::RankFirst(uint32_t a, uint32_t b, const PlacedAnswer& answer,
                                    ScenePiece& piece) {
  const v1::Relation relation =
      answer.answer.ok() ? EncodeRelation(answer.answer->relation) : v1::RELATION_UNSPECIFIED;
  Count(relation, 1, &piece.totals);
  constexpr double kNever = std::numeric_limits<double>::infinity();
  const bool grew = answer.answer.ok()
                        ? first_->Add({answer.contact->separated_until, a, b, relation},
                                      answer.contact->contact_time.value_or(kNever))
                        : first_->AddUnanswered(a, b);
  return grew ? registry().CheckMemory(MemoryUse::kReading) : absl::OkStatus();
}

void SceneStream::OpenBodies(uint32_t a, uint32_t b, ScenePiece& piece) const {
  piece.totals.set_candidates(piece.totals.candidates() + 1);
  const PlacedBody& body_a = table_.bodies()[a];
  const PlacedBody& body_b = table_.bodies()[b];
  const double reach = piece_query_.clearance.value_or(0);
  piece.bodies.emplace(ScenePiece::Bodies{
      b, MeetingPieces(
             body_a.body(), body_b.body(),
             [&body_a, reach](uint32_t i) {
               return GrownBy(BoundingBox(PlacedPiece(body_a, i).placed()), reach);
             },
             [&body_b](uint32_t i) { return BoundingBox(PlacedPiece(body_b, i).placed()); })});
}

absl::Status SceneStream::AdvanceBodies(uint32_t a, ScenePiece& piece) {
  const uint32_t b = piece.bodies->b;
  const std::optional<PiecePair> pieces = piece.bodies->pieces.Next();
  if (!pieces.has_value()) {
    piece.bodies.reset();
    return absl::OkStatus();
  }
  const PlacedPiece piece_a(table_.bodies()[a], pieces->a);
  const PlacedPiece piece_b(table_.bodies()[b], pieces->b);
  PlacedAnswer found = {CheckCollision(piece_a.placed(), piece_b.placed(), piece_query_)};
  if (absl::IsCancelled(found.answer.status())) return found.answer.status();
  if (found.answer.ok()) {
    Answer& answer = *found.answer;
    piece.rungs.Add(answer.rung);
    if (!search_->IsFound(answer)) return absl::OkStatus();
    found.of_body.pieces = pieces;
    if (answer.certificate.has_value()) {
      found.of_body.certificates.push_back(
          {*pieces, answer.relation, *std::move(answer.certificate)});
      answer.certificate = {};
    }
  } else {
    found.answer = NameQueryLimit(found.answer.status(), piece_query_);
  }
  Count(AddFound(a, b, found, piece), 1, &piece.totals);
  return absl::OkStatus();
}

uint64_t SceneStream::CountFollowingUnits() {
  if (nearest_ == nullptr && first_ == nullptr) return 0;
  std::vector<RankedPair> ranked = first_ != nullptr ? first_->Take() : nearest_->Take();
  if (ranked.empty()) return 0;
  ranked_ = std::move(ranked);
  return ranked_.size();
}

v1::Relation SceneStream::AddFound(uint32_t a, uint32_t b, const PlacedAnswer& answer,
                                   ScenePiece& piece) {
  v1::FindCollisionsResponse& rows = piece.rows;
  rows.add_pairs(a);
  rows.add_pairs(b);
  piece.row_bytes += kPairBytes + AddPlacedAnswer(table_, a, b, answer, request().wanted(),
                                                  rows.mutable_columns());
  const v1::Relation relation = rows.columns().relations(rows.pairs_size() / 2 - 1);
  if (piece.row_bytes >= FullMessageBytes(request().wanted())) piece.EndReply();
  return relation;
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
