#ifndef HULLD_CLIENT_HULLCTL_COMMAND_LINE_INVOCATION_H_
#define HULLD_CLIENT_HULLCTL_COMMAND_LINE_INVOCATION_H_

#include <absl/status/status.h>

#include <functional>
#include <optional>
#include <ostream>
#include <string>

#include "client/client.h"
#include "client/hullctl/command_line/exit_code.h"
#include "client/verify/answer_check.h"

namespace hulld {

// One run of hullctl: the options that all commands share, where output goes, and what to do.
struct Invocation {
  explicit Invocation(std::ostream& out_stream, std::ostream& err_stream)
      : out(out_stream), err(err_stream) {}

  // Answers go to `out`; errors, warnings and progress to `err`.
  std::ostream& out;
  std::ostream& err;

  std::string server = kDefaultServer;
  std::chrono::milliseconds timeout{30000};
  // The value of --timeout, if given. It bounds calls that take time in proportion to the data.
  std::optional<std::chrono::milliseconds> given_timeout;
  bool json = false;
  ConnectionSecurity security;

  // Set by the command that was named.
  std::function<ExitCode()> action;

  Client MakeClient() const;

  // Says what failed and what to do about it; returns the exit code for the status of a call.
  ExitCode Fail(const absl::Status& status) const;
  // The same for input and output files and arguments.
  ExitCode FailUsage(const absl::Status& status) const;
  // Says why a certificate is not valid; returns the exit code for the verdict.
  ExitCode Judge(const Verification& verification) const;
};

}  // namespace hulld

#endif  // HULLD_CLIENT_HULLCTL_COMMAND_LINE_INVOCATION_H_
