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

// A directory that is deleted on destruction.
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

// A server that can be killed and restarted, with its own unix socket and store.
class RestartableServer : public ::testing::Test {
 protected:
  std::string address() const { return absl::StrCat("unix:", directory_.path(), "/socket"); }

  // Returns channel arguments that reconnect immediately while the server starts. An attempt to
  // connect may take a second: gRPC takes the minimum backoff as its time limit.
  static grpc::ChannelArguments ReconnectAtOnce() {
    grpc::ChannelArguments arguments;
    arguments.SetInt(GRPC_ARG_INITIAL_RECONNECT_BACKOFF_MS, 5);
    arguments.SetInt(GRPC_ARG_MIN_RECONNECT_BACKOFF_MS, 1000);
    arguments.SetInt(GRPC_ARG_MAX_RECONNECT_BACKOFF_MS, 50);
    return arguments;
  }

  // Returns a separate connection of client `i`.
  std::shared_ptr<grpc::Channel> Channel(int i) const {
    grpc::ChannelArguments own = ReconnectAtOnce();
    own.SetInt("hulld.test.client", i);
    return grpc::CreateCustomChannel(address(), grpc::InsecureChannelCredentials(), own);
  }

  void StartServer(const std::vector<std::string>& options = {}) {
    std::vector<std::string> arguments = {"--listen", address(),
                                          // Its output is not read while clients call.
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

  // Kills the server if it still runs, and returns its log.
  std::string Said() {
    server_->Signal(SIGKILL);
    server_->ReadToEnd();
    return absl::StrCat("; it said:\n", absl::StrJoin(server_->lines(), ""));
  }

  const TemporaryDirectory directory_;
  // Settings that select the store.
  std::vector<std::string> store_ = {"--store", "rocksdb", "--data-dir",
                                     absl::StrCat(directory_.path(), "/store")};
  std::unique_ptr<Process> server_;
};

}  // namespace hulld::server

#endif  // HULLD_TESTS_SERVER_HARNESS_RESTARTABLE_SERVER_H_
