#ifndef HULLD_SERVER_COLLISIONS_BATCH_STREAM_H_
#define HULLD_SERVER_COLLISIONS_BATCH_STREAM_H_

#include <absl/status/statusor.h>
#include <grpcpp/grpcpp.h>

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <memory>
#include <mutex>
#include <optional>
#include <vector>

#include "core/query/batch.h"
#include "hulld/v1/collision.pb.h"
#include "server/call/call.h"
#include "server/collisions/placement_table.h"
#include "server/process/executor.h"
#include "server/process/worker_pool.h"
#include "server/registry/registry.h"
#include "server/wire/batch_columns.h"

namespace hulld::server {

// One BatchCheckCollisions call. It resolves every hull once, on a reader thread, then answers
// slices of pairs on the executor, taking turns with other batches; a slice is computed while the
// one before is sent, and no further ahead.
class BatchStream : public grpc::ServerWriteReactor<v1::BatchCheckCollisionsResponse>,
                    public std::enable_shared_from_this<BatchStream> {
 public:
  // `request` must outlive the call, as gRPC's requests do.
  static grpc::ServerWriteReactor<v1::BatchCheckCollisionsResponse>* Start(
      grpc::CallbackServerContext& context, Admission& admission, Registry& registry,
      WorkerPool& readers, Executor& executor, const v1::BatchCheckCollisionsRequest& request);

 private:
  BatchStream(grpc::CallbackServerContext& context, Admission& admission, Registry& registry,
              Executor& executor, const v1::BatchCheckCollisionsRequest& request)
      : registry_(registry),
        executor_(executor),
        request_(request),
        call_(context, admission, Rpc::kBatchCheckCollisions) {}

  void OnWriteDone(bool ok) override;
  void OnCancel() override { call_.Cancel(); }
  void OnDone() override { self_.reset(); }

  size_t pair_count() const { return static_cast<size_t>(request_.pairs_size()) / 2; }

  absl::Status Validate();
  // Requires the mutex: leaves the last piece of the table of hulls in head_, for the first
  // answers.
  void QueueHead();
  void Open();
  PlacedPair PairAt(size_t i) const;
  bool IsAnswerable(const PlacedPair& pair) const;
  size_t SliceEnd() const;
  std::vector<absl::StatusOr<Answer>> AnswerPairs(const std::vector<PlacedPair>& pairs) const;
  absl::Status ComputeSlice();
  void Send(BatchColumns& columns, size_t end);
  void AdaptSlice(size_t pairs, std::chrono::steady_clock::duration elapsed);
  // Requires the mutex: starts whatever may start now.
  void Proceed();

  Registry& registry_;
  Executor& executor_;
  const v1::BatchCheckCollisionsRequest& request_;
  Call call_;
  // Keeps this alive until gRPC is done with it.
  std::shared_ptr<BatchStream> self_;

  // Owned by the one task that runs for this call, if any.
  QueryOptions options_;
  PlacementTable table_;
  v1::BatchCheckCollisionsResponse head_;
  size_t next_pair_ = 0;
  size_t slice_pairs_ = 0;

  std::mutex mutex_;
  // The rest is guarded by the mutex.
  std::deque<v1::BatchCheckCollisionsResponse> ready_;
  v1::BatchCheckCollisionsResponse in_flight_;
  bool computing_ = true;
  bool writing_ = false;
  bool finished_ = false;
  // Set once no slice is left to compute.
  std::optional<absl::Status> end_;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_COLLISIONS_BATCH_STREAM_H_
