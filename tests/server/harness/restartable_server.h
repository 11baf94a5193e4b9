#ifndef HULLD_TESTS_SERVER_HARNESS_RESTARTABLE_SERVER_H_
#define HULLD_TESTS_SERVER_HARNESS_RESTARTABLE_SERVER_H_

#include <absl/strings/str_cat.h>
#include <absl/strings/str_join.h>
#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>
#include <signal.h>

#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "tests/server/harness/hulld_process.h"

namespace hulld::server {

// A directory that goes with this.
class TemporaryDirectory {
 public:
  TemporaryDirectory() {
    std::string name = (std::filesystem::temp_directory_path() / "hulld-test-XXXXXX").string();
    path_ = mkdtemp(name.data());
  }
  ~TemporaryDirectory() { std::filesystem::remove_all(path_); }
  const std::string& path() const { return path_; }

 private:
  std::string path_;
};

// A server that can be killed and started again, on a unix socket and a store of its own.
class RestartableServer : public ::testing::Test {
 protected:
  std::string address() const { return absl::StrCat("unix:", directory_.path(), "/socket"); }

  // Arguments of a connection that tries again at once while the server starts. It may take a
  // second to be made, which is what gRPC means by the least backoff.
  static grpc::ChannelArguments ReconnectAtOnce() {
    grpc::ChannelArguments arguments;
    arguments.SetInt(GRPC_ARG_INITIAL_RECONNECT_BACKOFF_MS, 5);
    arguments.SetInt(GRPC_ARG_MIN_RECONNECT_BACKOFF_MS, 1000);
    arguments.SetInt(GRPC_ARG_MAX_RECONNECT_BACKOFF_MS, 50);
    return arguments;
  }

  // A connection of client number `i` alone.
  std::shared_ptr<grpc::Channel> Channel(int i) const {
    grpc::ChannelArguments own = ReconnectAtOnce();
    own.SetInt("hulld.test.client", i);
    return grpc::CreateCustomChannel(address(), grpc::InsecureChannelCredentials(), own);
  }

  void StartServer(const std::vector<std::string>& options = {}) {
    std::vector<std::string> arguments = {"--listen", address(),
                                          // Nobody reads what it says while clients call.
                                          "--log-level", "warn"};
    arguments.insert(arguments.end(), store_.begin(), store_.end());
    arguments.insert(arguments.end(), options.begin(), options.end());
    server_ = std::make_unique<Process>(arguments);
    const auto deadline = std::chrono::system_clock::now() + std::chrono::seconds(60);
    ASSERT_TRUE(Channel(-1)->WaitForConnected(deadline)) << "hulld did not start" << Said();
  }

  // Kills the server.
  void Kill() {
    server_->Signal(SIGKILL);
    EXPECT_EQ(server_->Wait(), -1) << "hulld ended by itself" << Said();
  }

  // What the server logged until it was killed, which this does if nobody has.
  std::string Said() {
    server_->Signal(SIGKILL);
    server_->ReadToEnd();
    return absl::StrCat("; it said:\n", absl::StrJoin(server_->lines(), ""));
  }

  const TemporaryDirectory directory_;
  // The settings that say where hulls live.
  std::vector<std::string> store_ = {"--store", "rocksdb", "--data-dir",
                                     absl::StrCat(directory_.path(), "/store")};
  std::unique_ptr<Process> server_;
};

}  // namespace hulld::server

#endif  // HULLD_TESTS_SERVER_HARNESS_RESTARTABLE_SERVER_H_
