#ifndef HULLD_CLIENT_HULLCTL_PRINTING_JSON_H_
#define HULLD_CLIENT_HULLCTL_PRINTING_JSON_H_

#include <absl/status/status.h>
#include <google/protobuf/message.h>

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace hulld {

// A message in the JSON mapping of proto3, as grpcurl prints it: lowerCamelCase names, 64-bit
// integers as strings; every field is there, whether set or not.
std::string MessageJson(const google::protobuf::Message& message);

enum class UnknownFields { kRefuse, kIgnore };

// Reads what MessageJson writes; fields may be missing. INVALID_ARGUMENT names the field.
absl::Status ParseJson(const std::string& json, UnknownFields unknown,
                       google::protobuf::Message* message);
// The same for one member of an object; INVALID_ARGUMENT also when it has none.
absl::Status ParseMember(const std::string& json, const std::string& name,
                         google::protobuf::Message* message);

// `text` with its quotes, escaped.
std::string QuoteJson(std::string_view text);

// Writes one object member by member, following the same mapping.
class JsonObject {
 public:
  JsonObject& Add(const char* name, std::string_view text);
  JsonObject& Add(const char* name, const char* text) { return Add(name, std::string_view(text)); }
  JsonObject& Add(const char* name, uint64_t number);
  // A value that is JSON already.
  JsonObject& AddJson(const char* name, const std::string& json);

  std::string Close() const { return text_ + "}"; }

 private:
  std::string text_ = "{";
};

}  // namespace hulld

#endif  // HULLD_CLIENT_HULLCTL_PRINTING_JSON_H_
