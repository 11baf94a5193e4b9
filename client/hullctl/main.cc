#include <csignal>
#include <iostream>

#include "client/hullctl/hullctl.h"

int main(int argc, char** argv) {
  // A closed pipe is seen as a failed write, and reported.
  std::signal(SIGPIPE, SIG_IGN);
  std::ios::sync_with_stdio(false);
  return hulld::RunHullctl({argv + 1, argv + argc}, std::cout, std::cerr);
}
