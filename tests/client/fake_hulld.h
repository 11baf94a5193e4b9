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

// Returns an error in hulld's format: with a reason and metadata in its details.
grpc::Status HulldError(grpc::StatusCode code, const std::string& message, v1::ErrorReason reason,
                        const std::map<std::string, std::string>& metadata = {});

// The fake server's state of a hull: every point, as if each were a vertex.
struct FakeHull {
  uint64_t create_revision = 0;
  uint64_t revision = 0;
  std::vector<double> xyz;
  // Last committed sequence by writer.
  std::map<std::string, uint64_t> last_sequence;
};

// Behavior of the next append stream; by default it succeeds.
struct StreamScript {
  // Breaks the stream like a lost connection after this many chunks were committed.
  std::optional<int> break_after;
  // Loses their acks.
  bool lose_acks = false;
  // Ends the stream with RESOURCE_EXHAUSTED instead, like an overloaded server.
  bool exhausted = false;
  // Delay until the client may retry, as sent by the server.
  std::optional<std::chrono::milliseconds> retry_hint;
  // Acknowledges each n-th chunk, together with the chunks before it.
  int ack_every = 1;
  // Accepts every chunk but sends no ack until Release().
  bool hold_acks = false;
  // Refuses the chunk with this sequence.
  uint64_t refuse_sequence = 0;
};

// A server without geometry on a free port of 127.0.0.1. It records requests, and fails on demand.
class FakeHulld final {
 public:
  FakeHulld();
  ~FakeHulld();

  const std::string& address() const { return address_; }

  // Ends the next calls of a method ("GetHull") with these statuses, in order.
  void FailNext(const std::string& method, std::vector<grpc::Status> statuses);
  // Blocks calls of a method until Release().
  void Hang(const std::string& method);
  void Release();
  void ScriptStreams(std::vector<StreamScript> scripts);
  void SetServing(bool serving);

  int calls(const std::string& method);
  FakeHull hull(const std::string& hull_id);
  void PutHull(const std::string& hull_id, FakeHull hull);
  void RemoveHull(const std::string& hull_id);
  // Returns the maximum number of unacknowledged chunks of any stream.
  int max_unacknowledged();

  // Override the parts of every mesh and the relations of every batch.
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

  // Counts the call; returns the status set for it, or OK.
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
  int max_unacknowledged_ = 0;
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
