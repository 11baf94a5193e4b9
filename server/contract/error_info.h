#ifndef HULLD_SERVER_CONTRACT_ERROR_INFO_H_
#define HULLD_SERVER_CONTRACT_ERROR_INFO_H_

#include <absl/status/status.h>

#include <cstdint>
#include <initializer_list>
#include <optional>
#include <string>
#include <utility>

#include "hulld/v1/error.pb.h"

namespace hulld::server {

// A value of an error's metadata: text, or a number in decimal.
struct MetadataEntry {
  MetadataEntry(std::string key_name, std::string text)
      : key(std::move(key_name)), value(std::move(text)) {}
  MetadataEntry(std::string key_name, uint64_t number)
      : key(std::move(key_name)), value(std::to_string(number)) {}

  std::string key;
  std::string value;
};

// The status with its reason, and the metadata that error.proto lists for that reason; it replaces
// a reason given before. Kept as a payload: Prefixed carries it on.
absl::Status WithReason(absl::Status status, v1::ErrorReason reason,
                        std::initializer_list<MetadataEntry> metadata = {});

// UNAVAILABLE: the server drains, so that no call begins and no watch goes on.
absl::Status Draining();

// The reason of an error; where none was given, the one that its code implies, if any.
v1::ErrorReason ReasonOf(const absl::Status& status);

// A value of the metadata given to WithReason.
std::optional<std::string> MetadataOf(const absl::Status& status, const std::string& key);

// The serialized google.rpc.ErrorInfo of an error; none for an error without a reason.
std::optional<std::string> EncodeErrorInfo(const absl::Status& status);

}  // namespace hulld::server

#endif  // HULLD_SERVER_CONTRACT_ERROR_INFO_H_
