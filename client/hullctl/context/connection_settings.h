#ifndef HULLD_CLIENT_HULLCTL_CONTEXT_CONNECTION_SETTINGS_H_
#define HULLD_CLIENT_HULLCTL_CONTEXT_CONNECTION_SETTINGS_H_

#include <absl/status/statusor.h>

#include <map>
#include <string>
#include <vector>

#include "client/connection_security.h"

namespace hulld {

// Connection settings as text, keyed by option name: "server" and so on. A flag such as "tls" is
// "true" or "false". Files are paths, never their content.
using ConnectionSettings = std::map<std::string, std::string>;

enum class SettingKind { kText, kFile, kFlag };

// One connection option.
struct ConnectionSetting {
  const char* name;
  // The environment variable; null: none.
  const char* variable;
  SettingKind kind;
  // Name of the value in the help; null for a flag.
  const char* value_name;
  const char* help;
};

inline constexpr ConnectionSetting kConnectionSettings[] = {
    {"server", "HULLCTL_SERVER", SettingKind::kText, "HOST:PORT",
     "Address of hulld, or of several over one store: ADDRESS:PORT,ADDRESS:PORT or "
     "dns:///NAME:PORT (default 127.0.0.1:50551)"},
    {"tls", "HULLCTL_TLS", SettingKind::kFlag, nullptr,
     "Use TLS with the authorities of the system; the next four options imply it"},
    {"ca-cert", "HULLCTL_CA_CERT", SettingKind::kFile, "FILE",
     "Authorities that may sign the server's certificate"},
    {"cert", "HULLCTL_CERT", SettingKind::kFile, "FILE",
     "Client certificate, for a server that requires one"},
    {"key", "HULLCTL_KEY", SettingKind::kFile, "FILE", "Its private key"},
    {"server-name", "HULLCTL_SERVER_NAME", SettingKind::kText, "NAME",
     "Name in the server's certificate, if it differs from --server"},
    {"token-file", "HULLCTL_TOKEN_FILE", SettingKind::kFile, "FILE",
     "File of the token; $HULLD_TOKEN contains the token itself"},
    {"insecure", nullptr, SettingKind::kFlag, nullptr,
     "Allow sending the token unencrypted to other machines"},
};

// The token itself. It comes only from the environment, because all users of the machine can see
// arguments.
inline constexpr char kTokenSetting[] = "token";
inline constexpr char kTokenVariable[] = "HULLD_TOKEN";

// One source of settings, such as "context cell-3".
struct SettingsLayer {
  std::string source;
  ConnectionSettings settings;
  // True: ignored if an earlier layer names another server, so that a token or an authority is
  // never used with the wrong server.
  bool only_for_its_server = false;
};

struct ChosenSetting {
  std::string value;
  // Source of the value.
  std::string source;
};

// Combines the layers, earlier ones first; the result always has "server". If both a token and a
// token file are set, the earlier layer wins; within one layer, the file.
std::map<std::string, ChosenSetting> Combine(const std::vector<SettingsLayer>& layers);

// Returns the settings from environment variables.
absl::StatusOr<ConnectionSettings> SettingsOfEnvironment();

// Reads the files. INVALID_ARGUMENT names the option and its source.
absl::StatusOr<ConnectionSecurity> ReadSecurity(
    const std::map<std::string, ChosenSetting>& settings);

}  // namespace hulld

#endif  // HULLD_CLIENT_HULLCTL_CONTEXT_CONNECTION_SETTINGS_H_
