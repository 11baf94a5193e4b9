#ifndef HULLD_SERVER_HULLS_REPLACE_STREAM_H_
#define HULLD_SERVER_HULLS_REPLACE_STREAM_H_

#include <absl/status/status.h>
#include <grpcpp/grpcpp.h>

#include <cstdint>

#include "core/hull/growth/hull_builder.h"
#include "hulld/v1/hull.pb.h"
#include "server/call/call_stream.h"
#include "server/call/service_parts.h"

namespace hulld::server {

// A ReplaceHull call: builds a separate hull, message by message on a writer thread, and passes it
// to the registry when the client has sent everything. Only one operation, a read or a build, is in
// flight at a time, so the state needs no mutex.
class ReplaceStream : public ReadingStream<CallStream<ReadReactor>, v1::ReplaceHullRequest> {
 public:
  // response: owned by gRPC until the call ends.
  ReplaceStream(CallContext& context, const ServiceParts& parts, Bytes* response)
      : ReadingStream(context, parts.admission, Rpc::kReplaceHull),
        parts_(parts),
        response_(response),
        charge_(parts.registry.memory(), MemoryUse::kWriting) {}

 private:
  void Open() override { Read(); }
  void OnMessage() override;
  void OnNoMessage(const absl::Status& why) override;

  absl::Status HandleMessage();
  absl::Status HandleOpen(const v1::ReplaceOpen& open);
  absl::Status Build();
  void Commit();

  const ServiceParts& parts_;
  Bytes* const response_;
  // Memory charged for the builder until the registry takes ownership.
  MemoryCharge charge_;
  Replacement replacement_;
  uint64_t messages_ = 0;
  // True if the last message was an empty block.
  bool complete_ = false;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_HULLS_REPLACE_STREAM_H_
