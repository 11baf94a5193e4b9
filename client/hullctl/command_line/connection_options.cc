#include "client/hullctl/command_line/connection_options.h"

#include <absl/strings/str_cat.h>

#include <CLI/CLI.hpp>
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

std::string ReadPem(const std::string& path, const std::string& option) {
  std::ifstream file(path, std::ios::binary);
  if (!file) throw CLI::ValidationError(option, path + ": " + std::strerror(errno));
  std::string text{std::istreambuf_iterator<char>(file), {}};
  if (text.find("-----BEGIN ") == std::string::npos) {
    throw CLI::ValidationError(option, path + ": it is not in PEM format");
  }
  return text;
}

void AddPemOption(CLI::App* app, const std::string& name, const std::string& variable,
                  const std::string& description, ConnectionSecurity* security,
                  std::string* value) {
  app->add_option_function<std::string>(
         name,
         [=](const std::string& path) {
           *value = ReadPem(path, name);
           security->tls = true;
         },
         description)
      ->type_name("FILE")
      ->envname(variable);
}

}  // namespace

void AddConnectionOptions(CLI::App* app, Invocation* invocation) {
  ConnectionSecurity* const security = &invocation->security;
  app->add_flag_callback(
         "--tls", [security] { security->tls = true; },
         "Encrypt, and trust the authorities of the system; the next four imply it")
      ->envname("HULLCTL_TLS");
  AddPemOption(app, "--ca-cert", "HULLCTL_CA_CERT",
               "The authorities that the server's certificate may come from", security,
               &security->authorities);
  AddPemOption(app, "--cert", "HULLCTL_CERT", "Our certificate, for a server that asks for one",
               security, &security->certificate);
  AddPemOption(app, "--key", "HULLCTL_KEY", "Its private key", security, &security->key);
  app->add_option_function<std::string>(
         "--server-name",
         [security](const std::string& name) {
           security->server_name = name;
           security->tls = true;
         },
         "The name in the server's certificate, where it is not that of --server")
      ->type_name("NAME")
      ->envname("HULLCTL_SERVER_NAME");
  app->add_option_function<std::string>(
         "--token-file",
         [security](const std::string& path) {
           const absl::StatusOr<std::string> token = ReadTokenFile(path);
           if (!token.ok()) {
             throw CLI::ValidationError("--token-file", std::string(token.status().message()));
           }
           security->token = *token;
         },
         absl::StrCat("The token that the server asks for (default: $", kTokenVariable, ")"))
      ->type_name("FILE")
      ->envname("HULLCTL_TOKEN_FILE");
  app->add_flag("--insecure", security->allow_plaintext_token,
                "Let the token go unencrypted to other machines");
}

absl::Status CompleteConnectionOptions(Invocation* invocation) {
  ConnectionSecurity& security = invocation->security;
  const char* const token = std::getenv(kTokenVariable);
  if (security.token.empty() && token != nullptr) security.token = token;
  return ValidateSecurity(security, invocation->server);
}

}  // namespace hulld
