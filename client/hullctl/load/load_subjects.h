#ifndef HULLD_CLIENT_HULLCTL_LOAD_LOAD_SUBJECTS_H_
#define HULLD_CLIENT_HULLCTL_LOAD_LOAD_SUBJECTS_H_

#include <absl/status/status.h>

#include <atomic>
#include <cstdint>
#include <string>
#include <vector>

#include "client/client.h"
#include "client/hullctl/load/load.h"

namespace hulld {

enum class LoadMode { kCheck, kBatch, kAppend, kMixed };

struct LoadSettings {
  LoadMode mode = LoadMode::kCheck;
  int clients = 1;
  // Number of queried hulls, and points on a sphere per hull.
  uint64_t hulls = 16;
  uint64_t vertices = 64;
  // Pairs per batch.
  uint64_t pairs = 10000;
  // Points per chunk of an append.
  uint64_t points = 10000;
  // ID prefix of all hulls of the load; ends with "/".
  std::string prefix;
};

// The hulls of a load on a server, and the clients that query them.
class LoadSubjects {
 public:
  // connection: options of each client's connection.
  LoadSubjects(LoadSettings settings, ClientOptions connection);

  // Creates the queried hulls. FAILED_PRECONDITION: hulls with the prefix exist, which Delete would
  // remove. CANCELLED: `stop` was set.
  absl::Status Create(const std::atomic<bool>& stop);

  // Returns one function per client, each for use by one thread.
  std::vector<LoadRequest> MakeClients();

  // Deletes every hull of the prefix, continues after errors, and returns the first one. Deletes
  // nothing if Create refused.
  absl::Status Delete();

 private:
  class LoadClient;

  std::string HullId(uint64_t i) const;

  const LoadSettings settings_;
  const ClientOptions connection_;
  const Client client_;
  bool owns_prefix_ = false;
};

}  // namespace hulld

#endif  // HULLD_CLIENT_HULLCTL_LOAD_LOAD_SUBJECTS_H_
