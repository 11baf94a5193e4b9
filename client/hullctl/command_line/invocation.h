#ifndef HULLD_CLIENT_HULLCTL_COMMAND_LINE_INVOCATION_H_
#define HULLD_CLIENT_HULLCTL_COMMAND_LINE_INVOCATION_H_

#include <absl/status/status.h>
#include <google/protobuf/message.h>

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <ostream>
#include <string>
#include <type_traits>

#include "client/base/status_macros.h"
#include "client/client.h"
#include "client/hullctl/command_line/command.h"
#include "client/hullctl/context/connection_settings.h"
#include "client/hullctl/help/command_description.h"
#include "client/hullctl/printing/painter.h"
#include "client/verify/answer_check.h"

namespace hulld {

// Output formats.
enum class OutputForm {
  // For people.
  kTable,
  // A table with more columns, if the command has more.
  kWide,
  // Names only, one per line: IDs of hulls, relations of answers.
  kName,
  // Messages of the contract; one per line if a command prints several.
  kJson,
};

// One run of hullctl: common options, output streams, and the action.
struct Invocation {
  explicit Invocation(std::ostream& out_stream, std::ostream& err_stream)
      : out(out_stream), err(err_stream) {}

  // Answers go to `out`; errors, warnings, and progress to `err`.
  std::ostream& out;
  std::ostream& err;

  // Connection settings from options, and --context, if given.
  ConnectionSettings flags;
  std::string context;
  // True if the command uses a server.
  bool needs_server = true;
  // Uses a temporary server that ends with the command.
  bool local = false;
  // The effective settings with their sources, then the values derived from them. See
  // ResolveConnection.
  std::map<std::string, ChosenSetting> connection;
  std::string server = kDefaultServer;
  ConnectionSecurity security;

  // The value of --timeout, if given. Also bounds calls with a duration proportional to the data.
  std::optional<std::chrono::milliseconds> given_timeout;
  // Freshness of reads, if set by options.
  std::optional<v1::Freshness> freshness;
  OutputForm form = OutputForm::kTable;
  // Colors for `out`.
  Painter paint;
  // True if `err` is a terminal.
  bool shows_progress = false;

  // All commands; set before the action runs.
  const CommandDescription* program = nullptr;
  // Set by the given command.
  std::function<ExitCode()> action;

  std::chrono::milliseconds timeout() const {
    return given_timeout.value_or(std::chrono::seconds(30));
  }
  bool json() const { return form == OutputForm::kJson; }
  bool names() const { return form == OutputForm::kName; }
  bool wide() const { return form == OutputForm::kWide; }

  Client MakeClient() const;

  // With --output json or name, prints the text, which is JSON, or the name. Returns false for
  // other formats, which the command itself must print.
  bool PrintForPrograms(const std::string& text, const std::string& name) const;
  bool PrintForPrograms(const google::protobuf::Message& message, const std::string& name) const;

  // Reports a failed call with its remedy; returns the exit code for its status.
  ExitCode Fail(const absl::Status& status) const;
  // Reports errors of input and output files and arguments.
  ExitCode FailUsage(const absl::Status& status) const;
  ExitCode FailUsage(const std::string& message) const;
  // Calls `write` with the file `path`, or with `out` if the path is empty or "-". Reports a file
  // that cannot be opened or fully written.
  ExitCode WriteFile(const std::string& path,
                     const std::function<void(std::ostream&)>& write) const;
  // Reports why a certificate is not valid; returns the exit code for the verdict.
  ExitCode Judge(const Verification& verification) const;
};

// Returns the exit code of a failed expression of type absl::StatusOr, after `fail` (Fail or
// FailUsage of an Invocation) reported its error; otherwise initializes `declaration`, or assigns
// to it, with the value.
#define HULLD_ASSIGN_OR_FAIL(fail, declaration, ...) \
  HULLD_ASSIGN_OR_FAIL_VIA(HULLD_LINE_NAME(__LINE__), fail, declaration, (__VA_ARGS__))
// NOLINTBEGIN(bugprone-macro-parentheses): parentheses around a declared name change its meaning.
#define HULLD_ASSIGN_OR_FAIL_VIA(result, fail, declaration, expression) \
  auto result = expression;                                             \
  if (!result.ok()) return fail(result.status());                       \
  declaration = *std::move(result)
// NOLINTEND(bugprone-macro-parentheses)

// Makes `action` the action of the invocation if the command is given.
inline void OnGiven(Command command, Invocation* invocation, ExitCode (*action)(const Invocation&),
                    bool needs_server = true) {
  command.OnGiven([=] {
    invocation->needs_server = needs_server;
    invocation->action = [=] { return action(*invocation); };
  });
}

// Likewise, with arguments.
template <typename Arguments>
void OnGiven(Command command, Invocation* invocation, std::shared_ptr<Arguments> arguments,
             std::type_identity_t<ExitCode (*)(const Invocation&, const Arguments&)> action,
             bool needs_server = true) {
  command.OnGiven([=] {
    invocation->needs_server = needs_server;
    invocation->action = [=] { return action(*invocation, *arguments); };
  });
}

// Declares --max-staleness and --at-least for a read command. They set invocation->freshness, which
// applies to all reads of the command.
void AddFreshnessOptions(Command command, Invocation* invocation);

}  // namespace hulld

#endif  // HULLD_CLIENT_HULLCTL_COMMAND_LINE_INVOCATION_H_
