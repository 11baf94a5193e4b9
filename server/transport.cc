#include "server/transport.h"

namespace hulld::server {

void SetTransport(const Config& config, grpc::ServerBuilder& builder) {
  // Without this a second server would share the port without a word.
  builder.AddChannelArgument(GRPC_ARG_ALLOW_REUSEPORT, 0);
  // A few bytes unpack to gigabytes, and do so before anything asks for their size.
  builder.SetCompressionAlgorithmSupportStatus(GRPC_COMPRESS_DEFLATE, false);
  builder.SetCompressionAlgorithmSupportStatus(GRPC_COMPRESS_GZIP, false);
  builder.SetMaxReceiveMessageSize(static_cast<int>(config.limits.max_message_bytes));
}

}  // namespace hulld::server
