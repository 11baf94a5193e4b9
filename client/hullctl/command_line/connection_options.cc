#include "client/hullctl/command_line/connection_options.h"

#include <absl/status/statusor.h>
#include <absl/strings/str_cat.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <iterator>
#include <string>

namespace hulld {
namespace {

// Not an argument, which every user of the machine could see.
constexpr char kTokenVariable[] = "HULLD_TOKEN";

absl::StatusOr<std::string> ReadPem(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file) return absl::InvalidArgumentError(absl::StrCat(path, ": ", std::strerror(errno)));
  std::string text{std::istreambuf_iterator<char>(file), {}};
  if (text.find("-----BEGIN ") == std::string::npos) {
    return absl::InvalidArgumentError(path + ": it is not in PEM format");
  }
  return text;
}

void AddPemOption(Command command, const std::string& name, const std::string& variable,
                  const std::string& description, ConnectionSecurity* security,
                  std::string* value) {
  const auto read = [=](const std::string& path) {
    absl::StatusOr<std::string> text = ReadPem(path);
    if (!text.ok()) return text.status();
    *value = *std::move(text);
    security->tls = true;
    return absl::OkStatus();
  };
  command.AddParsed(name, read, description).ValueName("FILE").Environment(variable);
}

}  // namespace

void AddConnectionOptions(Command command, Invocation* invocation) {
  ConnectionSecurity* const security = &invocation->security;
  command
      .AddFlag(
          "--tls", [security] { security->tls = true; },
          "Encrypt, and trust the authorities of the system; the next four imply it")
      .Environment("HULLCTL_TLS");
  AddPemOption(command, "--ca-cert", "HULLCTL_CA_CERT",
               "The authorities that the server's certificate may come from", security,
               &security->authorities);
  AddPemOption(command, "--cert", "HULLCTL_CERT", "Our certificate, for a server that asks for one",
               security, &security->certificate);
  AddPemOption(command, "--key", "HULLCTL_KEY", "Its private key", security, &security->key);
  command
      .AddParsed(
          "--server-name",
          [security](const std::string& name) {
            security->server_name = name;
            security->tls = true;
            return absl::OkStatus();
          },
          "The name in the server's certificate, where it is not that of --server")
      .ValueName("NAME")
      .Environment("HULLCTL_SERVER_NAME");
  command
      .AddParsed(
          "--token-file",
          [security](const std::string& path) {
            absl::StatusOr<std::string> token = ReadTokenFile(path);
            if (token.ok()) security->token = *std::move(token);
            return token.status();
          },
          absl::StrCat("The token that the server asks for (default: $", kTokenVariable, ")"))
      .ValueName("FILE")
      .Environment("HULLCTL_TOKEN_FILE");
  command.AddFlag("--insecure", &security->allow_plaintext_token,
                  "Let the token go unencrypted to other machines");
}

absl::Status CompleteConnectionOptions(Invocation* invocation) {
  ConnectionSecurity& security = invocation->security;
  const char* const token = std::getenv(kTokenVariable);
  if (security.token.empty() && token != nullptr) security.token = token;
  return ValidateSecurity(security, invocation->server);
}

}  // namespace hulld
