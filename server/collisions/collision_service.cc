#include "server/collisions/collision_service.h"

#include <absl/status/status.h>
#include <absl/strings/str_cat.h>

#include <array>
#include <chrono>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/base/check.h"
#include "core/query/body/body_search.h"
#include "core/query/collision.h"
#include "server/call/unary_call.h"
#include "server/collisions/batch_stream.h"
#include "server/collisions/body_question.h"
#include "server/collisions/collision_stream.h"
#include "server/collisions/placed/query_settings.h"
#include "server/collisions/scene_stream.h"
#include "server/collisions/watch/collision_watch.h"
#include "server/contract/error_info.h"
#include "server/contract/status_map.h"
#include "server/registry/body_resolution.h"
#include "server/settings/config.h"
#include "server/wire/decode.h"
#include "server/wire/encode.h"

namespace hulld::server {
namespace {

// Maximum number of waiting calls that the committing thread answers itself after a store query, in
// place of dispatching them: 32 queries of some 10 us delay its commits by about a round trip.
constexpr size_t kMostAnsweredInTurn = 32;

absl::StatusOr<Pose> ReadPlacement(const Caller& caller, bool present,
                                   const v1::Placement& placement, const std::string& field) {
  if (!present) {
    return absl::InvalidArgumentError(absl::StrCat(field, " is missing; give a hull ID"));
  }
  if (absl::Status s = CheckHullId(caller, placement.hull_id(), field + ".hull_id"); !s.ok()) {
    return s;
  }
  absl::StatusOr<Pose> pose = DecodePose(placement.pose());
  if (!pose.ok()) return Prefixed(absl::StrCat(field, ".pose."), pose.status());
  return pose;
}

std::array<std::string, 2> HullIds(const v1::CheckCollisionRequest& request) {
  return {request.a().hull_id(), request.b().hull_id()};
}

// Returns the first error in `resolved`, or OK.
absl::Status FirstProblem(const absl::StatusOr<Resolved>& resolved) {
  if (!resolved.ok()) return resolved.status();
  for (const absl::StatusOr<HullView>& hull : resolved->hulls) {
    if (!hull.ok()) return hull.status();
  }
  return absl::OkStatus();
}

// Stand-in hull if no pair of pieces decided.
const QueryHull& NoHull() {
  static const Hull kNothing;
  static const QueryHull kNoHull(kNothing);
  return kNoHull;
}

void EncodeVersions(const Store& store, const AsOf& as_of, const HullView& a, const HullView& b,
                    v1::CheckCollisionResponse* response) {
  EncodeHeader(store, as_of, response->mutable_header());
  EncodeVersion(store, a.record, response->mutable_hull_a());
  EncodeVersion(store, b.record, response->mutable_hull_b());
}

// a, b: the deciding hulls; canonical if the answer names vertices.
absl::Status EncodeAnswer(const Answer& answer, const QueryHull& a, const QueryHull& b,
                          const v1::Wanted& wanted, v1::CheckCollisionResponse* response) {
  response->set_relation(EncodeRelation(answer.relation));
  response->set_rung(EncodeRung(answer.rung));
  if (answer.analysis) {
    EncodeAnalysis(*answer.analysis, a.hull(), b.hull(), response->mutable_analysis());
  }
  if (answer.certificate) {
    EncodeCertificate(*answer.certificate, a.hull(), b.hull(), response->mutable_certificate());
  }
  if (answer.separation) EncodeSeparation(*answer.separation, response->mutable_separation());
  if (answer.witness) EncodeWitness(*answer.witness, response->mutable_witness());
  if (answer.within_clearance) response->set_within_clearance(*answer.within_clearance);
  if (!wanted.axis() || !answer.axis.has_value()) return absl::OkStatus();
  return EncodeAxis(*answer.axis, a.hull(), b.hull(), response->mutable_axis());
}

void EncodePiece(const Store& store, const BodyQuestion::Side& side, uint32_t piece,
                 v1::DecidingPiece* message) {
  message->set_index(piece);
  EncodeVersion(store, side.view().body->hull_of(piece).record, message->mutable_hull());
}

const QueryHull& HullOfPiece(const BodyQuestion::Side& side, uint32_t piece) {
  return *side.placed().body().pieces()[piece].hull;
}

// Encodes the hulls of all pieces, without duplicates; for a hull, itself.
void EncodeHulls(const Store& store, const BodyQuestion::Side& side,
                 std::set<std::string_view>* known, v1::CheckCollisionResponse* response) {
  const auto encode = [&](const HullView& view) {
    if (!known->insert(view.record.hull_id).second) return;
    EncodeVersion(store, view.record, response->add_piece_hulls());
  };
  if (!side.is_body()) return encode(side.view());
  for (const HullView& view : side.view().body->hulls) encode(view);
}

// Encodes the proof of the relation of bodies. RESOURCE_EXHAUSTED: it is too large for a reply.
absl::Status EncodeProof(const Store& store, const std::vector<PieceCertificate>& certificates,
                         const BodyQuestion::Side& a, const BodyQuestion::Side& b,
                         v1::CheckCollisionResponse* response) {
  std::set<std::string_view> known;
  EncodeHulls(store, a, &known, response);
  EncodeHulls(store, b, &known, response);
  size_t bytes = response->ByteSizeLong();
  for (const PieceCertificate& certificate : certificates) {
    // Tag and length.
    constexpr size_t kEntryBytes = 4;
    v1::PieceCertificate* const message = response->add_piece_certificates();
    EncodePieceCertificate(certificate, HullOfPiece(a, certificate.pieces.a).hull(),
                           HullOfPiece(b, certificate.pieces.b).hull(), message);
    bytes += kEntryBytes + message->ByteSizeLong();
    if (bytes > Config::kMaxProofBytes) break;
  }
  if (bytes <= Config::kMaxProofBytes) return absl::OkStatus();
  return ProofTooLarge(certificates.size(), Config::kMaxProofBytes);
}

absl::Status EncodeBodyAnswer(const Store& store, const BodyAnswer& answer,
                              const BodyQuestion::Side& a, const BodyQuestion::Side& b,
                              const v1::Wanted& wanted, v1::CheckCollisionResponse* response) {
  absl::Status encoded;
  if (!answer.pieces) {
    encoded = EncodeAnswer(answer.answer, NoHull(), NoHull(), wanted, response);
  } else {
    const PiecePair pieces = *answer.pieces;
    if (a.is_body()) EncodePiece(store, a, pieces.a, response->mutable_piece_a());
    if (b.is_body()) EncodePiece(store, b, pieces.b, response->mutable_piece_b());
    encoded = EncodeAnswer(answer.answer, HullOfPiece(a, pieces.a), HullOfPiece(b, pieces.b),
                           wanted, response);
  }
  if (!encoded.ok() || !wanted.certificate()) return encoded;
  return EncodeProof(store, answer.certificates, a, b, response);
}

}  // namespace

// A query of a pair, ready to be answered on any thread.
struct CollisionService::PairQuery {
  // Reads everything except the hulls.
  static absl::StatusOr<PairQuery> Read(const Limits& limits, const Call& call,
                                        const v1::CheckCollisionRequest& request);

  // Takes the resolved hulls, neither of them a body, and adds their versions to the response.
  void Place(const Store& store, Resolved resolved, v1::CheckCollisionResponse* response);

  // Requires that Place succeeded.
  bool IsQuick() const {
    return IsQuickToRelate(placed_a().query_hull()) && IsQuickToRelate(placed_b().query_hull());
  }
  bool IsForTeam() const { return IsTextbookForTeam(options, placed_a(), placed_b()); }
  absl::Status Encode(const absl::StatusOr<Answer>& answer, const v1::Wanted& wanted,
                      Metrics& metrics, v1::CheckCollisionResponse* response) const;
  const PlacedHull& placed_a() const {
    HULLD_CHECK(a.has_value());
    return *a;
  }
  const PlacedHull& placed_b() const {
    HULLD_CHECK(b.has_value());
    return *b;
  }

  Pose X_WA;
  Pose X_WB;
  QueryOptions options;
  // Keep the hulls alive.
  std::vector<absl::StatusOr<HullView>> views;
  std::optional<PlacedHull> a;
  std::optional<PlacedHull> b;
};

absl::StatusOr<CollisionService::PairQuery> CollisionService::PairQuery::Read(
    const Limits& limits, const Call& call, const v1::CheckCollisionRequest& request) {
  PairQuery query;
  absl::StatusOr<QueryOptions> options = MakeQueryOptions(
      request.method(), request.wanted(), request.tolerance(), limits, call.lifetime());
  if (!options.ok()) return options.status();
  query.options = *std::move(options);
  const absl::StatusOr<Pose> X_WA = ReadPlacement(call.caller(), request.has_a(), request.a(), "a");
  if (!X_WA.ok()) return X_WA.status();
  query.X_WA = *X_WA;
  const absl::StatusOr<Pose> X_WB = ReadPlacement(call.caller(), request.has_b(), request.b(), "b");
  if (!X_WB.ok()) return X_WB.status();
  query.X_WB = *X_WB;
  return query;
}

void CollisionService::PairQuery::Place(const Store& store, Resolved resolved,
                                        v1::CheckCollisionResponse* response) {
  views = std::move(resolved.hulls);
  const bool canonical = options.WantsCanonical();
  const auto query_hull = [canonical](const HullView& view) -> const QueryHull& {
    return canonical ? view.served->canonical_query_hull() : view.served->query_hull();
  };
  a = PlacedHull(query_hull(*views[0]), X_WA);
  b = PlacedHull(query_hull(*views[1]), X_WB);
  EncodeVersions(store, resolved.as_of(), *views[0], *views[1], response);
}

struct CollisionService::TextbookQuery {
  TextbookQuery(Registry& registry, PairQuery given_pair, bool for_team)
      : pair(std::move(given_pair)),
        is_for_team(for_team),
        charge(registry.memory(), MemoryUse::kReading) {}

  // RESOURCE_EXHAUSTED: no memory for the state of a large pair between slices, or it has too many
  // axes.
  absl::Status Begin(Registry& registry);

  PairQuery pair;
  const bool is_for_team;
  std::optional<TextbookCheck> check;
  // Charge for the check.
  MemoryCharge charge;
};

absl::Status CollisionService::TextbookQuery::Begin(Registry& registry) {
  if (is_for_team) {
    if (absl::Status s = registry.CheckMemory(MemoryUse::kReading); !s.ok()) return s;
  }
  absl::StatusOr<TextbookCheck> begun =
      TextbookCheck::Begin(pair.placed_a(), pair.placed_b(), pair.options);
  if (!begun.ok()) return NameQueryLimit(begun.status(), pair.options);
  check = *std::move(begun);
  charge.Set(check->MemoryBytes());
  return absl::OkStatus();
}

absl::Status CollisionService::PairQuery::Encode(const absl::StatusOr<Answer>& answer,
                                                 const v1::Wanted& wanted, Metrics& metrics,
                                                 v1::CheckCollisionResponse* response) const {
  if (!answer.ok()) return NameQueryLimit(answer.status(), options);
  RungCounts counts;
  counts.Add(answer->rung);
  metrics.CountPairs(counts);
  return EncodeAnswer(*answer, a->query_hull(), b->query_hull(), wanted, response);
}

grpc::ServerUnaryReactor* CollisionService::CheckCollision(grpc::CallbackServerContext* context,
                                                           const grpc::ByteBuffer* request,
                                                           grpc::ByteBuffer* response) {
  return CheckCall::Start(*context, admission_, Rpc::kCheckCollision, {request, response},
                          [this](CheckCall* call) { Check(call); });
}

void CollisionService::Check(CheckCall* call) {
  pool_.NoteSingleCall();
  const v1::CheckCollisionRequest& request = call->request();
  absl::StatusOr<PairQuery> query = PairQuery::Read(registry_.limits(), call->call(), request);
  if (!query.ok()) return call->End(query.status());
  const absl::StatusOr<Freshness> freshness =
      DecodeFreshness(request.freshness(), registry_.store(), call->call().arrival());
  if (!freshness.ok()) return call->End(freshness.status());
  PlacedLookup lookup;
  lookup.plan.freshness = *freshness;
  lookup.canonical = query->options.WantsCanonical();
  lookup.prefix = call->call().caller().prefix;
  std::optional<Resolved> ready = TryResolvePlaced(registry_, HullIds(request), lookup);
  if (ready.has_value()) return AnswerPair(*std::move(query), *std::move(ready), call);
  // A shared store is queried first; no thread waits for its answer.
  const auto waiting = std::make_shared<PairQuery>(*std::move(query));
  const auto answer = [this, call, lookup, waiting](const absl::Status& status) {
    if (!status.ok()) return call->End(status);
    if (waiting_.count() >= kMostAnsweredInTurn) {
      return AnswerLater(std::move(*waiting), lookup, call);
    }
    std::optional<Resolved> found = TryResolvePlaced(registry_, HullIds(call->request()), lookup);
    if (found.has_value()) return AnswerPair(std::move(*waiting), *std::move(found), call);
    AnswerLater(std::move(*waiting), lookup, call);
  };
  const bool awaits =
      waiting_.AwaitFresh(registry_, *freshness, waiting->options.should_stop, answer);
  if (!awaits) AnswerLater(std::move(*waiting), lookup, call);
}

// Waits for the store, or for canonical snapshots or boxes of pieces to be built.
void CollisionService::AnswerLater(PairQuery query, const PlacedLookup& lookup, CheckCall* call) {
  const ClientId client = call->call().client();
  readers_.Submit(
      [this, call, lookup, query = std::move(query)]() mutable {
        absl::StatusOr<Resolved> resolved =
            ResolvePlaced(registry_, HullIds(call->request()), lookup, query.options.should_stop);
        AnswerPair(std::move(query), std::move(resolved), call);
      },
      client);
}

void CollisionService::AnswerPair(PairQuery query, absl::StatusOr<Resolved> resolved,
                                  CheckCall* call) {
  if (absl::Status problem = FirstProblem(resolved); !problem.ok()) return call->End(problem);
  const bool has_body = resolved->hulls[0]->body != nullptr || resolved->hulls[1]->body != nullptr;
  if (has_body) return AnswerBodies(query, *std::move(resolved), call);
  query.Place(registry_.store(), *std::move(resolved), &call->response());
  Compute(std::move(query), call);
}

void CollisionService::AnswerBodies(const PairQuery& query, Resolved resolved, CheckCall* call) {
  if (absl::Status s = ValidateForBodies(query.options); !s.ok()) return call->End(s);
  EncodeVersions(registry_.store(), resolved.as_of(), *resolved.hulls[0], *resolved.hulls[1],
                 &call->response());
  BodyQuestion::Start(
      pool_, *std::move(resolved.hulls[0]), query.X_WA, *std::move(resolved.hulls[1]), query.X_WB,
      query.options, call->call().client(),
      [this, call](const absl::StatusOr<BodyAnswer>& answer, const BodyQuestion::Side& a,
                   const BodyQuestion::Side& b) {
        if (!answer.ok()) {
          return call->End(NameProofLimit(answer.status(), registry_.limits().request_memory));
        }
        RungCounts counts;
        counts.Add(answer->answer.rung);
        call->call().metrics().CountPairs(counts);
        call->End(EncodeBodyAnswer(registry_.store(), *answer, a, b, call->request().wanted(),
                                   &call->response()));
      });
}

void CollisionService::Compute(PairQuery query, CheckCall* call) {
  const v1::Wanted& wanted = call->request().wanted();
  v1::CheckCollisionResponse* const response = &call->response();
  Metrics& metrics = call->call().metrics();
  if (query.options.method == Method::kTextbookSat) {
    const bool is_for_team = query.IsForTeam();
    if (is_for_team) query.options.threads = executor_.threads();
    return SubmitPiece(std::make_shared<TextbookQuery>(registry_, std::move(query), is_for_team),
                       call);
  }
  // `wanted` lives until the call ends.
  const auto answer = [call, response, &wanted, &metrics](const PairQuery& pair) {
    call->End(pair.Encode(hulld::CheckCollision(pair.placed_a(), pair.placed_b(), pair.options),
                          wanted, metrics, response));
  };
  // Answers of a client with many calls take turns in the pool, because gRPC's threads take calls
  // in the order of arrival.
  const bool is_quick = query.options.WantsRelationOnly() && query.IsQuick();
  if (is_quick && !call->call().is_one_of_many()) return answer(query);
  pool_.Submit([answer, query = std::move(query)] { answer(query); }, call->call().client());
}

void CollisionService::SubmitPiece(std::shared_ptr<TextbookQuery> query, CheckCall* call) {
  TaskPool& pool = query->is_for_team ? executor_.opener() : pool_;
  const ClientId client = call->call().client();
  pool.Submit(
      [this, query = std::move(query), call] {
        const PairQuery& pair = query->pair;
        const auto end = std::chrono::steady_clock::now() +
                         (query->is_for_team ? Executor::kSliceTime : TaskPool::kSliceTime);
        if (!query->check.has_value()) {
          if (absl::Status s = query->Begin(registry_); !s.ok()) return call->End(s);
        }
        const absl::StatusOr<bool> done = query->check->Advance(end);
        if (!done.ok()) return call->End(done.status());
        if (!*done) return SubmitPiece(query, call);
        call->End(pair.Encode(query->check->Finish(), call->request().wanted(),
                              call->call().metrics(), &call->response()));
      },
      client);
}

WriteReactor* CollisionService::BatchCheckCollisions(grpc::CallbackServerContext* context,
                                                     const grpc::ByteBuffer* request) {
  return BatchStream::Start(*context, admission_, registry_, {long_readers_, pool_, waiting_},
                            executor_, *request);
}

BidiReactor* CollisionService::StreamCollisions(grpc::CallbackServerContext* context) {
  return CollisionStream::Start(*context, admission_, registry_, readers_, long_readers_, pool_,
                                waiting_);
}

WriteReactor* CollisionService::FindCollisions(grpc::CallbackServerContext* context,
                                               const grpc::ByteBuffer* request) {
  return SceneStream::Start(*context, admission_, registry_, {long_readers_, pool_, waiting_},
                            *request);
}

BidiReactor* CollisionService::WatchCollisions(grpc::CallbackServerContext* context) {
  return CollisionWatch::Start(*context, admission_, registry_, readers_, long_readers_, pool_);
}

}  // namespace hulld::server
