#ifndef HULLD_CLIENT_HULLCTL_VIEW_TEMPORARY_HULLS_H_
#define HULLD_CLIENT_HULLCTL_VIEW_TEMPORARY_HULLS_H_

#include <absl/status/statusor.h>

#include <string>
#include <vector>

#include "client/client.h"

namespace hulld {

// Hulls that exist on the server while hullctl needs them, under "view/RANDOM/". The destructor
// deletes them; a killed process leaves them for `hullctl delete`.
class TemporaryHulls {
 public:
  explicit TemporaryHulls(const Client& client) : client_(client) {}
  ~TemporaryHulls();
  TemporaryHulls(const TemporaryHulls&) = delete;
  TemporaryHulls& operator=(const TemporaryHulls&) = delete;

  // Creates the hull of all finite points of a file. Returns its ID.
  absl::StatusOr<std::string> AddFile(const std::string& path);
  // Creates the hull of the points from `feed`. Replaces an existing hull of that name.
  absl::StatusOr<std::string> Add(const std::string& name, const Client::PointFeed& feed);

 private:
  const Client& client_;
  // "view/RANDOM/"; empty before the first hull.
  std::string prefix_;
  std::vector<std::string> ids_;
};

}  // namespace hulld

#endif  // HULLD_CLIENT_HULLCTL_VIEW_TEMPORARY_HULLS_H_
