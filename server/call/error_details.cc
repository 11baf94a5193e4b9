#include "server/call/error_details.h"

#include <google/protobuf/duration.pb.h>
#include <google/protobuf/io/coded_stream.h>
#include <google/protobuf/io/zero_copy_stream_impl_lite.h>

#include <chrono>
#include <optional>

#include "server/contract/limit_error.h"
#include "server/contract/status_map.h"

namespace hulld::server {
namespace {

// One message in protobuf's encoding, put together field by field.
class Encoded {
 public:
  Encoded& Add(int field, const std::string& bytes) {
    Output([&](google::protobuf::io::CodedOutputStream& output) {
      output.WriteTag(static_cast<uint32_t>(field) << 3 | 2);  // length-delimited
      output.WriteVarint32(static_cast<uint32_t>(bytes.size()));
      output.WriteString(bytes);
    });
    return *this;
  }
  Encoded& Add(int field, uint32_t number) {
    Output([&](google::protobuf::io::CodedOutputStream& output) {
      output.WriteTag(static_cast<uint32_t>(field) << 3 | 0);  // varint
      output.WriteVarint32(number);
    });
    return *this;
  }
  const std::string& bytes() const { return bytes_; }

 private:
  template <typename Write>
  void Output(const Write& write) {
    google::protobuf::io::StringOutputStream stream(&bytes_);
    google::protobuf::io::CodedOutputStream output(&stream);
    write(output);
  }

  std::string bytes_;
};

// A google.protobuf.Any.
std::string AnyOf(const std::string& type, const std::string& message) {
  return Encoded().Add(1, "type.googleapis.com/google.rpc." + type).Add(2, message).bytes();
}

std::string DurationOf(std::chrono::milliseconds time) {
  google::protobuf::Duration duration;
  duration.set_seconds(time.count() / 1000);
  duration.set_nanos(static_cast<int32_t>(time.count() % 1000 * 1'000'000));
  return duration.SerializeAsString();
}

}  // namespace

std::string EncodeErrorDetails(const absl::Status& status, const std::string& request_id) {
  Encoded result;
  result.Add(1, static_cast<uint32_t>(ToGrpc(status.code())));
  result.Add(2, std::string(status.message()));
  result.Add(3, AnyOf("RequestInfo", Encoded().Add(1, request_id).bytes()));
  if (const std::optional<std::string> limit = ExceededLimit(status); limit.has_value()) {
    const std::string violation =
        Encoded().Add(1, "--" + *limit).Add(2, std::string(status.message())).bytes();
    result.Add(3, AnyOf("QuotaFailure", Encoded().Add(1, violation).bytes()));
  }
  if (const auto retry = RetryAfter(status); retry.has_value()) {
    result.Add(3, AnyOf("RetryInfo", Encoded().Add(1, DurationOf(*retry)).bytes()));
  }
  return result.bytes();
}

}  // namespace hulld::server
