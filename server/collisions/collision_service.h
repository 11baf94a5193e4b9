#ifndef HULLD_SERVER_COLLISIONS_COLLISION_SERVICE_H_
#define HULLD_SERVER_COLLISIONS_COLLISION_SERVICE_H_

#include <grpcpp/grpcpp.h>

#include <cstddef>
#include <memory>

#include "hulld/v1/collision.grpc.pb.h"
#include "server/call/admission.h"
#include "server/call/call_stream.h"
#include "server/call/unary_call.h"
#include "server/process/executor.h"
#include "server/process/task_pool.h"
#include "server/shards/body_resolution.h"
#include "server/shards/shard_pools.h"
#include "server/shards/shards.h"
#include "server/shards/waiting_calls.h"

namespace hulld::server {

// The generated service; its methods take and give bytes (message_bytes.h).
using CollisionServiceOfBytes = v1::CollisionService::WithRawCallbackMethod_CheckCollision<
    v1::CollisionService::WithRawCallbackMethod_BatchCheckCollisions<
        v1::CollisionService::WithRawCallbackMethod_StreamCollisions<
            v1::CollisionService::WithRawCallbackMethod_FindCollisions<
                v1::CollisionService::WithRawCallbackMethod_WatchCollisions<
                    v1::CollisionService::Service>>>>>;

// hulld.v1.CollisionService: the contract in collision.proto over core's queries. A single pair is
// answered where it arrives, on gRPC's thread, when only its relation is wanted and its hulls are
// of moderate size and ready. Everything else is computed by `pool`: single pairs and the steps of
// streams ahead of slices of batches, scenes and long steps. What may wait for the store, and what
// makes canonical snapshots, runs on `readers`, hulls of one pair, or `long_readers`, hulls of
// many. Pairs for TEXTBOOK_SAT are answered in pieces, between which others have their turn; those
// whose loop over axes is worth a team of threads go to the executor.
class CollisionService : public CollisionServiceOfBytes {
 public:
  CollisionService(Shards& shards, Admission& admission, ShardPools& readers,
                   ShardPools& long_readers, TaskPool& pool, Executor& executor)
      : shards_(shards),
        admission_(admission),
        readers_(readers),
        long_readers_(long_readers),
        pool_(pool),
        executor_(executor) {}

  // Calls that wait for the store without a thread.
  size_t waiting() const { return waiting_.count(); }

  grpc::ServerUnaryReactor* CheckCollision(grpc::CallbackServerContext* context,
                                           const grpc::ByteBuffer* request,
                                           grpc::ByteBuffer* response) override;
  WriteReactor* BatchCheckCollisions(grpc::CallbackServerContext* context,
                                     const grpc::ByteBuffer* request) override;
  BidiReactor* StreamCollisions(grpc::CallbackServerContext* context) override;
  WriteReactor* FindCollisions(grpc::CallbackServerContext* context,
                               const grpc::ByteBuffer* request) override;
  BidiReactor* WatchCollisions(grpc::CallbackServerContext* context) override;

 private:
  using CheckCall = UnaryCall<v1::CheckCollisionRequest, v1::CheckCollisionResponse>;
  struct PairQuery;

  void Check(CheckCall* call);
  WorkerPool& ReadersOf(const v1::CheckCollisionRequest& request);
  void AnswerLater(PairQuery query, const PlacedLookup& lookup, CheckCall* call);
  void AnswerPair(PairQuery query, absl::StatusOr<ShardsResolved> resolved, CheckCall* call);
  void AnswerBodies(const PairQuery& query, ShardsResolved resolved, CheckCall* call);
  // Answers the query on the thread that suits it.
  void Compute(PairQuery query, CheckCall* call);
  // The next piece of a query for the textbook, which lasts as long as its hulls are large: others
  // have their turn after each.
  struct TextbookQuery;
  void SubmitPiece(std::shared_ptr<TextbookQuery> query, CheckCall* call);

  Shards& shards_;
  Admission& admission_;
  ShardPools& readers_;
  ShardPools& long_readers_;
  TaskPool& pool_;
  Executor& executor_;
  WaitingCalls waiting_;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_COLLISIONS_COLLISION_SERVICE_H_
