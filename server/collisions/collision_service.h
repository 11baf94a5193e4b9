#ifndef HULLD_SERVER_COLLISIONS_COLLISION_SERVICE_H_
#define HULLD_SERVER_COLLISIONS_COLLISION_SERVICE_H_

#include <grpcpp/grpcpp.h>

#include <cstddef>
#include <memory>

#include "hulld/v1/collision.grpc.pb.h"
#include "server/call/admission.h"
#include "server/call/call_stream.h"
#include "server/collisions/pair_question.h"
#include "server/process/task_pool.h"
#include "server/process/worker_pool.h"
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
// of moderate size and ready (PairQuestion). Everything else runs on `pool`: single pairs and short
// steps of streams before slices of batches, scenes and long steps. Work that may wait for the
// store, or that builds canonical snapshots, runs on `readers` (hulls of a pair) or `long_readers`
// (hulls of many). Pairs for TEXTBOOK_SAT are answered in slices that alternate with other calls.
class CollisionService : public CollisionServiceOfBytes {
 public:
  CollisionService(Registry& registry, Admission& admission, WorkerPool& readers,
                   WorkerPool& long_readers, TaskPool& pool)
      : registry_(registry),
        admission_(admission),
        readers_(readers),
        long_readers_(long_readers),
        pool_(pool) {}

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
  void Check(CheckCall* call);
  bool TryAnswer(PairQuestion& question);
  void AnswerLater(std::shared_ptr<PairQuestion> question, ClientId client);

  Registry& registry_;
  Admission& admission_;
  WorkerPool& readers_;
  WorkerPool& long_readers_;
  TaskPool& pool_;
  WaitingCalls waiting_;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_COLLISIONS_COLLISION_SERVICE_H_
