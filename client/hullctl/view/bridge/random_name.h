#ifndef HULLD_CLIENT_HULLCTL_VIEW_BRIDGE_RANDOM_NAME_H_
#define HULLD_CLIENT_HULLCTL_VIEW_BRIDGE_RANDOM_NAME_H_

#include <absl/status/statusor.h>

#include <cstddef>
#include <string>

namespace hulld {

// Returns `bytes` (at most 256) random bytes of the system, suitable for secrets, as hexadecimal
// digits. INTERNAL: the system returns none.
absl::StatusOr<std::string> RandomHex(size_t bytes);

}  // namespace hulld

#endif  // HULLD_CLIENT_HULLCTL_VIEW_BRIDGE_RANDOM_NAME_H_
