#ifndef HULLD_CLIENT_CLIENT_H_
#define HULLD_CLIENT_CLIENT_H_

#include <absl/status/status.h>
#include <absl/status/statusor.h>
#include <grpcpp/channel.h>

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "client/appender.h"
#include "client/calls/retry.h"
#include "client/collision_stream.h"
#include "client/connection_security.h"
#include "client/watch/collision_watch.h"
#include "client/watch/hull_watch.h"
#include "hulld/v1/body.grpc.pb.h"
#include "hulld/v1/collision.grpc.pb.h"
#include "hulld/v1/freshness.pb.h"
#include "hulld/v1/hull.grpc.pb.h"
#include "hulld/v1/maintenance.grpc.pb.h"
#include "hulld/v1/status.grpc.pb.h"

namespace hulld {

inline constexpr char kDefaultServer[] = "127.0.0.1:50551";

struct ClientOptions {
  // HOST:PORT, or several servers over one store: see server_address.h.
  std::string server = kDefaultServer;
  // Deadline of each call, its retries included. An append stream may last longer: there it bounds
  // the wait for the next acknowledgement.
  std::chrono::milliseconds timeout{30000};
  RetryPolicy retry;
  // How fresh the answers to reads must be whose request does not say so itself
  // (proto/hulld/v1/freshness.proto). Absent: they are linearizable. Pages of a list never go back.
  std::optional<v1::Freshness> freshness;
  // Connections to one server are shared within a process unless this is set.
  bool own_connection = false;
  // TLS and the token.
  ConnectionSecurity security;
};

// The canonical snapshot of a hull, put together from its stream and checked to be consistent.
struct HullMesh {
  v1::MeshHeader header;
  // Three coordinates per vertex.
  std::vector<double> xyz;
  // Vertices per facet, and the vertex indices of all facets one after another.
  std::vector<uint32_t> facet_sizes;
  std::vector<uint32_t> facet_indices;

  size_t vertex_count() const { return xyz.size() / 3; }
};

// A connection to hulld. Connects when first used; any thread may call it.
//
// Errors carry the server's code and message. UNAVAILABLE and DEADLINE_EXCEEDED mean that no answer
// came. Calls that are safe to repeat (all but DeleteHull, DeleteBody, PutBody with if_revision,
// and CreateHull without if_absent) are retried as options.retry says after UNAVAILABLE, and after
// RESOURCE_EXHAUSTED when the server says when to retry. ReasonOf and MetadataOf (grpc_status.h)
// tell why hulld refused a call. ValidateSecurity tells beforehand whether options.security can
// work.
class Client {
 public:
  explicit Client(ClientOptions options = {});
  // Over a given channel, such as one within the process.
  Client(ClientOptions options, std::shared_ptr<grpc::Channel> channel);

  absl::StatusOr<v1::CreateHullResponse> CreateHull(const std::string& hull_id,
                                                    bool if_absent = false) const;

  // Opens a stream of chunks into a hull.
  absl::StatusOr<std::unique_ptr<Appender>> OpenAppend(const std::string& hull_id,
                                                       AppendOptions options = {}) const;

  // Replaces a hull: `feed` passes blocks of points to the sink that it is given. An error of
  // either ends the call and changes nothing. Not retried. The call takes time in proportion to the
  // points, so options.timeout does not bound it. `timeout`, when given, bounds all of it.
  using PointSink = std::function<absl::Status(const v1::PointBlock&)>;
  absl::StatusOr<v1::ReplaceHullResponse> ReplaceHull(
      const v1::ReplaceOpen& open, const std::function<absl::Status(const PointSink&)>& feed,
      std::optional<std::chrono::milliseconds> timeout = {}) const;

  // Passes each part of a backup of the store to `receive`, in order; an error of `receive` ends
  // the call and is returned. Not retried; `timeout` as above.
  absl::Status SaveBackup(const std::function<absl::Status(const v1::SaveBackupResponse&)>& receive,
                          std::optional<std::chrono::milliseconds> timeout = {}) const;

  absl::StatusOr<v1::GetHullResponse> GetHull(const std::string& hull_id, bool audit = false) const;

  // INTERNAL: the stream contradicts itself.
  absl::StatusOr<HullMesh> GetHullMesh(const std::string& hull_id) const;
  // The same with all that a request can ask for, such as a simplification.
  // `on_part`, when given, is shown what has come, its header first, after each part of it; a call
  // that is repeated begins anew.
  absl::StatusOr<HullMesh> GetHullMesh(
      const v1::GetHullMeshRequest& request,
      const std::function<void(const HullMesh&)>& on_part = {}) const;

  // One page.
  absl::StatusOr<v1::ListHullsResponse> ListHulls(const v1::ListHullsRequest& request) const;

  // Follows pages until the last, or until `limit` hulls are there (0: no limit). The header is the
  // last page's; next_page_token is empty unless the limit cut the list.
  absl::StatusOr<v1::ListHullsResponse> ListAllHulls(const std::string& prefix,
                                                     uint64_t limit = 0) const;

  // Never retried: a repeated delete could remove a hull that someone has created anew.
  absl::StatusOr<v1::DeleteHullResponse> DeleteHull(const std::string& hull_id,
                                                    std::optional<uint64_t> if_revision = {}) const;

  // Creates a body, or replaces its pieces. Retried only where if_revision is absent: putting the
  // same again does no harm.
  absl::StatusOr<v1::PutBodyResponse> PutBody(const v1::PutBodyRequest& request) const;
  absl::StatusOr<v1::GetBodyResponse> GetBody(const std::string& body_id) const;
  // One page.
  absl::StatusOr<v1::ListBodiesResponse> ListBodies(const v1::ListBodiesRequest& request) const;
  // As ListAllHulls.
  absl::StatusOr<v1::ListBodiesResponse> ListAllBodies(const std::string& prefix,
                                                       uint64_t limit = 0) const;
  // Never retried, as DeleteHull.
  absl::StatusOr<v1::DeleteBodyResponse> DeleteBody(const std::string& body_id,
                                                    std::optional<uint64_t> if_revision = {}) const;

  // Tells of hulls as they come, change and go. The timeout bounds the search for a server that was
  // lost.
  std::unique_ptr<HullWatch> WatchHulls(const v1::WatchHullsRequest& request) const;

  absl::StatusOr<v1::CheckCollisionResponse> CheckCollision(
      const v1::CheckCollisionRequest& request) const;

  // Passes each message of the answer to `receive`, in order; an error of `receive` ends the call
  // and is returned. Retried only while nothing was received.
  using BatchReceiver = std::function<absl::Status(const v1::BatchCheckCollisionsResponse&)>;
  absl::Status BatchCheckCollisions(const v1::BatchCheckCollisionsRequest& request,
                                    const BatchReceiver& receive) const;

  // A stream of pose changes, to be opened with its first message, which gets the freshness of the
  // options. The timeout bounds the wait for
  // each answer.
  std::unique_ptr<CollisionStream> OpenCollisionStream() const;

  // The same as BatchCheckCollisions for all pairs of a scene.
  using SceneReceiver = std::function<absl::Status(const v1::FindCollisionsResponse&)>;
  absl::Status FindCollisions(const v1::FindCollisionsRequest& request,
                              const SceneReceiver& receive) const;

  // Tells when pairs begin and end to collide. The timeout bounds the search for a server that was
  // lost.
  std::unique_ptr<CollisionWatch> WatchCollisions(v1::CollisionWatchOpen open) const;

  absl::StatusOr<v1::GetStatusResponse> GetStatus() const;

  // What grpc.health.v1 reports about the whole server: OK when it is serving, FAILED_PRECONDITION
  // when it is not, UNIMPLEMENTED when the server has no health service. Not retried.
  absl::Status CheckHealth() const;

  const ClientOptions& options() const { return options_; }

 private:
  Deadline NextDeadline() const;

  // A call whose answer streams; `start` starts it. Retried only while nothing was received.
  template <typename Response, typename Start>
  absl::Status Receive(const Start& start,
                       const std::function<absl::Status(const Response&)>& receive) const;

  // The request, or `copy`, which is it with the freshness of the options.
  template <typename Request>
  const Request& WithFreshness(const Request& request, Request* copy) const;

  // One unary call; `retry` when it is safe to repeat.
  template <typename Response, typename Request, typename Stub>
  absl::StatusOr<Response> Call(Stub* stub,
                                grpc::Status (Stub::*method)(grpc::ClientContext*, const Request&,
                                                             Response*),
                                const Request& request, bool retry) const;

  ClientOptions options_;
  std::shared_ptr<grpc::Channel> channel_;
  std::shared_ptr<v1::HullService::Stub> hulls_;
  std::shared_ptr<v1::CollisionService::Stub> collisions_;
  std::unique_ptr<v1::BodyService::Stub> bodies_;
  std::unique_ptr<v1::StatusService::Stub> status_;
  std::unique_ptr<v1::MaintenanceService::Stub> maintenance_;
};

}  // namespace hulld

#endif  // HULLD_CLIENT_CLIENT_H_
