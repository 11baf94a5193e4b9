#ifndef HULLD_SERVER_HULLS_REPLACE_STREAM_H_
#define HULLD_SERVER_HULLS_REPLACE_STREAM_H_

#include <absl/status/status.h>
#include <grpcpp/grpcpp.h>

#include <cstdint>
#include <memory>

#include "core/hull/growth/hull_builder.h"
#include "hulld/v1/hull.pb.h"
#include "server/call/call_stream.h"
#include "server/process/worker_pool.h"
#include "server/shards/shard_pools.h"
#include "server/shards/shards.h"

namespace hulld::server {

// One ReplaceHull call: builds a hull apart, message by message on a thread of the writers, and
// hands it to the registry when the client has said all. One thing at a time is under way, a read
// or the building of what was read, so the state needs no mutex.
class ReplaceStream : public ReadingStream<CallStream<ReadReactor>, v1::ReplaceHullRequest> {
 public:
  // writers: the threads that build. response: as gRPC holds it until the call ends.
  static ReadReactor* Start(grpc::CallbackServerContext& context, Admission& admission,
                            Shards& shards, ShardPools& writers, grpc::ByteBuffer* response);

 private:
  ReplaceStream(grpc::CallbackServerContext& context, Admission& admission, Shards& shards,
                ShardPools& writers, grpc::ByteBuffer* response)
      : ReadingStream(context, admission, Rpc::kReplaceHull),
        shards_(shards),
        writers_(writers),
        response_(response),
        charge_(shards.memory(), MemoryUse::kWriting) {}

  void Open() override { Read(); }
  void OnMessage() override;
  void OnNoMessage(const absl::Status& why) override;

  absl::Status HandleMessage();
  absl::Status HandleOpen(const v1::ReplaceOpen& open);
  absl::Status Build();
  void Commit();
  // Once the hull is named.
  WorkerPool& writers() { return writers_.of(shards_.shard_of(replacement_.hull_id)); }

  Shards& shards_;
  ShardPools& writers_;
  grpc::ByteBuffer* const response_;
  // Covers the builder until the registry has it.
  MemoryCharge charge_;
  Replacement replacement_;
  uint64_t messages_ = 0;
  // The last message was an empty block.
  bool complete_ = false;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_HULLS_REPLACE_STREAM_H_
