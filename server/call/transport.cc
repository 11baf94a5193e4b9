#include "server/call/transport.h"

#include <grpcpp/resource_quota.h>

#include <algorithm>
#include <cstddef>

namespace hulld::server {
namespace {

// Messages of the largest size that the transport holds in any case.
constexpr uint64_t kLargestMessages = 4;
// When a connection is asked whether it is still there, and how long it may take to say so.
constexpr int kKeepaliveTimeMs = 60'000;
constexpr int kKeepaliveTimeoutMs = 20'000;

}  // namespace

void SetTransport(const Config& config, grpc::ServerBuilder& builder) {
  // Without this a second server would share the port without a word.
  builder.AddChannelArgument(GRPC_ARG_ALLOW_REUSEPORT, 0);
  // A few bytes unpack to gigabytes, and do so before anything asks for their size.
  builder.SetCompressionAlgorithmSupportStatus(GRPC_COMPRESS_DEFLATE, false);
  builder.SetCompressionAlgorithmSupportStatus(GRPC_COMPRESS_GZIP, false);
  builder.SetMaxReceiveMessageSize(static_cast<int>(config.limits.max_message_bytes));
  // gRPC gathers a message before anyone can ask whose it is: many that never end must not fill the
  // memory. Beyond this it slows down or ends their calls.
  grpc::ResourceQuota quota("hulld");
  quota.Resize(
      std::max(config.limits.request_memory, kLargestMessages * config.limits.max_message_bytes));
  builder.SetResourceQuota(quota);
  builder.AddChannelArgument(GRPC_ARG_MAX_CONCURRENT_STREAMS, Config::kCallsPerConnection);
  // A peer that is gone without a word frees its streams after a minute or two, not hours.
  builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_TIME_MS, kKeepaliveTimeMs);
  builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_TIMEOUT_MS, kKeepaliveTimeoutMs);
}

}  // namespace hulld::server
