#include <absl/synchronization/mutex.h>

#include <csignal>
#include <cstdlib>
#include <iostream>

#include "client/hullctl/hullctl.h"

int main(int argc, char** argv) {
  // Debian builds Abseil without NDEBUG, so by default its mutexes, which gRPC locks for every
  // call, check for deadlocks.
  absl::SetMutexDeadlockDetectionMode(absl::OnDeadlockCycle::kIgnore);
  // A closed pipe becomes a failed write, which is reported.
  std::signal(SIGPIPE, SIG_IGN);
  std::ios::sync_with_stdio(false);
  // gRPC's log would repeat our errors; the user can enable it.
  setenv("GRPC_VERBOSITY", "NONE", /*overwrite=*/0);
  return hulld::RunHullctl({argv + 1, argv + argc}, std::cout, std::cerr);
}
