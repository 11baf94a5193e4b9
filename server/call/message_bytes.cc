#include "server/call/message_bytes.h"

#include <absl/strings/str_cat.h>
#include <google/protobuf/io/coded_stream.h>
#include <grpcpp/impl/codegen/proto_utils.h>
#include <grpcpp/support/proto_buffer_reader.h>

#include "core/base/check.h"
#include "server/call/message_layout.h"

namespace hulld::server {
namespace {

absl::Status Malformed(const google::protobuf::Message& message) {
  return absl::InvalidArgumentError(
      absl::StrCat("a message is malformed: it is not a ", message.GetTypeName(),
                   "; check the serializer, and that strings are UTF-8"));
}

}  // namespace

absl::Status ParseRequest(Bytes& bytes, RequestMemory& memory, google::protobuf::Message* message,
                          RequestMemory::Share& share) {
  {
    grpc::ProtoBufferReader reader(&bytes);
    google::protobuf::io::CodedInputStream input(&reader);
    const MessageLayout& layout = MessageLayout::Of(*message->GetDescriptor());
    const uint64_t parsed = layout.ParsedBytes(input, memory.limit_bytes());
    if (absl::Status s = memory.Take(parsed, share); !s.ok()) return s;
  }
  bool is_message = false;
  {
    grpc::ProtoBufferReader reader(&bytes);
    is_message = reader.status().ok() && message->ParseFromZeroCopyStream(&reader);
  }
  bytes.Clear();
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
