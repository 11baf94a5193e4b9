#ifndef HULLD_CLIENT_HULLCTL_COMMAND_LINE_INVOCATION_H_
#define HULLD_CLIENT_HULLCTL_COMMAND_LINE_INVOCATION_H_

#include <absl/status/status.h>

#include <functional>
#include <map>
#include <optional>
#include <ostream>
#include <string>
#include <vector>

#include "client/client.h"
#include "client/hullctl/command_line/exit_code.h"
#include "client/hullctl/context/connection_settings.h"
#include "client/hullctl/help/command_description.h"
#include "client/hullctl/printing/painter.h"
#include "client/verify/answer_check.h"

namespace hulld {

// What answers look like.
enum class OutputForm {
  // For people.
  kTable,
  // The same with more columns, where there are more.
  kWide,
  // Names alone, one a line: IDs of hulls, relations of answers.
  kName,
  // The contract's messages, one a line where there are many.
  kJson,
};

// One run of hullctl: the options that all commands share, where output goes, and what to do.
struct Invocation {
  explicit Invocation(std::ostream& out_stream, std::ostream& err_stream)
      : out(out_stream), err(err_stream) {}

  // Answers go to `out`; errors, warnings and progress to `err`.
  std::ostream& out;
  std::ostream& err;

  // What options say about the server, and --context, if they are given.
  ConnectionSettings flags;
  std::string context;
  // Whether the command talks to a server at all.
  bool needs_server = true;
  // The settings in force and where each comes from; then what they amount to. See
  // ResolveConnection.
  std::map<std::string, ChosenSetting> connection;
  std::string server = kDefaultServer;
  ConnectionSecurity security;

  std::chrono::milliseconds timeout{30000};
  // The value of --timeout, if given. It bounds calls that take time in proportion to the data.
  std::optional<std::chrono::milliseconds> given_timeout;
  // How fresh the answers to reads must be, if options say so.
  std::optional<v1::Freshness> freshness;
  OutputForm form = OutputForm::kTable;
  // Colours for `out`.
  Painter paint;
  // `err` is a terminal.
  bool shows_progress = false;

  // All commands, and how to run another command line; set before the action runs.
  const CommandDescription* program = nullptr;
  std::function<int(const std::vector<std::string>& arguments)> run_line;
  // Set by the command that was named.
  std::function<ExitCode()> action;

  bool json() const { return form == OutputForm::kJson; }
  bool names() const { return form == OutputForm::kName; }
  bool wide() const { return form == OutputForm::kWide; }

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
