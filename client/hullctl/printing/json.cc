#include "client/hullctl/printing/json.h"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_join.h>
#include <google/protobuf/struct.pb.h>
#include <google/protobuf/util/json_util.h>

#include <algorithm>

#include "client/formats/text_number.h"

namespace hulld {

std::string MessageJson(const google::protobuf::Message& message) {
  google::protobuf::util::JsonPrintOptions options;
  options.always_print_primitive_fields = true;
  std::string json;
  // Fails only for messages with an Any of unknown type; the contract has none.
  if (!google::protobuf::util::MessageToJsonString(message, &json, options).ok()) return "null";
  return json;
}

absl::Status ParseJson(const std::string& json, UnknownFields unknown,
                       google::protobuf::Message* message) {
  google::protobuf::util::JsonParseOptions options;
  options.ignore_unknown_fields = unknown == UnknownFields::kIgnore;
  const auto status = google::protobuf::util::JsonStringToMessage(json, message, options);
  if (status.ok()) return absl::OkStatus();
  return absl::InvalidArgumentError(JsonProblem(status.message().as_string()));
}

absl::Status ParseMember(const std::string& json, const std::string& name,
                         google::protobuf::Message* message) {
  google::protobuf::Struct object;
  if (absl::Status s = ParseJson(json, UnknownFields::kRefuse, &object); !s.ok()) return s;
  const auto member = object.fields().find(name);
  if (member == object.fields().end()) {
    return absl::InvalidArgumentError("there is no member \"" + name + "\"");
  }
  return ParseJson(MessageJson(member->second), UnknownFields::kIgnore, message);
}

std::string QuoteJson(std::string_view text) {
  static constexpr char kHex[] = "0123456789abcdef";
  std::string quoted = "\"";
  while (!text.empty()) {
    const size_t length = Utf8Length(text);
    const auto byte = static_cast<unsigned char>(text[0]);
    if (length == 0) {
      quoted += "\xEF\xBF\xBD";
    } else if (text[0] == '"' || text[0] == '\\') {
      (quoted += '\\') += text[0];
    } else if (byte < 0x20 || byte == 0x7f) {
      ((quoted += "\\u00") += kHex[byte >> 4]) += kHex[byte & 15];
    } else {
      quoted += text.substr(0, length);
    }
    text.remove_prefix(std::max<size_t>(length, 1));
  }
  return quoted + "\"";
}

std::string JsonArray(const std::vector<std::string>& values) {
  return absl::StrCat("[", absl::StrJoin(values, ","), "]");
}

JsonObject& JsonObject::Add(const char* name, std::string_view text) {
  return AddJson(name, QuoteJson(text));
}

JsonObject& JsonObject::Add(const char* name, uint64_t number) {
  return AddJson(name, QuoteJson(std::to_string(number)));
}

JsonObject& JsonObject::AddJson(const char* name, const std::string& json) {
  if (text_.size() > 1) text_ += ",";
  text_ += QuoteJson(name) + ":" + json;
  return *this;
}

}  // namespace hulld
