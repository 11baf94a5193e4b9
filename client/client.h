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
#include <span>
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
  // HOST:PORT, or several servers over one store; see server_address.h. ValidateServer checks it
  // beforehand. Without a port, gRPC connects to port 443.
  std::string server = kDefaultServer;
  // Timeout of each call, including retries. An append stream may last longer; for it, the timeout
  // bounds the wait for the next acknowledgement.
  std::chrono::milliseconds timeout{30000};
  RetryPolicy retry;
  // Freshness of reads that do not set one (proto/hulld/v1/freshness.proto). Defaults to
  // linearizable. Later pages of a list never have a lower revision than earlier ones.
  std::optional<v1::Freshness> freshness;
  // Opens a separate connection. By default, all clients in a process share one connection per
  // server.
  bool own_connection = false;
  // TLS and the token.
  ConnectionSecurity security;
};

// The canonical mesh of a hull, assembled from its stream and checked for consistency.
struct HullMesh {
  v1::MeshHeader header;
  // The vertices, n x 3.
  std::vector<double> xyz;
  // The number of vertices of each facet, and the concatenated vertex indices of all facets.
  std::vector<uint32_t> facet_sizes;
  std::vector<uint32_t> facet_indices;

  size_t vertex_count() const { return xyz.size() / 3; }
};

// A connection to hulld. Connects on first use. Thread-safe. Movable; a moved-from client may only
// be destroyed or assigned to. Streams and watches may outlive their client. gRPC does not survive
// a fork: after a process has used a client, its forked children must not use one unless they call
// exec.
//
// Errors carry the server's code and message. UNAVAILABLE and DEADLINE_EXCEEDED mean that no answer
// arrived. Calls that are safe to repeat are retried by options.retry until their deadline, after
// UNAVAILABLE and after RESOURCE_EXHAUSTED with a retry hint. DeleteHull, DeleteBody, ReplaceHull,
// SaveBackup, PutBody with if_revision, and CreateHull without if_absent are never retried.
// ReasonOf and MetadataOf (grpc_status.h) return the reason for a refusal. ValidateSecurity checks
// options.security beforehand.
class Client {
 public:
  explicit Client(ClientOptions options = {});
  // Uses the given channel, for example an in-process channel.
  Client(ClientOptions options, std::shared_ptr<grpc::Channel> channel);

  absl::StatusOr<v1::CreateHullResponse> CreateHull(const std::string& hull_id,
                                                    bool if_absent = false) const;

  // Opens a stream of chunks into a hull.
  absl::StatusOr<std::unique_ptr<Appender>> OpenAppend(const std::string& hull_id,
                                                       AppendOptions options = {}) const;

  // Replaces a hull by the hull of the points that `feed` passes to its sink, block by block. An
  // error from either ends the call and changes nothing. Not retried. The duration is proportional
  // to the number of points, so options.timeout does not apply; `timeout`, if given, bounds the
  // whole call.
  using PointSink = std::function<absl::Status(const v1::PointBlock&)>;
  using PointFeed = std::function<absl::Status(const PointSink&)>;
  absl::StatusOr<v1::ReplaceHullResponse> ReplaceHull(
      const v1::ReplaceOpen& open, const PointFeed& feed,
      std::optional<std::chrono::milliseconds> timeout = {}) const;
  // Same as above; creates the hull if it does not exist.
  absl::Status PutHull(const std::string& hull_id, const PointFeed& feed) const;
  // xyz: n x 3.
  absl::Status PutHull(const std::string& hull_id, std::span<const double> xyz) const;

  // Passes each part of a backup of the store to `receive`, in order. An error from `receive` ends
  // the call and is returned. Not retried; `timeout` as above.
  absl::Status SaveBackup(const std::function<absl::Status(const v1::SaveBackupResponse&)>& receive,
                          std::optional<std::chrono::milliseconds> timeout = {}) const;

  absl::StatusOr<v1::GetHullResponse> GetHull(const std::string& hull_id, bool audit = false) const;
  // Same as above, with all options of the request, such as properties.
  absl::StatusOr<v1::GetHullResponse> GetHull(const v1::GetHullRequest& request) const;

  // INTERNAL: the stream is inconsistent.
  absl::StatusOr<HullMesh> GetHullMesh(const std::string& hull_id) const;
  // Same as above, with all options of the request, such as a simplification. Calls `on_part`, if
  // set, after each part, with the mesh received so far. The header comes first. A retried call
  // starts over.
  absl::StatusOr<HullMesh> GetHullMesh(
      const v1::GetHullMeshRequest& request,
      const std::function<void(const HullMesh&)>& on_part = {}) const;

  // Returns one page.
  absl::StatusOr<v1::ListHullsResponse> ListHulls(const v1::ListHullsRequest& request) const;

  // Reads all pages, up to a total of `limit` hulls (0 means no limit). The result has the header
  // of the last page, and an empty next_page_token unless the limit ended the list.
  absl::StatusOr<v1::ListHullsResponse> ListAllHulls(const std::string& prefix,
                                                     uint64_t limit = 0) const;

  // Never retried: a repeated delete could remove a hull that another client has created since.
  absl::StatusOr<v1::DeleteHullResponse> DeleteHull(const std::string& hull_id,
                                                    std::optional<uint64_t> if_revision = {}) const;

  // Creates a body, or replaces its pieces. Retried only without if_revision, because the call is
  // then idempotent.
  absl::StatusOr<v1::PutBodyResponse> PutBody(const v1::PutBodyRequest& request) const;
  absl::StatusOr<v1::GetBodyResponse> GetBody(const std::string& body_id) const;
  // Returns one page.
  absl::StatusOr<v1::ListBodiesResponse> ListBodies(const v1::ListBodiesRequest& request) const;
  // Like ListAllHulls.
  absl::StatusOr<v1::ListBodiesResponse> ListAllBodies(const std::string& prefix,
                                                       uint64_t limit = 0) const;
  // Never retried, like DeleteHull.
  absl::StatusOr<v1::DeleteBodyResponse> DeleteBody(const std::string& body_id,
                                                    std::optional<uint64_t> if_revision = {}) const;

  // Watches creations, changes, and deletions of hulls. No attempt to connect, or to reconnect to a
  // lost server, starts after the timeout; an attempt takes at most 5 s.
  std::unique_ptr<HullWatch> WatchHulls(const v1::WatchHullsRequest& request) const;

  absl::StatusOr<v1::CheckCollisionResponse> CheckCollision(
      const v1::CheckCollisionRequest& request) const;

  // Passes each message of the answer to `receive`, in order. An error from `receive` ends the call
  // and is returned. Retried only before the first message.
  using BatchReceiver = std::function<absl::Status(const v1::BatchCheckCollisionsResponse&)>;
  absl::Status BatchCheckCollisions(const v1::BatchCheckCollisionsRequest& request,
                                    const BatchReceiver& receive) const;

  // Returns a stream for changes of poses. Its first message opens it, with the freshness of the
  // options. The timeout bounds the wait for each answer.
  std::unique_ptr<CollisionStream> OpenCollisionStream() const;

  // Like BatchCheckCollisions, for all pairs of a scene.
  using SceneReceiver = std::function<absl::Status(const v1::FindCollisionsResponse&)>;
  absl::Status FindCollisions(const v1::FindCollisionsRequest& request,
                              const SceneReceiver& receive) const;

  // Watches pairs for collisions that begin and end. The timeout is as for WatchHulls.
  std::unique_ptr<CollisionWatch> WatchCollisions(v1::CollisionWatchOpen open) const;

  absl::StatusOr<v1::GetStatusResponse> GetStatus() const;

  // Returns the grpc.health.v1 status of the whole server: OK if serving, FAILED_PRECONDITION if
  // not, UNIMPLEMENTED if the server has no health service. Not retried.
  absl::Status CheckHealth() const;

  const ClientOptions& options() const { return options_; }

 private:
  Deadline NextDeadline() const;

  // Runs a call with a streamed answer, begun by `start`. Retried only before the first message.
  template <typename Response, typename Start>
  absl::Status Receive(const Start& start,
                       const std::function<absl::Status(const Response&)>& receive) const;

  // Returns the request, or `copy`: the request with the freshness of the options.
  template <typename Request>
  const Request& WithFreshness(const Request& request, Request* copy) const;

  // Runs one unary call; retries it if `retry` is true, which requires a call that is safe to
  // repeat.
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
