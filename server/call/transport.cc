#include "server/call/transport.h"

#include <grpcpp/resource_quota.h>

#include <algorithm>

namespace hulld::server {
namespace {

// The transport can always buffer this many messages of maximum size.
constexpr uint64_t kLargestMessages = 4;
// Keepalive interval and timeout.
constexpr int kKeepaliveTimeMs = 60'000;
constexpr int kKeepaliveTimeoutMs = 20'000;
// Minimum interval of clients' pings, which gRPC would set to 5 minutes. Connections that send
// three pings too early are closed.
constexpr int kMinPingIntervalMs = 500;

}  // namespace

uint64_t MaxHalfOpenBytes(const Config& config) {
  return std::max(config.limits.request_memory / 8 * 3,
                  kLargestMessages * config.limits.max_message_bytes);
}

void SetTransport(const Config& config, grpc::ServerBuilder& builder) {
  // Without this, a second server would silently share the port.
  builder.AddChannelArgument(GRPC_ARG_ALLOW_REUSEPORT, 0);
  // A few compressed bytes could expand to gigabytes before any size check.
  builder.SetCompressionAlgorithmSupportStatus(GRPC_COMPRESS_DEFLATE, false);
  builder.SetCompressionAlgorithmSupportStatus(GRPC_COMPRESS_GZIP, false);
  builder.SetMaxReceiveMessageSize(static_cast<int>(config.limits.max_message_bytes));
  // gRPC buffers a message before authentication, and many incomplete messages must not exhaust
  // memory. Above this quota, gRPC slows down or ends their calls, or crashes (frame_guard.h).
  // Without TLS, half-open streams stay far below it.
  grpc::ResourceQuota quota("hulld");
  quota.Resize(MaxHalfOpenBytes(config) / 3 * 8);
  builder.SetResourceQuota(quota);
  builder.AddChannelArgument(GRPC_ARG_MAX_CONCURRENT_STREAMS, Config::kCallsPerConnection);
  builder.AddChannelArgument(GRPC_ARG_SERVER_HANDSHAKE_TIMEOUT_MS,
                             static_cast<int>(Config::kHandshakeTimeout.count()));
  // Frees the streams of a silently vanished peer within a minute or two instead of hours.
  builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_TIME_MS, kKeepaliveTimeMs);
  builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_TIMEOUT_MS, kKeepaliveTimeoutMs);
  builder.AddChannelArgument(GRPC_ARG_HTTP2_MIN_RECV_PING_INTERVAL_WITHOUT_DATA_MS,
                             kMinPingIntervalMs);
}

}  // namespace hulld::server
