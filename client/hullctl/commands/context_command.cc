#include <absl/strings/str_cat.h>

#include <filesystem>
#include <memory>
#include <string>

#include "client/formats/text_number.h"
#include "client/hullctl/command_line/commands.h"
#include "client/hullctl/command_line/connection.h"
#include "client/hullctl/context/context_file.h"
#include "client/hullctl/printing/json.h"
#include "client/hullctl/printing/table.h"

namespace hulld {
namespace {

struct ContextArguments {
  std::string name;
  bool replace = false;
  bool none = false;
};

// Returns the settings of the options with absolute paths, valid in any working directory. Paths
// remain as they are if the current directory does not exist.
ConnectionSettings WithAbsolutePaths(const ConnectionSettings& flags) {
  ConnectionSettings settings = flags;
  std::error_code error;
  const std::filesystem::path here = std::filesystem::current_path(error);
  for (const ConnectionSetting& setting : kConnectionSettings) {
    const auto found = settings.find(setting.name);
    if (setting.kind != SettingKind::kFile || found == settings.end()) continue;
    found->second = (here / found->second).lexically_normal().string();
  }
  std::string& server = settings.at("server");
  if (server.starts_with("unix:") && server[5] != '/') {
    server = "unix:" + (here / server.substr(5)).lexically_normal().string();
  }
  return settings;
}

std::string MemberJson(const std::string& text, SettingKind kind) {
  return kind == SettingKind::kFlag ? text : QuoteJson(text);
}

std::string ContextJson(const std::string& name, const ConnectionSettings& settings, bool current) {
  JsonObject object;
  object.Add("name", name).AddJson("current", current ? "true" : "false");
  for (const ConnectionSetting& setting : kConnectionSettings) {
    const auto found = settings.find(setting.name);
    if (found != settings.end()) {
      object.AddJson(setting.name, MemberJson(found->second, setting.kind));
    }
  }
  return object.Close();
}

ExitCode Add(const Invocation& run, const ContextArguments& arguments) {
  if (const std::string problem = ContextNameProblem(arguments.name); !problem.empty()) {
    return run.FailUsage(absl::StrCat(Quoted(arguments.name), ": ", problem));
  }
  if (!run.flags.contains("server"))
    return run.FailUsage("a context needs a server; pass --server HOST:PORT");
  HULLD_ASSIGN_OR_FAIL(run.FailUsage, auto file, LockContextFile());
  if (file.contexts.contains(arguments.name) && !arguments.replace) {
    return run.FailUsage(
        absl::StrCat("context ", arguments.name, " already exists; pass --replace to replace it"));
  }
  const ConnectionSettings settings = WithAbsolutePaths(run.flags);
  // Detects a missing file, or a token readable by other users, before saving.
  HULLD_ASSIGN_OR_FAIL(run.FailUsage, const auto security,
                       ReadSecurity(Combine({{"", settings, false}})));
  const absl::Status valid = ValidateSecurity(security, settings.at("server"));
  if (!valid.ok()) return run.FailUsage(valid);
  file.contexts[arguments.name] = settings;
  const bool first = file.current.empty();
  if (first) file.current = arguments.name;
  if (absl::Status s = WriteContextFile(file); !s.ok()) return run.FailUsage(s);
  const bool current = file.current == arguments.name;
  if (!run.PrintForPrograms(ContextJson(arguments.name, settings, current), arguments.name)) {
    run.out << "context " << arguments.name << " added" << (first ? " and selected" : "") << "\n";
  }
  return ExitCode::kDone;
}

ExitCode Use(const Invocation& run, const ContextArguments& arguments) {
  if (arguments.none == !arguments.name.empty()) {
    return run.FailUsage("pass the name of a context, or --none");
  }
  HULLD_ASSIGN_OR_FAIL(run.FailUsage, auto file, LockContextFile());
  if (!arguments.none) {
    const auto found = FindContext(file, arguments.name);
    if (!found.ok()) return run.FailUsage(found.status());
  }
  file.current = arguments.name;
  if (absl::Status s = WriteContextFile(file); !s.ok()) return run.FailUsage(s);
  if (arguments.none) {
    run.out << "no context is selected\n";
  } else {
    run.out << "context " << arguments.name
            << " selected: " << file.contexts.at(arguments.name).at("server") << "\n";
  }
  return ExitCode::kDone;
}

ExitCode ListContexts(const Invocation& run) {
  HULLD_ASSIGN_OR_FAIL(run.FailUsage, const auto file, ReadContextFile());
  Table table;
  table.Head(run.paint, {"CONTEXT", "SERVER", "TLS", "TOKEN FILE", "USED"});
  for (const auto& [name, settings] : file.contexts) {
    const bool current = name == file.current;
    run.PrintForPrograms(ContextJson(name, settings, current), name);
    const auto security = settings.contains("tls") || settings.contains("ca-cert") ||
                          settings.contains("cert") || settings.contains("server-name");
    const auto token = settings.find("token-file");
    table.Row({name, settings.at("server"), security ? "yes" : "no",
               token == settings.end() ? "-" : token->second, current ? "yes" : "no"});
  }
  if (run.json() || run.names()) return ExitCode::kDone;
  table.Print(run.out);
  if (file.contexts.empty()) {
    run.err << "hullctl: no contexts; add one with 'hullctl context add'\n";
  }
  return ExitCode::kDone;
}

ExitCode Remove(const Invocation& run, const ContextArguments& arguments) {
  HULLD_ASSIGN_OR_FAIL(run.FailUsage, auto file, LockContextFile());
  if (const auto found = FindContext(file, arguments.name); !found.ok()) {
    return run.FailUsage(found.status());
  }
  file.contexts.erase(arguments.name);
  const bool was_used = file.current == arguments.name;
  if (was_used) file.current.clear();
  if (absl::Status s = WriteContextFile(file); !s.ok()) return run.FailUsage(s);
  run.out << "context " << arguments.name << " removed"
          << (was_used ? "; no context is selected" : "") << "\n";
  return ExitCode::kDone;
}

// Shows the effective settings and their sources.
ExitCode Show(const Invocation& invocation, const ContextArguments& arguments) {
  Invocation run = invocation;
  if (!arguments.name.empty()) run.context = arguments.name;
  const absl::Status resolved = ResolveConnection(&run);
  // Reports unreadable files after the settings that name them.
  if (!resolved.ok() && run.connection.empty()) return run.FailUsage(resolved);
  Table table;
  JsonObject object;
  for (const ConnectionSetting& setting : kConnectionSettings) {
    const auto found = run.connection.find(setting.name);
    if (found == run.connection.end()) continue;
    table.Row({setting.name, found->second.value, "(" + found->second.source + ")"});
    object.AddJson(setting.name, MemberJson(found->second.value, setting.kind));
  }
  if (const auto token = run.connection.find(kTokenSetting); token != run.connection.end()) {
    table.Row({kTokenSetting, "set", absl::StrCat("($", kTokenVariable, ")")});
  }
  if (!run.PrintForPrograms(object.Close(), run.connection.at("server").value)) {
    table.Print(run.out);
  }
  return resolved.ok() ? ExitCode::kDone : run.FailUsage(resolved);
}

}  // namespace

void AddContextCommand(Command program, Invocation* invocation) {
  Command command = program.AddCommand("context", "Manage named servers");
  command.RequireCommand();
  const auto arguments = std::make_shared<ContextArguments>();
  command.SetDetails(
      "Contexts are kept in $XDG_CONFIG_HOME/hullctl/contexts.json, by default below ~/.config,\n"
      "with paths of token files, never tokens. Precedence: an option; the context of --context;\n"
      "the environment; the context of $HULLCTL_CONTEXT or of 'context use'; the default. A\n"
      "context applies only to its own server: if --server or $HULLCTL_SERVER names another one,\n"
      "the context is ignored together with its token and authorities.");
  Command add = command.AddCommand("add", "Save --server and its options under a name");
  add.AddText("NAME", &arguments->name, "Name of the context").Required();
  add.AddFlag("--replace", &arguments->replace, "Replace an existing context of this name");
  add.SetExamples({{"",
                    "hullctl context add cell-3 --server cell-3.example:50551 --tls "
                    "--token-file cell-3.token"},
                   {"", "hullctl context add here --server 127.0.0.1:50551"}});
  OnGiven(add, invocation, arguments, Add, /*needs_server=*/false);
  Command use = command.AddCommand("use", "Select a context for later commands");
  use.AddText("NAME", &arguments->name, "Name of the context").Completes(ValueKind::kContext);
  use.AddFlag("--none", &arguments->none, "Select no context");
  use.SetExamples({{"", "hullctl context use cell-3"},
                   {"Use another context for a single command", "hullctl list --context here"}});
  OnGiven(use, invocation, arguments, Use, /*needs_server=*/false);
  Command list = command.AddCommand("list", "List the contexts");
  OnGiven(list, invocation, ListContexts, /*needs_server=*/false);
  Command show = command.AddCommand("show", "Show the effective settings and the source of each");
  show.AddText("NAME", &arguments->name, "Show the settings as with --context NAME")
      .Completes(ValueKind::kContext);
  OnGiven(show, invocation, arguments, Show, /*needs_server=*/false);
  Command remove = command.AddCommand("remove", "Remove a context");
  remove.AddText("NAME", &arguments->name, "Name of the context")
      .Required()
      .Completes(ValueKind::kContext);
  OnGiven(remove, invocation, arguments, Remove, /*needs_server=*/false);
}

}  // namespace hulld
