#include "server/hulls/hull_service.h"

#include <absl/status/status.h>

#include "core/base/status_macros.h"
#include "core/hull/audit.h"
#include "core/hull/properties.h"
#include "hulld/v1/hull.grpc.pb.h"
#include "server/call/call.h"
#include "server/call/unary_call.h"
#include "server/wire/decode.h"
#include "server/wire/encode.h"
#include "server/wire/unary_answers.h"

namespace hulld::server {
namespace {

void AddListed(const HullChange& hull, v1::ListHullsResponse& response) {
  v1::HullInfo* info = response.add_hulls();
  EncodeRecord(hull.record, info);
  info->set_damaged(hull.damaged);
}

// The generated service, with methods that exchange bytes (message_bytes.h).
using HullServiceOfBytes = v1::HullService::WithRawCallbackMethod_CreateHull<
    v1::HullService::WithRawCallbackMethod_AppendPoints<
        v1::HullService::WithRawCallbackMethod_ReplaceHull<
            v1::HullService::WithRawCallbackMethod_GetHull<
                v1::HullService::WithRawCallbackMethod_GetHullMesh<
                    v1::HullService::WithRawCallbackMethod_ListHulls<
                        v1::HullService::WithRawCallbackMethod_DeleteHull<
                            v1::HullService::WithRawCallbackMethod_WatchHulls<
                                v1::HullService::Service>>>>>>>>;

class HullService : public HullServiceOfBytes {
 public:
  explicit HullService(const ServiceParts& parts) : parts_(parts) {}

  UnaryReactor* CreateHull(CallContext* context, const Bytes* request, Bytes* response) override {
    return CreateCall::Start(context, parts_.admission, Rpc::kCreateHull, request, response,
                             [this](CreateCall* call) { Create(call); });
  }

  BidiReactor* AppendPoints(CallContext* context) override { return StartAppend(*context, parts_); }

  ReadReactor* ReplaceHull(CallContext* context, Bytes* response) override {
    return StartReplace(*context, parts_, response);
  }

  UnaryReactor* GetHull(CallContext* context, const Bytes* request, Bytes* response) override {
    return UnaryCall<v1::GetHullRequest, v1::GetHullResponse>::Start(
        context, parts_.admission, Rpc::kGetHull, request, response, [this](auto* call) {
          // The cost of an audit, or of sums over the surface, increases with the hull's size.
          const bool is_long = call->request().audit() || call->request().properties();
          TaskPool& readers = is_long ? parts_.long_readers : parts_.readers;
          call->EndOn(readers, [this, call] {
            return Get(call->request(), call->call(), &call->response());
          });
        });
  }

  WriteReactor* GetHullMesh(CallContext* context, const Bytes* request) override {
    return StartMesh(*context, parts_, *request);
  }

  UnaryReactor* ListHulls(CallContext* context, const Bytes* request, Bytes* response) override {
    return UnaryCall<v1::ListHullsRequest, v1::ListHullsResponse>::Start(
        context, parts_.admission, Rpc::kListHulls, request, response, [this](auto* call) {
          EndListed(parts_.registry, parts_.readers, call, Rpc::kListHulls, {.hulls = true},
                    AddListed);
        });
  }

  UnaryReactor* DeleteHull(CallContext* context, const Bytes* request, Bytes* response) override {
    return UnaryCall<v1::DeleteHullRequest, v1::DeleteHullResponse>::Start(
        context, parts_.admission, Rpc::kDeleteHull, request, response, [this](auto* call) {
          EndDeleted(parts_.registry, call, "hull", call->request().hull_id());
        });
  }

  WriteReactor* WatchHulls(CallContext* context, const Bytes* request) override {
    return StartWatch(*context, parts_, *request);
  }

 private:
  using CreateCall = UnaryCall<v1::CreateHullRequest, v1::CreateHullResponse>;

  // Ends the call after the change is committed.
  void Create(CreateCall* call) {
    const v1::CreateHullRequest& request = call->request();
    if (absl::Status s = CheckHullId(call->call().caller(), request.hull_id(), "hull_id");
        !s.ok()) {
      return call->End(s);
    }
    parts_.registry.changes().Create(
        request.hull_id(), request.if_absent(),
        [this, call](const absl::StatusOr<PutHullResult>& created) {
          if (!created.ok()) return call->End(created.status());
          const HullRecord& hull = created->hull;
          if (created->created) {
            call->call().LogChange("hull created", {"hull", hull.hull_id}, hull.revision);
          }
          v1::CreateHullResponse& response = call->response();
          EncodeHeader(parts_.store, created->store_revision, response.mutable_header());
          EncodeRecord(hull, response.mutable_hull());
          response.set_created(created->created);
          call->End(absl::OkStatus());
        });
  }

  absl::Status Get(const v1::GetHullRequest& request, const Call& call,
                   v1::GetHullResponse* response) {
    HULLD_RETURN_IF_ERROR(CheckHullId(call.caller(), request.hull_id(), "hull_id"));
    HULLD_ASSIGN_OR_RETURN(const Freshness freshness,
                           DecodeFreshness(request.freshness(), parts_.store, call.arrival()));
    const auto should_stop = call.should_stop();
    HULLD_ASSIGN_OR_RETURN(const auto resolved,
                           parts_.registry.Resolve(request.hull_id(), should_stop, freshness));
    const auto& [as_of, view] = resolved;
    EncodeHeader(parts_.store, as_of, response->mutable_header());
    EncodeRecord(view.record, response->mutable_hull());
    EncodeBox(view.served->box(), response);
    const bool wants_properties = request.properties() && !view.served->empty();
    if (request.without_facets() && !request.audit() && !wants_properties) return absl::OkStatus();
    HULLD_ASSIGN_OR_RETURN(const Hull* hull, parts_.registry.reader().Canonical(view, should_stop));
    if (!request.without_facets()) {
      response->set_edge_count(hull->edges().size());
      response->set_facet_count(hull->facet_count());
    }
    if (wants_properties) {
      HULLD_ASSIGN_OR_RETURN(const HullProperties properties,
                             ComputeProperties(*hull, should_stop));
      EncodeProperties(properties, response->mutable_properties());
    }
    if (!request.audit()) return absl::OkStatus();
    const absl::Status finding = AuditHull(*hull, should_stop);
    if (absl::IsCancelled(finding)) return finding;
    response->mutable_audit()->set_ok(finding.ok());
    if (!finding.ok()) response->mutable_audit()->set_finding(std::string(finding.message()));
    return absl::OkStatus();
  }

  const ServiceParts& parts_;
};

}  // namespace

std::unique_ptr<grpc::Service> MakeHullService(const ServiceParts& parts) {
  return std::make_unique<HullService>(parts);
}

}  // namespace hulld::server
