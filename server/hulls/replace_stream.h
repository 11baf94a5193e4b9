#ifndef HULLD_SERVER_HULLS_REPLACE_STREAM_H_
#define HULLD_SERVER_HULLS_REPLACE_STREAM_H_

#include <absl/status/status.h>
#include <grpcpp/grpcpp.h>

#include <cstdint>
#include <memory>

#include "core/hull/growth/hull_builder.h"
#include "hulld/v1/hull.pb.h"
#include "server/call/call.h"
#include "server/process/worker_pool.h"
#include "server/registry/registry.h"

namespace hulld::server {

// One ReplaceHull call: builds a hull apart, message by message on a thread of the writers, and
// hands it to the registry when the client has said all. One step follows the other, so that
// nothing needs a lock: a read, or the building of what was read. It owns itself until gRPC is done
// with it.
class ReplaceStream : public grpc::ServerReadReactor<v1::ReplaceHullRequest> {
 public:
  static grpc::ServerReadReactor<v1::ReplaceHullRequest>* Start(
      grpc::CallbackServerContext& context, Admission& admission, Registry& registry,
      WorkerPool& writers, v1::ReplaceHullResponse* response);

 private:
  ReplaceStream(grpc::CallbackServerContext& context, Admission& admission, Registry& registry,
                WorkerPool& writers, v1::ReplaceHullResponse* response)
      : registry_(registry),
        writers_(writers),
        response_(response),
        call_(context, admission, Rpc::kReplaceHull),
        charge_(registry.memory()) {}

  void OnReadDone(bool ok) override;
  void OnCancel() override { call_.Cancel(); }
  void OnDone() override { delete this; }

  void Read();
  absl::Status HandleOpen(const v1::ReplaceOpen& open);
  absl::Status Build();
  void Commit();
  void End(const absl::Status& status);

  Registry& registry_;
  WorkerPool& writers_;
  v1::ReplaceHullResponse* response_;
  Call call_;
  // Of the builder, until the registry has it. Goes before the call, which keeps the server alive.
  MemoryCharge charge_;
  v1::ReplaceHullRequest request_;
  Replacement replacement_;
  uint64_t messages_ = 0;
  // The last message was an empty block.
  bool complete_ = false;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_HULLS_REPLACE_STREAM_H_
