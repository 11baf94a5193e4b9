#ifndef HULLD_TESTS_SERVER_HARNESS_POSTGRES_MANY_SERVERS_H_
#define HULLD_TESTS_SERVER_HARNESS_POSTGRES_MANY_SERVERS_H_

#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>

#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "tests/server/harness/history/history_client.h"
#include "tests/server/harness/history/hull_history.h"
#include "tests/server/harness/hulld_process.h"

namespace hulld::server {

// Several active processes over one PostgreSQL database, and clients that switch between them.
class ManyServersTest : public ::testing::Test {
 protected:
  static constexpr size_t kServers = 3;
  static constexpr size_t kClients = 6;

  // Skips the test without PostgreSQL.
  void SetUp() override;

  // Starts this program instead of hulld from now on.
  void UseProgram(const std::string& program) { program_ = program; }
  // Stops the running servers, and starts one for each file with a connection string, sequentially
  // (Begin) or concurrently (BeginAtOnce).
  void Begin(const std::vector<std::string>& conninfo_files);
  void BeginAtOnce(const std::vector<std::string>& conninfo_files);
  // Starts kServers over an empty database of the shared cluster.
  void Begin();

  Process& server(size_t i) { return *servers_[i]->process; }
  std::string address(size_t i);
  // Replaces a server by a new process, killing it if it still runs.
  void Replace(size_t i);
  // Returns a new connection.
  std::shared_ptr<grpc::Channel> Connect(size_t server);

  // Parameters of the calls of kClients.
  struct Calls {
    // Answered calls of each client.
    int each = 80;
    uint64_t seed = 0;
    // If true, clients with numbers that differ by half of kClients share a writer ID.
    bool share_writers = false;
    // The two hulls that are called.
    std::vector<std::string> hulls = {"shared/a", "shared/b"};
    // Adds queries about the pair.
    bool pairs = false;
    // Bodies made of these hulls, which are also put, deleted, read, and queried.
    std::vector<std::string> bodies = {};
    // Adds batches, scenes, collision streams, and lists about all hulls and bodies.
    bool several = false;
    // Reads use any freshness.
    bool any_freshness = false;
  };
  using Fault = std::function<void()>;
  // Runs clients that call at random and sometimes switch servers; after an unanswered call, a
  // client continues once a server answers a read. The faults occur in order, evenly spread over
  // the calls. Finally queries every server about every hull.
  void Run(const Calls& calls, const std::vector<Fault>& faults, HullHistory& history);
  // Expects a change to get no answer for a while, because the database is unreachable. The change
  // creates a hull outside of any history.
  void ExpectNoAnswer(size_t server, const std::string& hull_id = "unanswered");
  // Expects a linearizable history; on failure reports the seed and the servers' logs.
  void ExpectLinearizable(const HullHistory& history, uint64_t seed);

 private:
  // A process, and a thread that drains its output, so that it never blocks on it.
  struct Server {
    // program: empty for hulld.
    Server(const std::string& program, const std::string& conninfo_file);
    ~Server();

    // Waits until the server listens; aborts the program if it does not.
    void AwaitListening();

    std::unique_ptr<Process> process;
    std::string address;
    std::thread reader;
  };

  void Call(size_t client, const Calls& calls, HullHistory& history,
            const std::function<void()>& answered);

  std::string program_;
  std::vector<std::string> conninfo_files_;
  std::vector<std::unique_ptr<Server>> servers_;
  std::mutex mutex_;
  // Guarded by mutex_.
  std::vector<std::string> addresses_;
  int channels_ = 0;
};

}  // namespace hulld::server

#endif  // HULLD_TESTS_SERVER_HARNESS_POSTGRES_MANY_SERVERS_H_
