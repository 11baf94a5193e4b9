#include <absl/status/status.h>

#include <algorithm>
#include <memory>
#include <optional>
#include <set>
#include <string_view>
#include <vector>

#include "core/base/status_macros.h"
#include "core/query/motion/first_contact.h"
#include "core/query/terms/query_options.h"
#include "hulld/v1/collision.pb.h"
#include "server/call/service_parts.h"
#include "server/call/unary_call.h"
#include "server/collisions/collision_service.h"
#include "server/collisions/placed/placed_answer.h"
#include "server/collisions/placed/placement_table.h"
#include "server/collisions/placed/query_settings.h"
#include "server/contract/errors.h"
#include "server/process/metrics.h"
#include "server/process/task_pool.h"
#include "server/registry/catalog/body.h"
#include "server/settings/config.h"
#include "server/wire/decode.h"
#include "server/wire/encode.h"

namespace hulld::server {
namespace {

using CheckCall = UnaryCall<v1::CheckCollisionRequest, v1::CheckCollisionResponse>;

// The placements of a pair, as indices into its table.
constexpr uint32_t kA = 0;
constexpr uint32_t kB = 1;
// Maximum number of waiting calls that the committing thread answers itself after a store query,
// instead of dispatching them. 32 queries of about 10 us delay its commits by about a round trip.
constexpr size_t kMaxAnsweredInTurn = 32;

// a, b: the deciding hulls; canonical if the answer names vertices.
absl::Status EncodeAnswer(const hulld::Answer& answer, const QueryHull& a, const QueryHull& b,
                          const v1::Wanted& wanted, v1::CheckCollisionResponse* response) {
  response->set_rung(EncodeRung(answer.rung));
  if (answer.analysis) {
    EncodeAnalysis(*answer.analysis, a.hull(), b.hull(), response->mutable_analysis());
  }
  if (answer.certificate) {
    EncodeCertificate(*answer.certificate, a.hull(), b.hull(), response->mutable_certificate());
  }
  if (answer.separation) EncodeSeparation(*answer.separation, response->mutable_separation());
  if (answer.witness) EncodeWitness(*answer.witness, response->mutable_witness());
  if (answer.normal) EncodeNormal(*answer.normal, response->mutable_normal());
  if (answer.within_clearance) response->set_within_clearance(*answer.within_clearance);
  if (!wanted.axis() || !answer.axis.has_value()) return absl::OkStatus();
  return EncodeAxis(*answer.axis, a.hull(), b.hull(), response->mutable_axis());
}

// A CheckCollision call for two placements, answered in slices (PairSearch). Used by one thread at
// a time.
class PairQuery : public std::enable_shared_from_this<PairQuery> {
 public:
  // Answers the call, which must be admitted.
  static void Start(const ServiceParts& parts, CheckCall* call) {
    parts.pool.NoteSingleCall();
    const std::shared_ptr<PairQuery> query(new PairQuery(parts, call));
    if (absl::Status s = query->ReadRequest(); !s.ok()) return call->End(s);
    if (query->TryAnswer()) return;
    // A store with peer servers is queried first. No thread waits for its reply.
    const auto answer = [query](const absl::Status& status) {
      if (!status.ok()) return query->call_->End(status);
      const bool may_answer = query->parts_.waiting.count() < kMaxAnsweredInTurn;
      if (!may_answer || !query->TryAnswer()) query->AnswerLater();
    };
    const bool waits = parts.waiting.AwaitFresh(parts.registry, query->plan_.freshness,
                                                query->options_.should_stop, answer);
    if (!waits) query->AnswerLater();
  }

 private:
  PairQuery(const ServiceParts& parts, CheckCall* call)
      : parts_(parts), call_(call), charge_(parts.registry.memory(), MemoryUse::kReading) {}

  // Reads everything except the hulls.
  absl::Status ReadRequest() {
    const v1::CheckCollisionRequest& request = call_->request();
    const Call& call = call_->call();
    HULLD_ASSIGN_OR_RETURN(options_,
                           MakeQueryOptions(request.method(), request.wanted(), request.tolerance(),
                                            parts_.registry.limits(), call.lifetime()));
    if (!request.has_a() || !request.has_b()) {
      return InvalidArgument(request.has_a() ? "b" : "a", " is missing; give a hull ID or points");
    }
    HULLD_ASSIGN_OR_RETURN(table_,
                           PlacementTable::MakePair(request.a(), request.b(), call.caller()));
    const bool is_of_a = request.a().radius() > 0;
    const double radius = is_of_a ? request.a().radius() : request.b().radius();
    if (options_.method == Method::kTextbookSat && radius > 0) {
      return InvalidArgument(
          is_of_a ? "a" : "b", ".radius is ", radius,
          ", but METHOD_TEXTBOOK_SAT applies to hulls without a radius; omit one of them");
    }
    if (table_.has_motions()) {
      HULLD_RETURN_IF_ERROR(ValidateForMotions(options_));
      motion_options_ = MakeMotionOptions(request.wanted(), options_);
    }
    HULLD_ASSIGN_OR_RETURN(const Freshness freshness,
                           DecodeFreshness(request.freshness(), parts_.store, call.arrival()));
    plan_.freshness = freshness;
    return absl::OkStatus();
  }

  // Resolves the hulls on a reader thread, which may wait for the store and build canonical
  // snapshots and boxes of pieces, then answers.
  void AnswerLater() {
    const auto answer = [this, self = shared_from_this()] {
      const absl::Status resolved = table_.Resolve(parts_.registry, options_, plan_);
      if (!resolved.ok()) return call_->End(resolved);
      AnswerResolved();
    };
    parts_.readers.Submit(answer, call_->call().client());
  }

  // Like AnswerLater, but on this thread. Returns false, without blocking, if it would have to wait
  // or build.
  bool TryAnswer() {
    ReadPlan plan = plan_;
    plan.may_wait = false;
    if (!table_.Resolve(parts_.registry, options_, plan).ok()) return false;
    AnswerResolved();
    return true;
  }

  // Ends the call. Computes an answer immediately if that takes a few microseconds; otherwise on
  // the pool, with the first slice ahead of those of batches.
  void AnswerResolved() {
    if (absl::Status s = Begin(); !s.ok()) return call_->End(s);
    // Answers to a client with many calls take turns in the pool, because gRPC's threads process
    // calls in the order of arrival.
    const bool is_quick = WantsRelationsOfHulls(options_, table_) &&
                          IsQuickToRelate(table_.HullAt(kA)) &&
                          IsQuickToRelate(table_.HullAt(kB)) && !call_->call().is_client_busy();
    if (is_quick) return RunSlice();
    parts_.pool.Submit([self = shared_from_this()] { self->RunSlice(); }, call_->call().client());
  }

  absl::Status Begin() {
    for (const uint32_t i : {kA, kB}) {
      if (!table_.is_answerable(i)) return table_.problem(i);
    }
    v1::CheckCollisionResponse& response = call_->response();
    EncodeHeader(parts_.store, table_.as_of(), response.mutable_header());
    table_.EncodeHull(*table_.hull_of(kA), response.mutable_hull_a());
    table_.EncodeHull(*table_.hull_of(kB), response.mutable_hull_b());
    search_.emplace(table_, kA, kB, options_, motion_options_);
    return search_->CheckMemory(parts_.registry);
  }

  void RunSlice() {
    const auto end = PairSearch::Clock::now() + TaskPool::kSliceTime;
    const bool is_answered = search_->Advance(end);
    charge_.Set(search_->MemoryBytes());
    if (is_answered) return call_->End(Encode());
    if (!lane_.has_value()) lane_.emplace(parts_.pool);
    lane_->Submit([self = shared_from_this()] { self->RunSlice(); }, call_->call().client());
  }

  // Fills the response.
  absl::Status Encode() {
    const PlacedAnswer& found = search_->answer();
    if (!found.answer.ok()) return found.answer.status();
    v1::CheckCollisionResponse& response = call_->response();
    response.set_relation(EncodeRelation(found.answer->relation));
    const std::optional<PiecePair>& deciding = found.of_body.pieces;
    if (deciding) table_.EncodeDecidingPieces(kA, kB, *deciding, &response);
    const PiecePair pieces = deciding.value_or(PiecePair{0, 0});
    const QueryHull& a = table_.HullOfPiece(kA, pieces.a);
    const QueryHull& b = table_.HullOfPiece(kB, pieces.b);
    if (found.contact.has_value()) {
      EncodeFirstContact(*found.contact, response.mutable_first_contact());
      if (found.contact->certificate.has_value()) {
        EncodeCertificate(*found.contact->certificate, a.hull(), b.hull(),
                          response.mutable_certificate());
      }
    } else {
      RungCounts counts;
      counts.Add(found.answer->rung);
      call_->call().metrics().CountPairs(counts);
      const v1::Wanted& wanted = call_->request().wanted();
      HULLD_RETURN_IF_ERROR(EncodeAnswer(*found.answer, a, b, wanted, &response));
    }
    return table_.has_bodies() && options_.want_certificate ? EncodeProof() : absl::OkStatus();
  }

  // Encodes the proof of the relation of bodies: the hulls of all pieces, without duplicates, and
  // the certificates. A hull counts as its own piece, except for an inline shape, which has none.
  // RESOURCE_EXHAUSTED: the proof is too large for a reply.
  absl::Status EncodeProof() {
    v1::CheckCollisionResponse& response = call_->response();
    std::set<std::string_view> known;
    const auto encode = [&](const HullView& hull) {
      const std::string& id = hull.record.hull_id;
      if (id.empty() || !known.insert(id).second) return;
      EncodeVersion(parts_.store, hull.record, response.add_piece_hulls());
    };
    for (const uint32_t i : {kA, kB}) {
      const HullView& view = *table_.hull(*table_.hull_of(i));
      if (view.body == nullptr) {
        encode(view);
      } else {
        for (const HullView& hull : view.body->hulls) encode(hull);
      }
    }
    const std::vector<PieceCertificate>& certificates = search_->answer().of_body.certificates;
    const size_t bytes = response.ByteSizeLong();
    const size_t room = Config::kMaxProofBytes - std::min(bytes, Config::kMaxProofBytes);
    const size_t taken =
        AddCertificates(table_, kA, kB, certificates, room, response.mutable_piece_certificates());
    if (taken <= room) return absl::OkStatus();
    return ProofTooLarge(certificates.size(), Config::kMaxProofBytes);
  }

  const ServiceParts& parts_;
  CheckCall* const call_;
  QueryOptions options_;
  // Used if a placement moves.
  MotionOptions motion_options_;
  ReadPlan plan_;
  PlacementTable table_;
  std::optional<PairSearch> search_;
  // Covers the state between slices.
  MemoryCharge charge_;
  // Used by all slices except the first.
  std::optional<TaskPool::Lane> lane_;
};

}  // namespace

UnaryReactor* StartCheck(CallContext& context, const ServiceParts& parts, const Bytes& request,
                         Bytes* response) {
  return CheckCall::Start(&context, parts.admission, Rpc::kCheckCollision, &request, response,
                          [&parts](CheckCall* call) { PairQuery::Start(parts, call); });
}

}  // namespace hulld::server
