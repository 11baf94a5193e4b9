#include <absl/status/status.h>
#include <grpcpp/grpcpp.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "core/base/status_macros.h"
#include "core/query/body/meeting_pieces.h"
#include "core/query/collision.h"
#include "core/query/motion/first_contact.h"
#include "core/query/scene/scene.h"
#include "hulld/v1/collision.pb.h"
#include "server/collisions/collision_service.h"
#include "server/collisions/pieced_replies.h"
#include "server/collisions/placed/placed_answer.h"
#include "server/collisions/placed/placement_table.h"
#include "server/collisions/placed/query_settings.h"
#include "server/collisions/ranked_pairs.h"
#include "server/contract/errors.h"
#include "server/process/task_pool.h"
#include "server/registry/registry.h"
#include "server/wire/answer_columns.h"
#include "server/wire/decode.h"
#include "server/wire/encode.h"

namespace hulld::server {
namespace {

// The first pieces are small because the number of candidates is unknown. The maximum bounds the
// damage of a wrong estimate.
constexpr uint64_t kFirstPlacements = 4;
constexpr uint64_t kMaxPlacements = 1024;
// Building the tree of this many placements takes about a slice.
constexpr int kMaxBoxesPerSlice = 512;
// Candidates, placements, or gathering steps between two reads of the clock; also the nodes per
// gathering step, which takes about as long as a candidate.
constexpr uint64_t kStepsPerPoll = 16;
constexpr uint64_t kNodesPerStep = 16;
// Placements per step of computing boxes, which takes about 100 us.
constexpr size_t kBoxesPerStep = 256;
// Two indices of a pair, as varints.
constexpr size_t kPairBytes = 10;

// Returns the query for only relation and clearance.
QueryOptions WithoutDetails(QueryOptions options) {
  options.want_axis = false;
  options.want_analysis = false;
  options.want_certificate = false;
  options.want_separation = false;
  options.want_witness = false;
  options.want_normal = false;
  return options;
}

// Counts of candidates, and of found pairs by relation; UNSPECIFIED: without an answer.
struct PairCounts {
  uint64_t candidates = 0;
  std::array<uint64_t, v1::Relation_ARRAYSIZE> found = {};
};

// A range of placements, each to be queried against its successors, or of ranked pairs.
struct ScenePiece : Piece<v1::FindCollisionsResponse> {
  // Remaining candidates of placement `next`, if it was started.
  bool has_candidates = false;
  SceneCandidates candidates;
  // A candidate whose pairs of pieces are answered one by one.
  struct Bodies {
    uint32_t b;
    MeetingPieces pieces;
  };
  std::optional<Bodies> bodies;
  // Counts since the last delivery of the piece.
  PairCounts counts;

  size_t held_bytes() const {
    return candidates.MemoryBytes() + row_bytes +
           (bodies.has_value() ? bodies->pieces.MemoryBytes() : 0);
  }
};

// A FindCollisions call: resolves each hull once and builds the tree of boxes, on a reader thread,
// then searches ranges of placements on all threads of the pool. Both gathering and querying the
// candidates of a placement are split into slices. With a limit or first_only, this search only
// ranks the pairs. The units that follow are the nearest or the first pairs, which are then
// answered.
class SceneStream
    : public PiecedReplies<v1::FindCollisionsRequest, v1::FindCollisionsResponse, ScenePiece> {
 public:
  SceneStream(CallContext& context, const ServiceParts& parts, const Bytes& request)
      : PiecedReplies(request, context, Rpc::kFindCollisions, parts,
                      {.first_units = kFirstPlacements,
                       .max_units = kMaxPlacements,
                       .max_short_placements = kMaxBoxesPerSlice,
                       .joins_head = false,
                       .steps_per_poll = kStepsPerPoll}) {}

 private:
  absl::Status Validate() override {
    HULLD_RETURN_IF_ERROR(DecodePlacements(v1::METHOD_UNSPECIFIED, "the scene"));
    HULLD_RETURN_IF_ERROR(ValidateGroups(request(), table_.size()));
    ignored_groups_ = IgnoredGroups(request());
    options_.ignored_groups = ignored_groups_;
    options_.groups = {request().groups().data(), static_cast<size_t>(request().groups_size())};
    if (request().has_movers()) options_.movers = request().movers();
    // The box, and at least one pair, of each placement.
    expected_pairs_ = table_.size();
    return ValidateSelection();
  }

  absl::Status Prepare() override {
    options_.bodies = table_.bodies();
    const bool moves = table_.has_motions();
    std::vector<Box> boxes(moves ? 0 : table_.size());
    std::vector<MovingBox> moving(moves ? table_.size() : 0);
    ParallelFor(table_.size(), kBoxesPerStep, [&](size_t begin, size_t end) {
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
    ranked_query_ = query_;
    if (request().has_limit()) {
      ranking_ =
          std::make_unique<RankedPairs>(request().limit(), boxes, query_.max_error.value_or(0));
      query_ = WithoutDetails(query_);
    }
    if (request().first_only()) {
      ranking_ =
          std::make_unique<RankedPairs>(MemoryCharge(registry().memory(), MemoryUse::kReading));
      motion_options_.want_certificate = false;
    }
    options_.query = query_;
    HULLD_ASSIGN_OR_RETURN(search_,
                           moves ? SceneSearch::Make(table_.placed(), options_, std::move(moving))
                                 : SceneSearch::Make(table_.placed(), options_, std::move(boxes)));
    call().AddPairs(search_->pairs());
    return absl::OkStatus();
  }

  absl::Status Step(ScenePiece& piece, Clock::time_point /*end*/) override {
    if (!ranked_.empty()) return AnswerRanked(piece);
    const auto a = static_cast<uint32_t>(piece.next);
    if (piece.bodies.has_value()) return AdvanceBodies(a, piece);
    if (!piece.has_candidates) {
      piece.candidates.Start(*search_, a);
      piece.has_candidates = true;
    }
    if (!piece.candidates.Gather(kNodesPerStep)) return absl::OkStatus();
    const std::optional<uint32_t> b = piece.candidates.Next();
    if (!b.has_value()) {
      piece.has_candidates = false;
      ++piece.next;
      return absl::OkStatus();
    }
    if (request().every_piece() && (table_.is_body(a) || table_.is_body(*b))) {
      OpenBodies(a, *b, piece);
      return absl::OkStatus();
    }
    HULLD_ASSIGN_OR_RETURN(PlacedAnswer found, QueryCandidate(a, *b, piece));
    if (found.answer.ok() && !search_->IsFound(*found.answer)) return absl::OkStatus();
    if (ranking_ != nullptr) return Rank(a, *b, std::move(found), piece);
    ++piece.counts.found[AddFound(a, *b, found, piece)];
    return absl::OkStatus();
  }

  size_t HeldBytes() const override {
    size_t bytes = table_.MemoryBytes() + ignored_groups_.capacity() * sizeof(GroupPair);
    if (!search_.has_value()) return bytes;
    if (request().has_limit()) bytes += ranking_->MaxMemoryBytes(search_->pairs());
    return bytes + search_->MemoryBytes();
  }

  // The functions below require the mutex.
  uint64_t CountUnits() override { return search_->size(); }
  uint64_t CountFollowingUnits() override {
    if (ranking_ == nullptr || !ranked_.empty()) return 0;
    ranked_ = ranking_->Take();
    query_ = ranked_query_;
    motion_options_.want_certificate = query_.want_certificate;
    steps_per_poll_ = 1;
    return ranked_.size();
  }

  void Deliver(ScenePiece& piece) override {
    const PairCounts counts = std::exchange(piece.counts, {});
    counts_.candidates += counts.candidates;
    for (size_t i = 0; i < counts.found.size(); ++i) counts_.found[i] += counts.found[i];
    PiecedReplies::Deliver(piece);
  }

  void OnAllDelivered() override {
    v1::FindCollisionsResponse last;
    v1::SceneTotals& totals = *last.mutable_totals();
    totals.set_pairs(search_->pairs());
    totals.set_candidates(counts_.candidates);
    totals.set_separated(counts_.found[v1::RELATION_SEPARATED]);
    totals.set_touching(counts_.found[v1::RELATION_TOUCHING]);
    totals.set_overlapping(counts_.found[v1::RELATION_OVERLAPPING]);
    totals.set_within_tolerance(counts_.found[v1::RELATION_WITHIN_TOLERANCE]);
    totals.set_failed(counts_.found[v1::RELATION_UNSPECIFIED]);
    const size_t bytes = totals.ByteSizeLong();
    QueueOrJoin(std::move(last), bytes);
  }

  // Called without the mutex.
  absl::Status ValidateSelection() const {
    const bool has_limit = request().has_limit();
    const bool moves = table_.has_motions();
    const v1::Wanted& wanted = request().wanted();
    const std::pair<bool, const char*> errors[] = {
        {request().first_only() && has_limit,
         "first_only and limit cannot be combined; omit one of them"},
        {request().first_only() && !moves,
         "first_only orders pairs by their first contact, but no placement has an end_pose; set "
         "one, "
         "or omit first_only"},
        {request().every_piece() && has_limit,
         "every_piece and limit cannot be combined; omit one of them"},
        {request().every_piece() && moves,
         "every_piece and end_pose cannot be combined; omit one of them, or query the pairs of "
         "pieces"},
        {has_limit && request().limit() == 0, "limit is 0; set it to at least 1, or omit it"},
        {has_limit && !(wanted.separation() && wanted.has_clearance()),
         "limit orders the pairs within a clearance by separation; set wanted.separation and "
         "wanted.clearance, which may be infinite"},
    };
    for (const auto& [is_wrong, message] : errors) {
      if (is_wrong) return InvalidArgument(message);
    }
    return absl::OkStatus();
  }

  // Answers the next ranked pair. CANCELLED.
  absl::Status AnswerRanked(ScenePiece& piece) {
    const RankedPair& pair = ranked_[piece.next - search_->size()];
    const PlacedAnswer found = request().first_only()
                                   ? QueryFirst(pair.a, pair.b, motion_options_)
                                   : QueryPlaced(table_, pair.a, pair.b, query_, motion_options_);
    if (absl::IsCancelled(found.answer.status())) return found.answer.status();
    ++piece.next;
    // The pair was ranked, or failed, before the first contact was known.
    if (found.answer.ok() && !search_->IsFound(*found.answer)) return absl::OkStatus();
    // Details such as a certificate may be refused. Counts are modulo 2^64, and so are their sums.
    if (request().has_limit()) --piece.counts.found[pair.relation];
    ++piece.counts.found[AddFound(pair.a, pair.b, found, piece)];
    return absl::OkStatus();
  }

  // Starts to answer the pairs of pieces of a candidate.
  void OpenBodies(uint32_t a, uint32_t b, ScenePiece& piece) const {
    ++piece.counts.candidates;
    const PlacedBody& body_a = table_.bodies()[a];
    const PlacedBody& body_b = table_.bodies()[b];
    const double reach = query_.clearance.value_or(0);
    piece.bodies.emplace(ScenePiece::Bodies{
        b, MeetingPieces(
               body_a.body(), body_b.body(),
               [&body_a, reach](uint32_t i) {
                 return GrownBy(BoundingBox(PlacedPiece(body_a, i).placed()), reach);
               },
               [&body_b](uint32_t i) { return BoundingBox(PlacedPiece(body_b, i).placed()); })});
  }

  // Answers one of these pairs. CANCELLED.
  absl::Status AdvanceBodies(uint32_t a, ScenePiece& piece) {
    const uint32_t b = piece.bodies->b;
    const std::optional<PiecePair> pieces = piece.bodies->pieces.Next();
    if (!pieces.has_value()) {
      piece.bodies.reset();
      return absl::OkStatus();
    }
    const PlacedPiece piece_a(table_.bodies()[a], pieces->a);
    const PlacedPiece piece_b(table_.bodies()[b], pieces->b);
    PlacedAnswer found = {CheckCollision(piece_a.placed(), piece_b.placed(), query_)};
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
      found.answer = NameLimit(found.answer.status(), query_);
    }
    ++piece.counts.found[AddFound(a, b, found, piece)];
    return absl::OkStatus();
  }

  // Answers a candidate and counts it. In a scene with a limit, answers only its relation and
  // clearance. CANCELLED.
  absl::StatusOr<PlacedAnswer> QueryCandidate(uint32_t a, uint32_t b, ScenePiece& piece) {
    PlacedAnswer found;
    if (request().first_only()) {
      found = QueryFirst(a, b, motion_options_);
    } else if (table_.has_motions()) {
      found = QueryPlaced(table_, a, b, query_, motion_options_);
    } else {
      found.answer = search_->Query(a, b, &found.of_body);
      if (!found.answer.ok()) found.answer = NameLimit(found.answer.status(), query_);
    }
    if (absl::IsCancelled(found.answer.status())) return found.answer.status();
    ++piece.counts.candidates;
    if (found.answer.ok() && !found.contact.has_value()) piece.rungs.Add(found.answer->rung);
    return found;
  }

  // Answers a pair of a scene with first_only. The pair counts as separated if it is separated
  // until the earliest known contact.
  PlacedAnswer QueryFirst(uint32_t a, uint32_t b, MotionOptions motion) const {
    motion.latest = std::min(1.0, ranking_->earliest());
    if (!search_->MayMeet(a, b, motion.latest)) return {Answer()};
    return QueryPlaced(table_, a, b, query_, motion);
  }

  // Ranks a found pair by its separation or, in motion, its first contact. CANCELLED.
  // RESOURCE_EXHAUSTED: --memory-limit.
  absl::Status Rank(uint32_t a, uint32_t b, PlacedAnswer found, ScenePiece& piece) {
    const absl::StatusOr<Answer>& answer = found.answer;
    const bool may_be_near =
        request().has_limit() && answer.ok() &&
        (answer->relation == Relation::kOverlapping || ranking_->MayBeNear(a, b));
    if (may_be_near) {
      QueryOptions query = query_;
      query.want_separation = true;
      found = QueryAtRest(table_, a, b, query, nullptr);
    }
    if (absl::IsCancelled(answer.status())) return answer.status();
    const v1::Relation relation =
        answer.ok() ? EncodeRelation(answer->relation) : v1::RELATION_UNSPECIFIED;
    if (request().has_limit()) ++piece.counts.found[relation];
    bool grew = false;
    if (!answer.ok()) {
      grew = ranking_->AddUnanswered(a, b);
    } else if (found.contact.has_value()) {
      grew = ranking_->Add({found.contact->separated_until, a, b, relation},
                           found.contact->contact_time.value_or(RankedPairs::kNever));
    } else if (may_be_near) {
      grew = ranking_->Add({answer->separation->value, a, b, relation});
    }
    return grew ? registry().CheckMemory(MemoryUse::kReading) : absl::OkStatus();
  }

  // Adds a row; returns its relation.
  v1::Relation AddFound(uint32_t a, uint32_t b, const PlacedAnswer& answer, ScenePiece& piece) {
    v1::FindCollisionsResponse& rows = piece.rows;
    rows.add_pairs(a);
    rows.add_pairs(b);
    const size_t bytes =
        AddPlacedAnswer(table_, a, b, answer, request().wanted(), rows.mutable_columns());
    const v1::Relation relation = rows.columns().relations(rows.pairs_size() / 2 - 1);
    EndRow(piece, kPairBytes + bytes);
    return relation;
  }

  // Written before the first piece.
  SceneOptions options_;
  std::vector<GroupPair> ignored_groups_;
  std::optional<SceneSearch> search_;
  // With a limit or first_only: the query of the pairs that are answered at the end, and the pairs
  // ranked so far.
  QueryOptions ranked_query_;
  std::unique_ptr<RankedPairs> ranking_;
  // Written before the first piece of ranked pairs.
  std::vector<RankedPair> ranked_;

  // Guarded by the mutex.
  PairCounts counts_;
};

}  // namespace

WriteReactor* StartScene(CallContext& context, const ServiceParts& parts, const Bytes& request) {
  return SceneStream::Launch(std::make_shared<SceneStream>(context, parts, request));
}

}  // namespace hulld::server
