// hulld: stores 3D convex hulls by ID and answers exact collision queries. See --help.

#include <absl/synchronization/mutex.h>
#include <signal.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <atomic>
#include <cstdio>
#include <iostream>
#include <string>
#include <vector>

#include "server/admin/doctor.h"
#include "server/config_check.h"
#include "server/migration/migration.h"
#include "server/process/descriptors.h"
#include "server/process/heap.h"
#include "server/process/log.h"
#include "server/server.h"
#include "server/settings/config.h"
#include "server/settings/resource_limits.h"

namespace hulld::server {
namespace {

constexpr int kExitFailure = 1;
constexpr int kExitUsage = 2;

sigset_t HandledSignals() {
  sigset_t signals;
  sigemptyset(&signals);
  for (const int number : {SIGTERM, SIGINT, SIGHUP}) sigaddset(&signals, number);
  return signals;
}

void LogStore(const Config& config) {
  if (config.store == "memory") {
    spdlog::info("store: memory; all hulls are lost when this process exits");
  } else if (config.store == "postgres") {
    // The store logged the details when it was opened.
    spdlog::info(config.postgres_servers == "many"
                     ? "this server is active on its database, possibly with peers"
                     : "this server is the active one on its database");
  } else if (config.durability == "sync") {
    spdlog::info("store: {}; acknowledged changes are on disk", config.data_dir);
  } else {
    spdlog::info("store: {}; acknowledged changes reach the disk within {} ms", config.data_dir,
                 Config::kRelaxedSyncInterval.count());
  }
}

// Waits for SIGTERM or SIGINT. Reloads certificates and tokens at each SIGHUP, and periodically
// puts idle hulls to rest and returns unused memory.
int WaitForEnd(const sigset_t& signals, Server& server) {
  // Memory is returned soon after a peak, and a check costs only 0.1 ms. Not tuned.
  constexpr timespec kPause = {.tv_sec = 10, .tv_nsec = 0};
  for (;;) {
    const int received = sigtimedwait(&signals, nullptr, &kPause);
    if (received == SIGHUP) {
      spdlog::info("SIGHUP received: reloading certificates and tokens");
      server.ReloadFiles();
    } else if (received > 0) {
      return received;
    } else {
      server.RestIdleHulls();
      ReleaseFreeMemory();
    }
  }
}

// Returns true if a pending signal asks the process to end.
bool IsTerminationPending() {
  sigset_t pending;
  sigpending(&pending);
  return sigismember(&pending, SIGTERM) == 1 || sigismember(&pending, SIGINT) == 1;
}

void LogStart(const Config& config, const Server& server) {
  const Limits& limits = config.limits;
  spdlog::info(
      "hulld {}: store {}, limits: {} points per chunk, {} vertices per hull, {} hulls, {} pairs "
      "per batch, {} textbook axes",
      HULLD_VERSION, config.store, limits.max_points_per_chunk, limits.max_vertices_per_hull,
      limits.max_hulls, limits.max_pairs_per_batch, limits.max_textbook_axes);
  if (config.threads > 0) {
    spdlog::info("query threads: {} (--threads)", config.threads);
  } else {
    spdlog::info("query threads: {}", ReadCpuLimit().Describe());
  }
  LogStore(config);
  for (const std::string& warning : ExposureWarnings(config)) spdlog::warn("{}", warning);
  if (!server.metrics_address().empty()) {
    spdlog::info("metrics at http://{}/metrics", server.metrics_address());
  }
  spdlog::info("listening on {}", server.address());
}

// Serves until SIGTERM or SIGINT, then drains. Returns the exit status.
int Run(const Config& config) {
  SetUpLog(config.log_level, config.log_format);
  SetUpHeap();
  RaiseDescriptorLimit();
  // If descriptors run out during the start, gRPC aborts the process. **Observed**: 16 are too few,
  // and 20 suffice; the others are for connections and the files of the store.
  constexpr uint64_t kFewestDescriptors = 64;
  if (MaxDescriptors() < kFewestDescriptors) {
    spdlog::error(
        "the limit on open files is {}, and hulld requires at least {}; raise it with 'ulimit -n'",
        MaxDescriptors(), kFewestDescriptors);
    return kExitFailure;
  }
  // Blocks signals before any thread exists, so that all threads inherit the mask and this one can
  // wait.
  const sigset_t signals = HandledSignals();
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);
  signal(SIGPIPE, SIG_IGN);

  // Outlives the server.
  std::atomic<bool> store_ended = false;
  const absl::StatusOr<std::unique_ptr<Server>> server =
      Server::Start(config, IsTerminationPending);
  if (absl::IsCancelled(server.status())) {
    spdlog::info("{}", std::string(server.status().message()));
    return 0;
  }
  if (!server.ok()) {
    spdlog::error("{}", std::string(server.status().message()));
    return kExitFailure;
  }
  LogStart(config, **server);
  (*server)->OnStoreEnded([&store_ended] {
    store_ended = true;
    kill(getpid(), SIGTERM);
  });
  const int received = WaitForEnd(signals, **server);
  if (store_ended) {
    // Memory may be stale from now on, so no call may continue.
    spdlog::error("lost the store: exiting without draining");
    return kExitFailure;
  }
  spdlog::info("{} received: draining for at most {} ms; send it again to exit immediately",
               received == SIGTERM ? "SIGTERM" : "SIGINT", config.drain_timeout.count());
  pthread_sigmask(SIG_UNBLOCK, &signals, nullptr);
  if (!(*server)->Drain(config.drain_timeout)) {
    spdlog::warn("the drain timeout expired; cancelled the remaining calls");
  }
  return 0;
}

// Prints the settings and checks them.
int Check(const CommandLine& command_line) {
  const auto findings = CheckConfig(command_line.config, std::chrono::system_clock::now());
  if (!findings.ok()) {
    std::fprintf(stderr, "hulld: %s\n", std::string(findings.status().message()).c_str());
    return kExitUsage;
  }
  std::fputs(command_line.settings.c_str(), stdout);
  for (const std::string& finding : *findings) std::printf("# %s\n", finding.c_str());
  return 0;
}

int Main(const std::vector<std::string>& arguments) {
  if (!arguments.empty() && arguments.front() == "doctor") {
    return RunDoctor({arguments.begin() + 1, arguments.end()});
  }
  if (!arguments.empty() && arguments.front() == "migrate") {
    return RunMigrate({arguments.begin() + 1, arguments.end()}, std::cout, std::cerr);
  }
  const absl::StatusOr<CommandLine> command_line = ParseCommandLine(arguments, ProcessEnvironment);
  const absl::Status status =
      command_line.ok() ? CheckVariables(ProcessVariables()) : command_line.status();
  if (!status.ok()) {
    std::fprintf(stderr, "hulld: %s\n", std::string(status.message()).c_str());
    return kExitUsage;
  }
  if (!command_line->print.empty()) {
    std::fputs(command_line->print.c_str(), stdout);
    return 0;
  }
  if (command_line->check) return Check(*command_line);
  const int code = Run(command_line->config);
  if (code == 0) spdlog::info("ended");
  spdlog::shutdown();
  return code;
}

}  // namespace
}  // namespace hulld::server

int main(int argc, char** argv) {
  hulld::server::FillStandardStreams();
  // Debian builds Abseil without NDEBUG, so its mutexes, which gRPC locks for every call, look for
  // deadlocks by default.
  absl::SetMutexDeadlockDetectionMode(absl::OnDeadlockCycle::kIgnore);
  const int code = hulld::server::Main(std::vector<std::string>(argv + 1, argv + argc));
  if (std::fflush(stdout) == 0 && std::ferror(stdout) == 0) return code;
  std::fputs("hulld: cannot write to standard output: the disk is full, or it is closed\n", stderr);
  return code == 0 ? hulld::server::kExitFailure : code;
}
