#include <csignal>
#include <cstdlib>
#include <iostream>

#include "client/hullctl/hullctl.h"

int main(int argc, char** argv) {
  // A closed pipe is seen as a failed write, and reported.
  std::signal(SIGPIPE, SIG_IGN);
  std::ios::sync_with_stdio(false);
  // gRPC's own log would repeat our errors; the user can turn it on.
  setenv("GRPC_VERBOSITY", "NONE", /*overwrite=*/0);
  return hulld::RunHullctl({argv + 1, argv + argc}, std::cout, std::cerr);
}
