#ifndef HULLD_CLIENT_HULLCTL_LOAD_LOAD_SUBJECTS_H_
#define HULLD_CLIENT_HULLCTL_LOAD_LOAD_SUBJECTS_H_

#include <absl/status/status.h>

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "client/client.h"
#include "client/hullctl/load/load.h"

namespace hulld {

enum class LoadMode { kCheck, kBatch, kAppend, kMixed };

struct LoadSettings {
  LoadMode mode = LoadMode::kCheck;
  int clients = 1;
  // Hulls that are asked about, and points on a sphere that each is made of.
  uint64_t hulls = 16;
  uint64_t vertices = 64;
  // Pairs of one batch.
  uint64_t pairs = 10000;
  // Points of one chunk of an append.
  uint64_t points = 10000;
  // The prefix of the IDs of all hulls of the load; ends in "/".
  std::string prefix;
};

// The hulls of a load on a server, and the clients that ask about them.
class LoadSubjects {
 public:
  // connection: what each client connects with.
  LoadSubjects(LoadSettings settings, ClientOptions connection);

  // Creates the hulls that are asked about. FAILED_PRECONDITION when hulls with the prefix are
  // there already, so that none but our own are ever deleted. CANCELLED: `stop` said so.
  absl::Status Create(const std::atomic<bool>& stop);

  // One per client, each of which belongs to one thread.
  std::vector<LoadRequest> MakeClients();

  // Deletes every hull of the prefix, in spite of errors, and returns the first error. Deletes
  // nothing when Create refused.
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
