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
#include "server/process/worker_pool.h"
#include "server/registry/body_resolution.h"
#include "server/registry/registry.h"
#include "server/registry/waiting_calls.h"

namespace hulld::server {

// The generated service, with methods on bytes (message_bytes.h).
using CollisionServiceOfBytes = v1::CollisionService::WithRawCallbackMethod_CheckCollision<
    v1::CollisionService::WithRawCallbackMethod_BatchCheckCollisions<
        v1::CollisionService::WithRawCallbackMethod_StreamCollisions<
            v1::CollisionService::WithRawCallbackMethod_FindCollisions<
                v1::CollisionService::WithRawCallbackMethod_WatchCollisions<
                    v1::CollisionService::Service>>>>>;

// hulld.v1.CollisionService: implements the contract in collision.proto on core's queries. A single
// pair is answered on arrival, on gRPC's thread, if only its relation is wanted and its hulls are
// of moderate size and ready. Everything else runs on `pool`: single pairs and steps of streams
// ahead of slices of batches, scenes and long steps. Work that may wait for the store, or that
// builds canonical snapshots, runs on `readers` (hulls of a pair) or `long_readers` (hulls of
// many). Pairs for TEXTBOOK_SAT are answered in pieces that alternate with other calls; pairs with
// enough axes to justify a team of threads go to the executor.
class CollisionService : public CollisionServiceOfBytes {
 public:
  CollisionService(Registry& registry, Admission& admission, WorkerPool& readers,
                   WorkerPool& long_readers, TaskPool& pool, Executor& executor)
      : registry_(registry),
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
  void AnswerLater(PairQuery query, const PlacedLookup& lookup, CheckCall* call);
  void AnswerPair(PairQuery query, absl::StatusOr<Resolved> resolved, CheckCall* call);
  void AnswerBodies(const PairQuery& query, Resolved resolved, CheckCall* call);
  // Answers the query on a suitable thread.
  void Compute(PairQuery query, CheckCall* call);
  // Submits the next piece of a textbook query, the duration of which depends on its hulls; other
  // calls run between pieces.
  struct TextbookQuery;
  void SubmitPiece(std::shared_ptr<TextbookQuery> query, CheckCall* call);

  Registry& registry_;
  Admission& admission_;
  WorkerPool& readers_;
  WorkerPool& long_readers_;
  TaskPool& pool_;
  Executor& executor_;
  WaitingCalls waiting_;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_COLLISIONS_COLLISION_SERVICE_H_
