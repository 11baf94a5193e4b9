#ifndef HULLD_SERVER_PROCESS_RANDOM_ID_H_
#define HULLD_SERVER_PROCESS_RANDOM_ID_H_

#include <absl/strings/escaping.h>

#include <array>
#include <cstdint>
#include <random>
#include <string>

namespace hulld::server {

// Returns 128 random bits as 32 hexadecimal digits: unique for all practical purposes.
inline std::string RandomId() {
  std::random_device device;
  const std::array<uint32_t, 4> words = {device(), device(), device(), device()};
  return absl::BytesToHexString({reinterpret_cast<const char*>(words.data()), sizeof words});
}

}  // namespace hulld::server

#endif  // HULLD_SERVER_PROCESS_RANDOM_ID_H_
