#include "server/process/random_id.h"

#include <absl/strings/escaping.h>

#include <array>
#include <cstdint>
#include <random>

namespace hulld::server {

std::string RandomId() {
  std::random_device device;
  const std::array<uint32_t, 4> words = {device(), device(), device(), device()};
  return absl::BytesToHexString({reinterpret_cast<const char*>(words.data()), sizeof words});
}

}  // namespace hulld::server
