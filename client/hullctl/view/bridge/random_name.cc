#include "client/hullctl/view/bridge/random_name.h"

#include <absl/strings/escaping.h>
#include <sys/random.h>

namespace hulld {

absl::StatusOr<std::string> RandomHex(size_t bytes) {
  std::string random(bytes, '\0');
  // Requests of up to 256 bytes are never partially filled.
  if (getrandom(random.data(), bytes, 0) != static_cast<ssize_t>(bytes)) {
    return absl::InternalError("cannot read random bytes from the system");
  }
  return absl::BytesToHexString(random);
}

}  // namespace hulld
