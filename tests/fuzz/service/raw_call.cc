#include "tests/fuzz/service/raw_call.h"

#include <absl/strings/str_cat.h>
#include <google/protobuf/descriptor.h>
#include <google/protobuf/message.h>
#include <grpcpp/completion_queue.h>

#include <memory>

namespace hulld::fuzz {
namespace {

using google::protobuf::DescriptorPool;
using google::protobuf::Message;
using google::protobuf::MessageFactory;
using google::protobuf::MethodDescriptor;
using google::protobuf::ServiceDescriptor;

// Searches the services linked into the program.
const MethodDescriptor* FindMethod(server::Rpc rpc) {
  for (const char* service :
       {"hulld.v1.HullService", "hulld.v1.BodyService", "hulld.v1.CollisionService",
        "hulld.v1.StatusService", "hulld.v1.MaintenanceService",
        "grpc.reflection.v1alpha.ServerReflection"}) {
    const ServiceDescriptor* const found =
        DescriptorPool::generated_pool()->FindServiceByName(service);
    if (found == nullptr) continue;
    const MethodDescriptor* const method = found->FindMethodByName(server::RpcName(rpc));
    if (method != nullptr) return method;
  }
  return nullptr;
}

std::unique_ptr<Message> NewRequest(const MethodDescriptor& method) {
  return std::unique_ptr<Message>(
      MessageFactory::generated_factory()->GetPrototype(method.input_type())->New());
}

std::string Noise(ByteReader& in) {
  std::string noise;
  for (size_t n = in.Below(40); n > 0; --n) noise += static_cast<char>(in.Byte());
  return noise;
}

// Returns starts of groups without ends.
std::string Nested(ByteReader& in) {
  return std::string(static_cast<size_t>(in.Byte()) * 4, '\x0b');
}

std::string Changed(std::string bytes, ByteReader& in) {
  for (size_t n = 1 + in.Below(4); n > 0 && !bytes.empty(); --n) {
    const size_t at = (static_cast<size_t>(in.Byte()) << 8 | in.Byte()) % bytes.size();
    switch (in.Below(3)) {
      case 0:
        bytes[at] = static_cast<char>(in.Byte());
        break;
      case 1:
        bytes.resize(at);
        break;
      default:
        bytes.insert(at, Noise(in));
    }
  }
  return bytes;
}

std::string RawMessage(ByteReader& in, const MessageHints& hints, Message& message) {
  switch (in.Below(8)) {
    case 0:
      return Noise(in);
    case 1:
      return Nested(in);
    case 2:
      // An ID that is not UTF-8: field 1 of most requests.
      return std::string("\x0a\x02\xc3\x28", 4);
    case 3:
      // Sometimes more than the server accepts.
      return std::string(in.OneOf(4) ? 70'000 : 500, static_cast<char>(in.Byte()));
    case 4:
      return {};
    default:
      FillMessage(in, hints, &message);
      return Changed(message.SerializePartialAsString(), in);
  }
}

grpc::ByteBuffer ToBuffer(const std::string& bytes) {
  const grpc::Slice slice(bytes);
  return grpc::ByteBuffer(&slice, 1);
}

// Waits for the operation just started.
bool Wait(grpc::CompletionQueue& queue) {
  void* tag = nullptr;
  bool ok = false;
  return queue.Next(&tag, &ok) && ok;
}

}  // namespace

bool LastsUntilCancelled(server::Rpc rpc) { return rpc == server::Rpc::kWatchHulls; }

RawCall DecodeRawCall(ByteReader& in, const MessageHints& hints) {
  RawCall call;
  call.rpc = static_cast<server::Rpc>(in.Below(server::kRpcCount));
  if (FindMethod(call.rpc) == nullptr) call.rpc = server::Rpc::kGetStatus;
  const MethodDescriptor* const method = FindMethod(call.rpc);
  const std::unique_ptr<Message> message = NewRequest(*method);
  for (size_t n = method->client_streaming() ? in.Below(3) : 1; n > 0; --n) {
    call.messages.push_back(RawMessage(in, hints, *message));
  }
  call.malformed = !call.messages.empty() && !message->ParsePartialFromString(call.messages[0]);
  return call;
}

grpc::Status MakeRawCall(grpc::GenericStub& stub, grpc::ClientContext& context,
                         const RawCall& call) {
  const MethodDescriptor& method = *FindMethod(call.rpc);
  grpc::CompletionQueue queue;
  const auto stream = stub.PrepareCall(
      &context, absl::StrCat("/", method.service()->full_name(), "/", method.name()), &queue);
  stream->StartCall(nullptr);
  bool going = Wait(queue);
  for (const std::string& message : call.messages) {
    if (!going) break;
    stream->Write(ToBuffer(message), nullptr);
    going = Wait(queue);
  }
  if (going) {
    stream->WritesDone(nullptr);
    Wait(queue);
  }
  for (bool more = true; more;) {
    grpc::ByteBuffer reply;
    stream->Read(&reply, nullptr);
    more = Wait(queue);
    if (more && LastsUntilCancelled(call.rpc)) context.TryCancel();
  }
  grpc::Status status;
  stream->Finish(&status, nullptr);
  Wait(queue);
  return status;
}

}  // namespace hulld::fuzz
