#include "server/call/message_bytes.h"

#include <absl/strings/str_cat.h>
#include <grpcpp/impl/codegen/proto_utils.h>
#include <grpcpp/support/slice.h>

#include <chrono>
#include <string_view>

#include "core/base/check.h"
#include "core/base/status_macros.h"
#include "server/call/message_layout.h"
#include "server/contract/errors.h"

namespace hulld::server {
namespace {

constexpr char kFlag[] = "request-memory";
// A large request takes about as long as a batch.
constexpr std::chrono::milliseconds kRetry(1000);

absl::Status Malformed(const google::protobuf::Message& message) {
  return InvalidArgument("a message is malformed: it is not a ", message.GetTypeName(),
                         "; check the serializer, and that strings are UTF-8");
}

}  // namespace

absl::Status RequestMemory::Take(uint64_t bytes, Share& share) {
  share.Release();
  if (bytes > limit_bytes_) {
    return LimitExceeded(absl::StrCat("the message would take more than ", limit_bytes_,
                                      " bytes of memory; split it into smaller messages"),
                         limit_bytes_, kFlag);
  }
  const uint64_t taken = taken_.fetch_add(bytes, std::memory_order_relaxed) + bytes;
  if (taken > limit_bytes_) {
    taken_.fetch_sub(bytes, std::memory_order_relaxed);
    return Overloaded("requests in flight use all request memory", limit_bytes_, kFlag, kRetry);
  }
  share.memory_ = this;
  share.bytes_ = bytes;
  return absl::OkStatus();
}

absl::Status ParseRequest(Bytes& bytes, RequestMemory& memory, google::protobuf::Message* message,
                          RequestMemory::Share& share) {
  grpc::Slice slice;
  // Copies only a message in several slices.
  if (!bytes.TrySingleSlice(&slice).ok() && !bytes.DumpToSingleSlice(&slice).ok()) {
    return Malformed(*message);
  }
  bytes.Clear();
  const std::string_view text(reinterpret_cast<const char*>(slice.begin()), slice.size());
  const MessageLayout& layout = MessageLayout::Of(*message->GetDescriptor());
  HULLD_RETURN_IF_ERROR(memory.Take(layout.ParsedBytes(text, memory.limit_bytes()), share));
  const bool is_message = message->ParseFromArray(text.data(), static_cast<int>(text.size()));
  return is_message ? absl::OkStatus() : Malformed(*message);
}

Bytes SerializeReply(const google::protobuf::Message& message) {
  Bytes bytes;
  bool is_owned = false;
  const grpc::Status serialized =
      grpc::SerializationTraits<google::protobuf::Message>::Serialize(message, &bytes, &is_owned);
  // Fails only for messages of 2 GiB or more.
  HULLD_CHECK(serialized.ok());
  return bytes;
}

}  // namespace hulld::server
