#include <absl/status/status.h>
#include <absl/strings/str_cat.h>
#include <google/protobuf/descriptor.h>
#include <google/protobuf/descriptor.pb.h>

#include <memory>
#include <set>
#include <utility>

#include "grpc/reflection/v1alpha/reflection.grpc.pb.h"
#include "server/admin/admin_services.h"
#include "server/call/call_stream.h"
#include "server/contract/errors.h"

namespace hulld::server {
namespace {

namespace reflection = grpc::reflection::v1alpha;
using google::protobuf::DescriptorPool;
using google::protobuf::FileDescriptor;

constexpr size_t kMaxRequestBytes = 4096;

// Adds the file, preceded by its dependencies that are not in `added`.
void AddFile(const FileDescriptor& file, std::set<const FileDescriptor*>& added,
             reflection::FileDescriptorResponse* response) {
  if (!added.insert(&file).second) return;
  for (int i = 0; i < file.dependency_count(); ++i) AddFile(*file.dependency(i), added, response);
  google::protobuf::FileDescriptorProto proto;
  file.CopyTo(&proto);
  proto.SerializeToString(response->add_file_descriptor_proto());
}

// A reflection stream. Each request is answered on arrival.
class ReflectionStream
    : public ReadingStream<PulledStream<BidiReactor, reflection::ServerReflectionResponse>,
                           reflection::ServerReflectionRequest> {
 public:
  ReflectionStream(CallContext& context, Admission& admission,
                   const std::vector<std::string>& services)
      : ReadingStream(context, admission, Rpc::kServerReflectionInfo), services_(services) {}

 private:
  void Open() override { Read(); }
  void OnNoMessage(const absl::Status& why) override { FinishCall(OrStopped(why)); }
  void OnSent() override {
    reply().Clear();
    Read();
  }

  void OnMessage() override {
    // The reply repeats the request.
    if (request().ByteSizeLong() > kMaxRequestBytes) {
      return FinishCall(InvalidArgument("the request has more than ", kMaxRequestBytes, " bytes"));
    }
    reply().set_valid_host(request().host());
    *reply().mutable_original_request() = request();
    Answer();
    Send();
  }

  void Answer() {
    const DescriptorPool& pool = *DescriptorPool::generated_pool();
    switch (request().message_request_case()) {
      case reflection::ServerReflectionRequest::kListServices:
        for (const std::string& name : services_) {
          reply().mutable_list_services_response()->add_service()->set_name(name);
        }
        return;
      case reflection::ServerReflectionRequest::kFileByFilename:
        return ReplyWithFile(pool.FindFileByName(request().file_by_filename()),
                             request().file_by_filename());
      case reflection::ServerReflectionRequest::kFileContainingSymbol:
        return ReplyWithFile(pool.FindFileContainingSymbol(request().file_containing_symbol()),
                             request().file_containing_symbol());
      case reflection::ServerReflectionRequest::kFileContainingExtension:
        return Refuse(absl::StatusCode::kNotFound, "the contract has no extensions");
      case reflection::ServerReflectionRequest::kAllExtensionNumbersOfType:
        return ReplyWithoutExtensions(pool, request().all_extension_numbers_of_type());
      case reflection::ServerReflectionRequest::MESSAGE_REQUEST_NOT_SET:
        break;
    }
    Refuse(absl::StatusCode::kInvalidArgument, "the request has no query; set one of its fields");
  }

  void ReplyWithFile(const FileDescriptor* file, const std::string& name) {
    if (file == nullptr) {
      return Refuse(absl::StatusCode::kNotFound, absl::StrCat("\"", name, "\" is unknown"));
    }
    std::set<const FileDescriptor*> added;
    AddFile(*file, added, reply().mutable_file_descriptor_response());
  }

  void ReplyWithoutExtensions(const DescriptorPool& pool, const std::string& type) {
    if (pool.FindMessageTypeByName(type) == nullptr) {
      return Refuse(absl::StatusCode::kNotFound, absl::StrCat("\"", type, "\" is unknown"));
    }
    reply().mutable_all_extension_numbers_response()->set_base_type_name(type);
  }

  void Refuse(absl::StatusCode code, const std::string& message) {
    reply().mutable_error_response()->set_error_code(static_cast<int>(code));
    reply().mutable_error_response()->set_error_message(message);
  }

  const std::vector<std::string>& services_;
};

// The generated service, with its method on bytes (message_bytes.h).
using ReflectionServiceOfBytes =
    grpc::reflection::v1alpha::ServerReflection::WithRawCallbackMethod_ServerReflectionInfo<
        grpc::reflection::v1alpha::ServerReflection::Service>;

class ReflectionService : public ReflectionServiceOfBytes {
 public:
  ReflectionService(Admission& admission, std::vector<std::string> services)
      : admission_(admission), services_(std::move(services)) {}

  BidiReactor* ServerReflectionInfo(CallContext* context) override {
    return ReflectionStream::Launch(
        std::make_shared<ReflectionStream>(*context, admission_, services_));
  }

 private:
  Admission& admission_;
  const std::vector<std::string> services_;
};

}  // namespace

std::unique_ptr<grpc::Service> MakeReflectionService(Admission& admission,
                                                     std::vector<std::string> services) {
  return std::make_unique<ReflectionService>(admission, std::move(services));
}

}  // namespace hulld::server
