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

// Processes that are active at once over one PostgreSQL database, and clients that go from one to
// another.
class ManyServersTest : public ::testing::Test {
 protected:
  static constexpr size_t kServers = 3;
  static constexpr size_t kClients = 6;

  // Skips the test without PostgreSQL.
  void SetUp() override;

  // The program that is started from now on, in the place of hulld.
  void UseProgram(const std::string& program) { program_ = program; }
  // Ends the servers that there were, and starts one for each file with a connection string, one
  // after the other, or all at once. A file whose name ends in ".shards" names several databases.
  void Begin(const std::vector<std::string>& conninfo_files);
  void BeginAtOnce(const std::vector<std::string>& conninfo_files);
  // kServers over an empty database of the shared cluster.
  void Begin();

  Process& server(size_t i) { return *servers_[i]->process; }
  std::string address(size_t i);
  // A new process in the place of one, which is killed if it still runs.
  void Replace(size_t i);
  // A connection of its own.
  std::shared_ptr<grpc::Channel> Connect(size_t server);

  // How kClients call.
  struct Calls {
    // Answered calls of each client.
    int each = 80;
    uint64_t seed = 0;
    // Clients with numbers that differ by half of kClients write under the same ID.
    bool share_writers = false;
    // Two, which are called about.
    std::vector<std::string> hulls = {"shared/a", "shared/b"};
    // Clients ask how they stand to each other, too. They are in two shards.
    bool pairs = false;
    // Bodies of these hulls, which are put, deleted, read and asked about, too.
    std::vector<std::string> bodies = {};
    // With pairs: also about all hulls and bodies at once, by batches, scenes, collision streams
    // and lists.
    bool several = false;
    // Reads are of any freshness.
    bool any_freshness = false;
  };
  using Fault = std::function<void()>;
  // Clients call at random, each another server now and then, and one that is not answered goes on
  // when a server answers a question. The faults come one after the other, evenly spread over the
  // calls. At the end every server is asked about every hull.
  void Run(const Calls& calls, const std::vector<Fault>& faults, HullHistory& history);
  // That a change is not answered for a while, as its database is out of reach: the creation of a
  // hull that is none of any history.
  void ExpectNoAnswer(size_t server, const std::string& hull_id = "unanswered");
  // That the history is linearizable, and the seed and what the servers said if not.
  void ExpectLinearizable(const HullHistory& history, uint64_t seed);

 private:
  // A process, and a thread that reads what it says, or it would wait for that.
  struct Server {
    // program: empty for hulld.
    Server(const std::string& program, const std::string& conninfo_file);
    ~Server();

    // It must come to listen.
    void AwaitListening();

    std::unique_ptr<Process> process;
    std::string address;
    std::thread reader;
  };

  // As the calls say.
  void SetUp(HistoryClient& client, const Calls& calls);
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
