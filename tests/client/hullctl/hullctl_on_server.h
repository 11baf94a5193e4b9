#ifndef HULLD_TESTS_CLIENT_HULLCTL_HULLCTL_ON_SERVER_H_
#define HULLD_TESTS_CLIENT_HULLCTL_HULLCTL_ON_SERVER_H_

#include <google/protobuf/message.h>
#include <google/protobuf/util/json_util.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <sstream>
#include <string>
#include <vector>

#include "client/hullctl/hullctl.h"
#include "tests/server/harness/test_server.h"

namespace hulld {

// Hides the contexts of the user who runs the tests.
inline void UseNoContexts() { setenv("XDG_CONFIG_HOME", "/nonexistent", 1); }

// Exit code and output of a run of hullctl.
struct Ran {
  int code = -1;
  std::string out;
  std::string err;
};

inline Ran RunTool(const std::vector<std::string>& arguments) {
  if (std::getenv("XDG_CONFIG_HOME") == nullptr) UseNoContexts();
  std::ostringstream out;
  std::ostringstream err;
  Ran ran;
  ran.code = RunHullctl(arguments, out, err);
  ran.out = out.str();
  ran.err = err.str();
  return ran;
}

// Parses each line of the output as an API message. Unknown members, which hullctl-specific JSON
// would have, fail the test.
template <typename Message>
std::vector<Message> MessagesIn(const std::string& out) {
  std::vector<Message> messages;
  std::istringstream lines(out);
  for (std::string line; std::getline(lines, line);) {
    const auto parsed = google::protobuf::util::JsonStringToMessage(line, &messages.emplace_back());
    EXPECT_TRUE(parsed.ok()) << parsed.ToString() << "\n" << line;
  }
  return messages;
}

// hullctl and a server, both within the test.
class HullctlOnServer : public server::ServerTest {
 protected:
  Ran Run(std::vector<std::string> arguments) {
    arguments.insert(arguments.end(), {"--server", server_->address()});
    return RunTool(arguments);
  }
  Ran RunJson(std::vector<std::string> arguments) {
    arguments.insert(arguments.end(), {"--output", "json"});
    return Run(arguments);
  }
};

}  // namespace hulld

#endif  // HULLD_TESTS_CLIENT_HULLCTL_HULLCTL_ON_SERVER_H_
