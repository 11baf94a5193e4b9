#ifndef HULLD_TESTS_BENCH_TRADE_HULL_SOURCES_H_
#define HULLD_TESTS_BENCH_TRADE_HULL_SOURCES_H_

#include <absl/status/statusor.h>

#include <string>

#include "core/hull/hull.h"

namespace hulld::bench {

// Returns the hull of the points of a file, in any format that hullctl reads. INVALID_ARGUMENT
// names the file and the position.
absl::StatusOr<Hull> HullOfFile(const std::string& path);

// Returns a hull of a running server. Errors are the server's.
absl::StatusOr<Hull> HullOfServer(const std::string& server, const std::string& hull_id);

}  // namespace hulld::bench

#endif  // HULLD_TESTS_BENCH_TRADE_HULL_SOURCES_H_
