#include "server/collisions/collision_service.h"

#include <absl/status/status.h>
#include <absl/strings/str_cat.h>

#include <array>
#include <memory>
#include <optional>
#include <utility>

#include "core/query/collision.h"
#include "server/call/unary_call.h"
#include "server/collisions/batch_stream.h"
#include "server/collisions/collision_stream.h"
#include "server/collisions/query_settings.h"
#include "server/collisions/scene_stream.h"
#include "server/contract/status_map.h"
#include "server/wire/decode.h"
#include "server/wire/encode.h"

namespace hulld::server {
namespace {

// One pair, ready to be answered by any thread.
struct PairQuery {
  HullView a;
  HullView b;
  Pose X_WA;
  Pose X_WB;
  QueryOptions options;
};

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

// All of a query but its hulls.
absl::StatusOr<PairQuery> ReadQuery(const Limits& limits, const Call& call,
                                    const v1::CheckCollisionRequest& request) {
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

// Gives the query the hulls that were found for it, and the response their versions.
absl::Status TakeHulls(const Registry& registry, absl::StatusOr<Resolved> resolved,
                       PairQuery* query, v1::CheckCollisionResponse* response) {
  if (!resolved.ok()) return resolved.status();
  for (const absl::StatusOr<HullView>& hull : resolved->hulls) {
    if (!hull.ok()) return hull.status();
  }
  query->a = *std::move(resolved->hulls[0]);
  query->b = *std::move(resolved->hulls[1]);
  EncodeHeader(registry.store(), resolved->store_revision, response->mutable_header());
  EncodeVersion(query->a.record, response->mutable_hull_a());
  EncodeVersion(query->b.record, response->mutable_hull_b());
  return absl::OkStatus();
}

// Whether a relation, of these hulls, may be found on gRPC's thread: they are of moderate size, and
// nothing is left to make.
bool IsQuick(const Resolved& resolved) {
  for (const absl::StatusOr<HullView>& hull : resolved.hulls) {
    if (!hull.ok()) continue;
    const Snapshot& snapshot = *hull->snapshot;
    if (!snapshot.has_query_hull() || !IsQuickToRelate(snapshot.hull())) return false;
  }
  return true;
}

absl::Status Answer(const PairQuery& query, const v1::Wanted& wanted, Metrics& metrics,
                    v1::CheckCollisionResponse* response) {
  const PlacedHull placed_a(query.a.snapshot->query_hull(), query.X_WA);
  const PlacedHull placed_b(query.b.snapshot->query_hull(), query.X_WB);
  const Hull& a = placed_a.hull();
  const Hull& b = placed_b.hull();
  const auto answer = hulld::CheckCollision(placed_a, placed_b, query.options);
  if (!answer.ok()) return NameQueryLimit(answer.status());
  RungCounts counts;
  counts.Add(answer->rung);
  metrics.CountPairs(counts);
  response->set_relation(EncodeRelation(answer->relation));
  response->set_rung(EncodeRung(answer->rung));
  if (answer->analysis) EncodeAnalysis(*answer->analysis, a, b, response->mutable_analysis());
  if (answer->certificate) {
    EncodeCertificate(*answer->certificate, a, b, response->mutable_certificate());
  }
  if (answer->separation) EncodeSeparation(*answer->separation, response->mutable_separation());
  if (answer->witness) EncodeWitness(*answer->witness, response->mutable_witness());
  if (answer->within_clearance) response->set_within_clearance(*answer->within_clearance);
  if (!wanted.axis() || !answer->axis.has_value()) return absl::OkStatus();
  return EncodeAxis(*answer->axis, a, b, response->mutable_axis());
}

}  // namespace

grpc::ServerUnaryReactor* CollisionService::CheckCollision(grpc::CallbackServerContext* context,
                                                           const v1::CheckCollisionRequest* request,
                                                           v1::CheckCollisionResponse* response) {
  return UnaryCall::Start(*context, admission_, Rpc::kCheckCollision, [&](UnaryCall* call) {
    absl::StatusOr<PairQuery> query = ReadQuery(registry_.limits(), call->call(), *request);
    if (!query.ok()) return call->End(query.status());
    if (query->options.WantsRelationOnly()) {
      std::optional<Resolved> resolved = registry_.TryResolve(HullIds(*request));
      if (resolved.has_value() && IsQuick(*resolved)) {
        const absl::Status taken = TakeHulls(registry_, *std::move(resolved), &*query, response);
        return call->End(taken.ok()
                             ? Answer(*query, request->wanted(), call->call().metrics(), response)
                             : taken);
      }
    }
    readers_.Submit([this, call, request, response, query = *std::move(query)]() mutable {
      const absl::Status taken =
          TakeHulls(registry_, registry_.Resolve(HullIds(*request), query.options.should_stop),
                    &query, response);
      if (!taken.ok()) return call->End(taken);
      if (query.options.method != Method::kTextbookSat) {
        return call->End(Answer(query, request->wanted(), call->call().metrics(), response));
      }
      query.options.threads = executor_.threads();
      executor_.Submit([call, request, response, query = std::move(query)] {
        call->End(Answer(query, request->wanted(), call->call().metrics(), response));
      });
    });
  });
}

grpc::ServerWriteReactor<v1::BatchCheckCollisionsResponse>* CollisionService::BatchCheckCollisions(
    grpc::CallbackServerContext* context, const v1::BatchCheckCollisionsRequest* request) {
  return BatchStream::Start(*context, admission_, registry_, long_readers_, executor_, *request);
}

grpc::ServerBidiReactor<v1::StreamCollisionsRequest, v1::StreamCollisionsResponse>*
CollisionService::StreamCollisions(grpc::CallbackServerContext* context) {
  return CollisionStream::Start(*context, admission_, registry_, readers_, long_readers_);
}

grpc::ServerWriteReactor<v1::FindCollisionsResponse>* CollisionService::FindCollisions(
    grpc::CallbackServerContext* context, const v1::FindCollisionsRequest* request) {
  return SceneStream::Start(*context, admission_, registry_, long_readers_, executor_, *request);
}

}  // namespace hulld::server
