#include "server/call/stream_message.h"

#include <absl/strings/str_cat.h>
#include <google/protobuf/unknown_field_set.h>

#include <string>

namespace hulld::server {
namespace {

// The mark: a field that no version of the contract has.
constexpr int kMarkNumber = 536870911;

}  // namespace

void PrepareToRead(google::protobuf::Message* message) {
  message->Clear();
  message->GetReflection()->MutableUnknownFields(message)->AddVarint(kMarkNumber, 1);
}

absl::Status WhyNotRead(const google::protobuf::Message& message) {
  const google::protobuf::UnknownFieldSet& fields =
      message.GetReflection()->GetUnknownFields(message);
  if (fields.field_count() == 1 && fields.field(0).number() == kMarkNumber) {
    return absl::OkStatus();
  }
  return absl::InvalidArgumentError(
      absl::StrCat("a message is malformed: it is no ", message.GetTypeName(),
                   "; check the serializer, and that strings are UTF-8"));
}

}  // namespace hulld::server
