#include "client/hullctl/command_line/connection.h"

#include <absl/status/statusor.h>
#include <absl/strings/str_cat.h>

#include <cstdlib>
#include <string>
#include <utility>
#include <vector>

#include "client/base/status_macros.h"
#include "client/hullctl/context/context_file.h"
#include "client/server_address.h"

namespace hulld {
namespace {

constexpr char kContextVariable[] = "HULLCTL_CONTEXT";

// The context used without --context: its name and the source of that name.
struct NamedContext {
  std::string name;
  std::string source;
};

NamedContext ContextInForce(const Invocation& invocation, const ContextFile& file) {
  if (!invocation.context.empty()) return {invocation.context, "--context"};
  const char* const variable = std::getenv(kContextVariable);
  if (variable != nullptr && *variable != '\0') return {variable, "$HULLCTL_CONTEXT"};
  return {file.current, ContextFilePath()};
}

absl::StatusOr<std::vector<SettingsLayer>> LayersOf(const Invocation& invocation) {
  HULLD_ASSIGN_OR_RETURN(auto environment, SettingsOfEnvironment());
  HULLD_ASSIGN_OR_RETURN(auto file, ReadContextFile());
  std::vector<SettingsLayer> layers = {{"", invocation.flags, false},
                                       {"environment", std::move(environment), false}};
  const NamedContext named = ContextInForce(invocation, file);
  if (named.name.empty()) return layers;
  auto context = FindContext(file, named.name);
  if (!context.ok()) {
    return absl::InvalidArgumentError(absl::StrCat(named.source, ": ", context.status().message()));
  }
  const bool by_option = !invocation.context.empty();
  const auto server = invocation.flags.find("server");
  if (by_option && server != invocation.flags.end() && server->second != context->at("server")) {
    return absl::InvalidArgumentError(
        absl::StrCat("--server ", server->second, " differs from the server of --context ",
                     named.name, ", ", context->at("server"), "; pass one of the two options"));
  }
  SettingsLayer layer{"context " + named.name, *std::move(context), !by_option};
  if (by_option) layers[1].only_for_its_server = true;
  layers.insert(layers.begin() + (by_option ? 1 : 2), std::move(layer));
  return layers;
}

}  // namespace

void AddConnectionOptions(Command command, Invocation* invocation) {
  ConnectionSettings* const flags = &invocation->flags;
  command
      .AddText("--context", &invocation->context,
               "Name of the context to use; see 'hullctl context'")
      .ValueName("NAME")
      .Completes(ValueKind::kContext)
      .Variable(kContextVariable);
  command.AddFlag("--local", &invocation->local,
                  "Run the command against a temporary in-memory server");
  for (const ConnectionSetting& setting : kConnectionSettings) {
    const std::string name = setting.name;
    const std::string option = name == "server" ? "-s,--server" : "--" + name;
    const char* const variable = setting.variable == nullptr ? "" : setting.variable;
    if (setting.kind == SettingKind::kFlag) {
      command
          .AddFlag(
              option, [=] { (*flags)[name] = "true"; }, setting.help)
          .Variable(variable);
      continue;
    }
    const auto take = [=](const std::string& text) {
      (*flags)[name] = text;
      return name == "server" ? ValidateServer(text) : absl::OkStatus();
    };
    command.AddParsed(option, take, setting.help).ValueName(setting.value_name).Variable(variable);
  }
}

absl::Status ResolveConnection(Invocation* invocation) {
  HULLD_ASSIGN_OR_RETURN(auto layers, LayersOf(*invocation));
  invocation->connection = Combine(layers);
  const ChosenSetting& server = invocation->connection.at("server");
  if (const absl::Status valid = ValidateServer(server.value); !valid.ok()) {
    return absl::InvalidArgumentError(
        absl::StrCat("server of ", server.source, ": ", valid.message()));
  }
  invocation->server = server.value;
  HULLD_ASSIGN_OR_RETURN(invocation->security, ReadSecurity(invocation->connection));
  return ValidateSecurity(invocation->security, invocation->server);
}

}  // namespace hulld
