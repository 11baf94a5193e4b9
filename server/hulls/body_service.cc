#include <absl/strings/str_cat.h>

#include <chrono>
#include <unordered_map>
#include <utility>

#include "core/base/status_macros.h"
#include "hulld/v1/body.grpc.pb.h"
#include "server/access/caller.h"
#include "server/call/call.h"
#include "server/call/unary_call.h"
#include "server/contract/errors.h"
#include "server/hulls/hull_service.h"
#include "server/registry/body_resolution.h"
#include "server/registry/catalog/body.h"
#include "server/wire/decode.h"
#include "server/wire/encode.h"
#include "server/wire/unary_answers.h"

namespace hulld::server {
namespace {

absl::StatusOr<StoredBody> DecodeBody(const v1::PutBodyRequest& request, const Caller& caller,
                                      uint64_t max_pieces) {
  HULLD_RETURN_IF_ERROR(CheckHullId(caller, request.body_id(), "body_id"));
  if (request.pieces().empty()) {
    return InvalidArgument(
        "pieces is empty; a body needs at least one piece (use DeleteBody to remove a body)");
  }
  const auto count = static_cast<uint64_t>(request.pieces_size());
  if (count > max_pieces) {
    return LimitExceeded(absl::StrCat("the body has ", count, " pieces"), max_pieces,
                         "max-pieces-per-body");
  }
  StoredBody body;
  body.record.body_id = request.body_id();
  body.pieces.reserve(count);
  std::unordered_map<std::string, uint32_t> index_of;
  for (int i = 0; i < request.pieces_size(); ++i) {
    const v1::Placement& piece = request.pieces(i);
    if (piece.has_points()) {
      return InvalidArgument("pieces[", i,
                             "].points is set; a piece must be a registered hull; set its ID");
    }
    const auto [known, is_new] =
        index_of.try_emplace(piece.hull_id(), static_cast<uint32_t>(body.hull_ids.size()));
    if (is_new) {
      const absl::Status valid = CheckHullId(caller, piece.hull_id(), "hull_id");
      if (!valid.ok()) return Prefixed(absl::StrCat("pieces[", i, "]."), valid);
      if (piece.hull_id() == request.body_id()) {
        return InvalidArgument("pieces[", i,
                               "].hull_id is the body itself; a piece must be a hull");
      }
      body.hull_ids.push_back(piece.hull_id());
    }
    if (piece.has_end_pose()) {
      return InvalidArgument("pieces[", i,
                             "].end_pose is set; a piece cannot move relative to its body");
    }
    const Pose pose = ReadPose(piece.pose());
    const absl::Status posed = ValidatePose(pose);
    if (!posed.ok()) return Prefixed(absl::StrCat("pieces[", i, "].pose."), posed);
    const absl::Status radius = ValidateRadius(piece.radius());
    if (!radius.ok()) return Prefixed(absl::StrCat("pieces[", i, "].radius"), radius);
    body.pieces.push_back({known->second, pose, piece.radius()});
  }
  return body;
}

void EncodeBody(const HullChange& body, v1::BodyInfo* message) {
  message->set_body_id(body.record.hull_id);
  message->set_create_revision(body.record.create_revision);
  message->set_revision(body.record.revision);
  message->set_piece_count(body.piece_count);
  message->set_damaged(body.damaged);
}

void AddListedBody(const HullChange& body, v1::ListBodiesResponse& response) {
  EncodeBody(body, response.add_bodies());
}

void EncodePose(const Pose& pose, v1::Pose* message) {
  v1::Quaternion* const q = message->mutable_rotation();
  q->set_w(pose.q[0]);
  q->set_x(pose.q[1]);
  q->set_y(pose.q[2]);
  q->set_z(pose.q[3]);
  EncodeVector(pose.t, message->mutable_translation());
}

// The generated service, with methods that exchange bytes (message_bytes.h).
using BodyServiceOfBytes =
    v1::BodyService::WithRawCallbackMethod_PutBody<v1::BodyService::WithRawCallbackMethod_GetBody<
        v1::BodyService::WithRawCallbackMethod_ListBodies<
            v1::BodyService::WithRawCallbackMethod_DeleteBody<v1::BodyService::Service>>>>;

class BodyService : public BodyServiceOfBytes {
 public:
  explicit BodyService(const ServiceParts& parts) : parts_(parts) {}

  UnaryReactor* PutBody(CallContext* context, const Bytes* request, Bytes* response) override {
    return PutCall::Start(
        context, parts_.admission, Rpc::kPutBody, request, response, [this](PutCall* call) {
          parts_.readers.Submit([this, call] { Put(call); }, call->call().client());
        });
  }

  UnaryReactor* GetBody(CallContext* context, const Bytes* request, Bytes* response) override {
    return UnaryCall<v1::GetBodyRequest, v1::GetBodyResponse>::Start(
        context, parts_.admission, Rpc::kGetBody, request, response, [this](auto* call) {
          const auto get = [this, call](std::chrono::nanoseconds staleness) {
            return Get(call->request(), call->call(), staleness, &call->response());
          };
          EndFresh(parts_.registry, parts_.readers, call, get, false);
        });
  }

  UnaryReactor* ListBodies(CallContext* context, const Bytes* request, Bytes* response) override {
    return UnaryCall<v1::ListBodiesRequest, v1::ListBodiesResponse>::Start(
        context, parts_.admission, Rpc::kListBodies, request, response, [this](auto* call) {
          EndListed(parts_.registry, parts_.readers, call, Rpc::kListBodies, {.bodies = true},
                    AddListedBody);
        });
  }

  UnaryReactor* DeleteBody(CallContext* context, const Bytes* request, Bytes* response) override {
    return UnaryCall<v1::DeleteBodyRequest, v1::DeleteBodyResponse>::Start(
        context, parts_.admission, Rpc::kDeleteBody, request, response, [this](auto* call) {
          EndDeleted(parts_.registry, call, "body", call->request().body_id());
        });
  }

 private:
  using PutCall = UnaryCall<v1::PutBodyRequest, v1::PutBodyResponse>;

  // Ends the call after the change is committed.
  void Put(PutCall* call) {
    if (call->call().ShouldStop()) return call->End(call->call().StopStatus());
    absl::StatusOr<StoredBody> body = DecodeBody(call->request(), call->call().caller(),
                                                 parts_.registry.limits().max_pieces_per_body);
    if (!body.ok()) return call->End(body.status());
    parts_.registry.changes().PutBody(
        *std::move(body), IfRevision(call->request()),
        [this, call](const absl::StatusOr<PutBodyResult>& result) {
          if (!result.ok()) return call->End(result.status());
          const HullRecord& record = result->body.record;
          call->call().LogChange(result->created ? "body created" : "body replaced",
                                 {"body", record.hull_id}, record.revision);
          v1::PutBodyResponse& response = call->response();
          EncodeHeader(parts_.store, result->store_revision, response.mutable_header());
          EncodeBody(result->body, response.mutable_body());
          response.set_created(result->created);
          response.set_durability(EncodeDurability(parts_.store.durability()));
          call->End(absl::OkStatus());
        });
  }

  absl::Status Get(const v1::GetBodyRequest& request, const Call& call,
                   std::chrono::nanoseconds staleness, v1::GetBodyResponse* response) {
    const std::string& id = request.body_id();
    HULLD_RETURN_IF_ERROR(CheckHullId(call.caller(), id, "body_id"));
    const FoundBodies found =
        parts_.registry.records().FindBodies(std::span(&id, 1), call.should_stop());
    if (!found.status.ok()) return found.status;
    const std::shared_ptr<const Body>& body = found.bodies.front();
    if (body == nullptr) return parts_.registry.records().NoSuchBody(id);
    if (!body->damage().ok()) return body->damage();
    HULLD_RETURN_IF_ERROR(CheckPiecePrefix(*body, call.caller().prefix));
    EncodeHeader(parts_.store, AsOf{found.store_revision, staleness}, response->mutable_header());
    EncodeBody(body->Describe(), response->mutable_body());
    response->mutable_pieces()->Reserve(static_cast<int>(body->pieces().size()));
    for (const StoredPiece& piece : body->pieces()) {
      v1::Placement* const placement = response->add_pieces();
      placement->set_hull_id(body->hull_ids()[piece.hull]);
      EncodePose(piece.X_BP, placement->mutable_pose());
      placement->set_radius(piece.radius);
    }
    return absl::OkStatus();
  }

  const ServiceParts& parts_;
};

}  // namespace

std::unique_ptr<grpc::Service> MakeBodyService(const ServiceParts& parts) {
  return std::make_unique<BodyService>(parts);
}

}  // namespace hulld::server
