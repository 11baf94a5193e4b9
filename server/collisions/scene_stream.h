#ifndef HULLD_SERVER_COLLISIONS_SCENE_STREAM_H_
#define HULLD_SERVER_COLLISIONS_SCENE_STREAM_H_

#include <absl/status/status.h>
#include <grpcpp/grpcpp.h>

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <deque>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <vector>

#include "core/query/scene.h"
#include "hulld/v1/collision.pb.h"
#include "server/call/call.h"
#include "server/collisions/placement_table.h"
#include "server/process/executor.h"
#include "server/process/worker_pool.h"
#include "server/registry/registry.h"

namespace hulld::server {

// One FindCollisions call. It resolves every hull once, on a reader thread, then searches the scene
// on the executor; what is found is sent meanwhile. A client that reads too slowly for what it
// asked for ends the call, so that it neither fills our memory nor holds the executor.
class SceneStream : public grpc::ServerWriteReactor<v1::FindCollisionsResponse>,
                    public std::enable_shared_from_this<SceneStream> {
 public:
  // `request` must outlive the call, as gRPC's requests do.
  static grpc::ServerWriteReactor<v1::FindCollisionsResponse>* Start(
      grpc::CallbackServerContext& context, Admission& admission, Registry& registry,
      WorkerPool& readers, Executor& executor, const v1::FindCollisionsRequest& request);

 private:
  SceneStream(grpc::CallbackServerContext& context, Admission& admission, Registry& registry,
              Executor& executor, const v1::FindCollisionsRequest& request)
      : registry_(registry),
        executor_(executor),
        request_(request),
        call_(context, admission, Rpc::kFindCollisions) {}

  void OnWriteDone(bool ok) override;
  void OnCancel() override;
  void OnDone() override { self_.reset(); }

  absl::Status Open();
  void QueueHead();
  absl::Status Search();
  void Take(std::span<const SceneAnswer> answers);
  void Count(v1::Relation relation);
  bool IsIdle();
  void Send();
  void End(const absl::Status& status);
  // Requires the mutex: starts whatever may start now.
  void Proceed();

  Registry& registry_;
  Executor& executor_;
  const v1::FindCollisionsRequest& request_;
  Call call_;
  // Keeps this alive until gRPC is done with it.
  std::shared_ptr<SceneStream> self_;

  // Owned by the one task that runs for this call, if any.
  SceneOptions options_;
  std::vector<GroupPair> ignored_groups_;
  PlacementTable table_;
  v1::FindCollisionsResponse filling_;
  size_t filling_bytes_ = 0;
  v1::SceneTotals totals_;
  std::atomic<bool> too_slow_ = false;
  std::chrono::steady_clock::duration patience_left_;

  std::mutex mutex_;
  std::condition_variable sent_;
  // The rest is guarded by the mutex.
  std::deque<v1::FindCollisionsResponse> ready_;
  v1::FindCollisionsResponse in_flight_;
  bool searching_ = true;
  bool writing_ = false;
  bool finished_ = false;
  // Set once nothing more is to come.
  std::optional<absl::Status> end_;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_COLLISIONS_SCENE_STREAM_H_
