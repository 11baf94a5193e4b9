#ifndef HULLD_CLIENT_HULLCTL_LOCAL_LOCAL_SERVER_H_
#define HULLD_CLIENT_HULLCTL_LOCAL_LOCAL_SERVER_H_

#include <absl/status/statusor.h>
#include <sys/types.h>

#include <memory>
#include <optional>
#include <string>
#include <thread>

#include "client/client.h"

namespace hulld {

// A hulld process that keeps hulls in memory and listens on a unix socket in a folder that no other
// user can enter. Both exist as long as this object, and end with this process, even on SIGKILL.
class LocalServer {
 public:
  // Starts the server, and returns when it is listening. The program is $HULLD_BINARY, or hulld
  // next to hullctl or on the PATH. NOT_FOUND: the program does not exist. INTERNAL: it did not
  // start; the error has its last message.
  static absl::StatusOr<std::unique_ptr<LocalServer>> Start();
  // Ends the server, and returns when it has ended.
  ~LocalServer();
  LocalServer(const LocalServer&) = delete;
  LocalServer& operator=(const LocalServer&) = delete;

  // For ClientOptions::server.
  const std::string& address() const { return address_; }

 private:
  LocalServer() = default;

  // Starts the keeper in a new folder. Returns the read end of the pipe with the server's log.
  absl::StatusOr<int> Spawn(const std::string& program);

  std::string address_;
  // A shell that runs the server, and ends it and removes the folder at the end of its input.
  pid_t keeper_ = 0;
  int keeper_input_ = -1;
  // Reads the log to its end, so that the server never blocks on a full pipe.
  std::thread log_reader_;
};

// Returns the absolute path of an executable program on the PATH; empty if there is none.
std::string FindProgram(const std::string& name);

// Returns $TMPDIR, or /tmp if it is empty or not set.
std::string TemporaryDirectory();

// Builds hulls on a private server, which is started when the first hull is built.
class LocalHullBuilder {
 public:
  // Returns the hull of the points. Errors of LocalServer::Start and of the server.
  absl::StatusOr<HullMesh> Build(const Client::PointFeed& feed);

 private:
  std::unique_ptr<LocalServer> server_;
  std::optional<Client> client_;
};

}  // namespace hulld

#endif  // HULLD_CLIENT_HULLCTL_LOCAL_LOCAL_SERVER_H_
