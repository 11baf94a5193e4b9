#ifndef HULLD_CLIENT_HULLCTL_PRINTING_JSON_H_
#define HULLD_CLIENT_HULLCTL_PRINTING_JSON_H_

#include <absl/status/status.h>
#include <google/protobuf/message.h>

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace hulld {

// Returns a message in the JSON mapping of proto3, as grpcurl prints it: lowerCamelCase names,
// 64-bit integers as strings, and every field, set or not.
std::string MessageJson(const google::protobuf::Message& message);

enum class UnknownFields { kRefuse, kIgnore };

// Parses the output of MessageJson; fields may be missing. INVALID_ARGUMENT names the field.
absl::Status ParseJson(const std::string& json, UnknownFields unknown,
                       google::protobuf::Message* message);
// Parses one member of an object. INVALID_ARGUMENT also if the member is missing.
absl::Status ParseMember(const std::string& json, const std::string& name,
                         google::protobuf::Message* message);

// Returns `text` in quotes, escaped, with U+FFFD in place of bytes that are not UTF-8.
std::string QuoteJson(std::string_view text);

// Returns an array of values that are already JSON.
std::string JsonArray(const std::vector<std::string>& values);

// Returns a JSON array of json_of(item) for each item.
template <typename Items, typename JsonOf>
std::string JsonArray(const Items& items, const JsonOf& json_of) {
  std::vector<std::string> values;
  values.reserve(static_cast<size_t>(items.size()));
  for (const auto& item : items) values.push_back(json_of(item));
  return JsonArray(values);
}

// Writes one object member by member, in the same mapping.
class JsonObject {
 public:
  JsonObject& Add(const char* name, std::string_view text);
  JsonObject& Add(const char* name, const char* text) { return Add(name, std::string_view(text)); }
  JsonObject& Add(const char* name, uint64_t number);
  // Adds a value that is already JSON.
  JsonObject& AddJson(const char* name, const std::string& json);

  std::string Close() const { return text_ + "}"; }

 private:
  std::string text_ = "{";
};

}  // namespace hulld

#endif  // HULLD_CLIENT_HULLCTL_PRINTING_JSON_H_
