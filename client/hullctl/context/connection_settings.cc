#include "client/hullctl/context/connection_settings.h"

#include <absl/strings/ascii.h>
#include <absl/strings/str_cat.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <utility>

#include "client/client.h"
#include "client/formats/text_number.h"

namespace hulld {
namespace {

absl::StatusOr<std::string> ReadPem(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  std::string text;
  std::getline(file, text, '\0');
  // A directory can be opened, but not read.
  if (!file.is_open() || file.bad()) {
    return absl::InvalidArgumentError(absl::StrCat(path, ": ", std::strerror(errno)));
  }
  if (text.find("-----BEGIN ") == std::string::npos) {
    return absl::InvalidArgumentError(path + ": not in PEM format");
  }
  return text;
}

// Returns INVALID_ARGUMENT with the option, and its source if it was not given as an option.
absl::Status At(const std::string& name, const ChosenSetting& setting,
                const absl::Status& problem) {
  std::string place = "--" + name;
  if (setting.source != place) absl::StrAppend(&place, " (", setting.source, ")");
  return absl::InvalidArgumentError(absl::StrCat(place, ": ", problem.message()));
}

}  // namespace

std::map<std::string, ChosenSetting> Combine(const std::vector<SettingsLayer>& layers) {
  std::string server;
  for (const SettingsLayer& layer : layers) {
    const auto found = layer.settings.find("server");
    if (found != layer.settings.end() && server.empty()) server = found->second;
  }
  std::map<std::string, ChosenSetting> chosen;
  for (const SettingsLayer& layer : layers) {
    const auto own = layer.settings.find("server");
    const bool other = own != layer.settings.end() && own->second != server;
    if (layer.only_for_its_server && other) continue;
    const bool has_token = chosen.contains(kTokenSetting) || chosen.contains("token-file");
    for (const auto& [name, value] : layer.settings) {
      const bool is_token = name == kTokenSetting || name == "token-file";
      if (is_token && has_token) continue;
      if (name == kTokenSetting && layer.settings.contains("token-file")) continue;
      const std::string source = layer.source.empty() ? "--" + name : layer.source;
      chosen.insert({name, {value, source}});
    }
  }
  chosen.insert({"server", {kDefaultServer, "default"}});
  return chosen;
}

absl::StatusOr<ConnectionSettings> SettingsOfEnvironment() {
  ConnectionSettings settings;
  for (const ConnectionSetting& setting : kConnectionSettings) {
    const char* const value = setting.variable == nullptr ? nullptr : std::getenv(setting.variable);
    if (value == nullptr || *value == '\0') continue;
    std::string text = value;
    if (setting.kind == SettingKind::kFlag) {
      absl::AsciiStrToLower(&text);
      if (text == "1" || text == "yes" || text == "on") text = "true";
      if (text == "0" || text == "no" || text == "off") text = "false";
      if (text != "true" && text != "false") {
        return absl::InvalidArgumentError(
            absl::StrCat("$", setting.variable, ": ", Quoted(value), " is not true or false"));
      }
    }
    settings[setting.name] = text;
  }
  const char* const token = std::getenv(kTokenVariable);
  if (token != nullptr && *token != '\0') settings[kTokenSetting] = token;
  return settings;
}

absl::StatusOr<ConnectionSecurity> ReadSecurity(
    const std::map<std::string, ChosenSetting>& settings) {
  ConnectionSecurity security;
  const auto flag = [&settings](const char* name) {
    const auto found = settings.find(name);
    return found != settings.end() && found->second.value == "true";
  };
  security.tls = flag("tls");
  security.allow_plaintext_token = flag("insecure");
  struct Pem {
    const char* name;
    std::string* text;
  };
  for (const Pem& pem : {Pem{"ca-cert", &security.authorities}, Pem{"cert", &security.certificate},
                         Pem{"key", &security.key}}) {
    const auto found = settings.find(pem.name);
    if (found == settings.end()) continue;
    absl::StatusOr<std::string> text = ReadPem(found->second.value);
    if (!text.ok()) return At(pem.name, found->second, text.status());
    *pem.text = *std::move(text);
    security.tls = true;
  }
  if (const auto name = settings.find("server-name"); name != settings.end()) {
    security.server_name = name->second.value;
    security.tls = true;
  }
  if (const auto token = settings.find(kTokenSetting); token != settings.end()) {
    security.token = token->second.value;
  } else if (const auto file = settings.find("token-file"); file != settings.end()) {
    absl::StatusOr<std::string> read = ReadTokenFile(file->second.value);
    if (!read.ok()) return At("token-file", file->second, read.status());
    security.token = *std::move(read);
  }
  return security;
}

}  // namespace hulld
