#include <absl/synchronization/mutex.h>
#include <fcntl.h>
#include <unistd.h>

#include <csignal>
#include <cstdlib>
#include <iostream>

#include "client/hullctl/hullctl.h"

namespace {

// Opens /dev/null in place of each closed standard stream. Otherwise, a file or socket would get
// its number, and output would be written to it. Writing to such a stream still fails.
void FillStandardStreams() {
  // open returns the lowest free number.
  for (int stream = STDIN_FILENO; stream <= STDERR_FILENO; ++stream) {
    if (fcntl(stream, F_GETFD) < 0) open("/dev/null", O_RDONLY);
  }
}

}  // namespace

int main(int argc, char** argv) {
  FillStandardStreams();
  // Debian builds Abseil without NDEBUG, so by default its mutexes, which gRPC locks for every
  // call, check for deadlocks.
  absl::SetMutexDeadlockDetectionMode(absl::OnDeadlockCycle::kIgnore);
  // A closed connection or pipe becomes a failed write.
  std::signal(SIGPIPE, SIG_IGN);
  std::ios::sync_with_stdio(false);
  // gRPC's log would repeat our errors; the user can enable it.
  setenv("GRPC_VERBOSITY", "NONE", /*overwrite=*/0);
  return hulld::RunHullctl({argv + 1, argv + argc}, std::cout, std::cerr);
}
