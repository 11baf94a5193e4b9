#ifndef HULLD_SERVER_CONTRACT_ERROR_INFO_H_
#define HULLD_SERVER_CONTRACT_ERROR_INFO_H_

#include <absl/status/status.h>

#include <cstdint>
#include <initializer_list>
#include <optional>
#include <string>
#include <utility>

#include "hulld/rpc/error_details.pb.h"
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

// Returns the status with a reason and the metadata that error.proto lists for it; replaces any
// earlier reason. Stored as a payload, which Prefixed preserves.
absl::Status WithReason(absl::Status status, v1::ErrorReason reason,
                        std::initializer_list<MetadataEntry> metadata = {});

// UNAVAILABLE: the server is draining, so no call starts and no watch continues.
absl::Status Draining();

// Returns the reason of an error; without one, the reason implied by its code, if any.
v1::ErrorReason ReasonOf(const absl::Status& status);

// Returns a value of the metadata given to WithReason.
std::optional<std::string> MetadataOf(const absl::Status& status, const std::string& key);

// Returns the google.rpc.ErrorInfo of an error; nullopt for an error without a reason.
std::optional<rpc::ErrorInfo> ErrorInfoOf(const absl::Status& status);

}  // namespace hulld::server

#endif  // HULLD_SERVER_CONTRACT_ERROR_INFO_H_
