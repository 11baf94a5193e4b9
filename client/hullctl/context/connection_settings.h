#ifndef HULLD_CLIENT_HULLCTL_CONTEXT_CONNECTION_SETTINGS_H_
#define HULLD_CLIENT_HULLCTL_CONTEXT_CONNECTION_SETTINGS_H_

#include <absl/status/statusor.h>

#include <functional>
#include <map>
#include <optional>
#include <string>

#include "client/client.h"

namespace hulld {

// Where a server is and how to talk to it, as text: by the names of the options, "server" and so
// on. A flag such as "tls" is "true" or "false". Files are paths, never their content.
using ConnectionSettings = std::map<std::string, std::string>;

enum class SettingKind { kText, kFile, kFlag };

// One of the options that say where a server is.
struct ConnectionSetting {
  const char* name;
  // The environment variable; null: none.
  const char* variable;
  SettingKind kind;
  // As the help names it; null for a flag.
  const char* value_name;
  const char* help;
};

inline constexpr ConnectionSetting kConnectionSettings[] = {
    {"server", "HULLCTL_SERVER", SettingKind::kText, "HOST:PORT",
     "Where hulld listens, or several over one store: ADDRESS:PORT,ADDRESS:PORT or "
     "dns:///NAME:PORT (default 127.0.0.1:50551)"},
    {"tls", "HULLCTL_TLS", SettingKind::kFlag, nullptr,
     "Encrypt, and trust the authorities of the system; the next four imply it"},
    {"ca-cert", "HULLCTL_CA_CERT", SettingKind::kFile, "FILE",
     "The authorities that the server's certificate may come from"},
    {"cert", "HULLCTL_CERT", SettingKind::kFile, "FILE",
     "Our certificate, for a server that asks for one"},
    {"key", "HULLCTL_KEY", SettingKind::kFile, "FILE", "Its private key"},
    {"server-name", "HULLCTL_SERVER_NAME", SettingKind::kText, "NAME",
     "The name in the server's certificate, where it is not that of --server"},
    {"token-file", "HULLCTL_TOKEN_FILE", SettingKind::kFile, "FILE",
     "The token that the server asks for; or the token itself in $HULLD_TOKEN"},
    {"insecure", nullptr, SettingKind::kFlag, nullptr,
     "Let the token go unencrypted to other machines"},
};

// A token itself, which only the environment gives: arguments can be seen by every user of the
// machine.
inline constexpr char kTokenSetting[] = "token";
inline constexpr char kTokenVariable[] = "HULLD_TOKEN";

// One source of settings, such as "context cell-3".
struct SettingsLayer {
  std::string source;
  ConnectionSettings settings;
  // Left aside where an earlier layer names another server: a token or an authority must not go
  // with a server that it is not for.
  bool only_for_its_server = false;
};

struct ChosenSetting {
  std::string value;
  // Where it comes from.
  std::string source;
};

// What the layers together say, the first one first; with "server" always there. Where a token and
// a file of one are both set, the earlier layer's is chosen, and within one layer the file.
std::map<std::string, ChosenSetting> Combine(const std::vector<SettingsLayer>& layers);

// What the variables of the environment set.
absl::StatusOr<ConnectionSettings> SettingsOfEnvironment();

// Reads the files. INVALID_ARGUMENT names the option and its source.
absl::StatusOr<ConnectionSecurity> ReadSecurity(
    const std::map<std::string, ChosenSetting>& settings);

}  // namespace hulld

#endif  // HULLD_CLIENT_HULLCTL_CONTEXT_CONNECTION_SETTINGS_H_
