#ifndef HULLD_TESTS_CLIENT_FAKE_HULLD_H_
#define HULLD_TESTS_CLIENT_FAKE_HULLD_H_

#include <grpcpp/server.h>

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "hulld/v1/collision.grpc.pb.h"
#include "hulld/v1/error.pb.h"
#include "hulld/v1/hull.grpc.pb.h"
#include "hulld/v1/status.grpc.pb.h"

namespace hulld {

// An error as hulld gives it: with a reason and metadata in its details.
grpc::Status HulldError(grpc::StatusCode code, const std::string& message, v1::ErrorReason reason,
                        const std::map<std::string, std::string>& metadata = {});

// What the fake server holds of a hull: every point, as if each were a vertex.
struct FakeHull {
  uint64_t create_revision = 0;
  uint64_t revision = 0;
  std::vector<double> xyz;
  // Last committed sequence by writer.
  std::map<std::string, uint64_t> last_sequence;
};

// What happens to the next append stream; the default is that all goes well.
struct StreamScript {
  // The stream breaks as if the connection did, after this many chunks were committed...
  std::optional<int> break_after;
  // ... and their acknowledgements are lost.
  bool lose_acks = false;
  // It ends with RESOURCE_EXHAUSTED instead, as if the server had too much to do.
  bool exhausted = false;
  // When the server says that the client may come again.
  std::optional<std::chrono::milliseconds> retry_hint;
  // Only each n-th chunk is acknowledged, with those before it.
  int ack_every = 1;
  // Every chunk but no acknowledgement is taken, until Release().
  bool hold_acks = false;
  // The chunk with this sequence is refused.
  uint64_t refuse_sequence = 0;
};

// A server without geometry on a free port of 127.0.0.1: remembers what it is told, fails when it
// is told to.
class FakeHulld final {
 public:
  FakeHulld();
  ~FakeHulld();

  const std::string& address() const { return address_; }

  // The next calls of a method ("GetHull") end with these statuses, one after another.
  void FailNext(const std::string& method, std::vector<grpc::Status> statuses);
  // Calls of a method wait for Release().
  void Hang(const std::string& method);
  void Release();
  void ScriptStreams(std::vector<StreamScript> scripts);
  void SetServing(bool serving);

  int calls(const std::string& method);
  FakeHull hull(const std::string& hull_id);
  void PutHull(const std::string& hull_id, FakeHull hull);
  void RemoveHull(const std::string& hull_id);
  // The most chunks that any stream had received without acknowledging them.
  int most_unacknowledged();

  // Replaces the parts of every mesh; the relations of every batch.
  std::vector<v1::GetHullMeshResponse> mesh_parts;
  v1::GetHullMeshRequest last_mesh_request;
  std::optional<std::vector<v1::BatchCheckCollisionsResponse>> batch_answers;
  v1::CheckCollisionResponse collision_answer;
  v1::CheckCollisionRequest last_collision_request();
  std::vector<v1::BatchCheckCollisionsRequest> batch_requests();
  std::vector<v1::ListHullsRequest> list_requests();
  std::string audit_finding;

 private:
  class Hulls;
  class Collisions;
  class Status;

  // Counts the call; returns the status that was asked for, or OK if none was.
  grpc::Status Enter(const std::string& method);

  std::mutex mutex_;
  std::condition_variable changed_;
  std::map<std::string, std::deque<grpc::Status>> failures_;
  std::map<std::string, int> calls_;
  std::map<std::string, bool> hanging_;
  bool released_ = false;
  std::deque<StreamScript> scripts_;
  std::map<std::string, FakeHull> hulls_;
  uint64_t revision_ = 0;
  int most_unacknowledged_ = 0;
  v1::CheckCollisionRequest last_collision_request_;
  std::vector<v1::BatchCheckCollisionsRequest> batch_requests_;
  std::vector<v1::ListHullsRequest> list_requests_;

  std::unique_ptr<Hulls> hull_service_;
  std::unique_ptr<Collisions> collision_service_;
  std::unique_ptr<Status> status_service_;
  std::unique_ptr<grpc::Server> server_;
  std::string address_;
};

}  // namespace hulld

#endif  // HULLD_TESTS_CLIENT_FAKE_HULLD_H_
