#include "server/store/postgres/conninfo.h"

#include <absl/status/status.h>
#include <absl/strings/ascii.h>
#include <libpq-fe.h>

#include <memory>

namespace hulld::server {
namespace {

// Defaults for missing keywords. Times in seconds, TCP's in milliseconds; a choice: longer than a
// network glitch, shorter than an operator's patience.
constexpr struct {
  const char* keyword;
  const char* value;
} kDefaults[] = {
    {"fallback_application_name", "hulld"},
    {"client_encoding", "UTF8"},
    {"connect_timeout", "5"},
    {"keepalives_idle", "5"},
    {"keepalives_interval", "2"},
    {"keepalives_count", "3"},
    {"tcp_user_timeout", "10000"},
    {"target_session_attrs", "read-write"},
};

}  // namespace

absl::StatusOr<Conninfo> ParseConninfo(const std::string& text) {
  const std::string trimmed(absl::StripAsciiWhitespace(text));
  if (trimmed.empty()) return absl::InvalidArgumentError("it is empty");
  // libpq's message would quote the text.
  char* words = nullptr;
  const std::unique_ptr<PQconninfoOption, decltype(&PQconninfoFree)> options(
      PQconninfoParse(trimmed.c_str(), &words), PQconninfoFree);
  PQfreemem(words);
  if (options == nullptr) {
    return absl::InvalidArgumentError(
        "it is not a libpq connection string, such as 'host=db.example dbname=hulld user=hulld "
        "password=...' (a value with spaces in single quotes) or "
        "'postgresql://hulld@db.example/hulld'");
  }
  Conninfo conninfo;
  for (const PQconninfoOption* option = options.get(); option->keyword != nullptr; ++option) {
    if (option->val != nullptr) conninfo[option->keyword] = option->val;
  }
  for (const auto& [keyword, value] : kDefaults) conninfo.emplace(keyword, value);
  const auto holds = [&](const char* keyword, const char* forbidden, bool only) {
    const auto found = conninfo.find(keyword);
    if (found == conninfo.end()) return false;
    return (only ? found->second.find_first_not_of(forbidden)
                 : found->second.find_first_of(forbidden)) != std::string::npos;
  };
  if (holds("host", "@", false) || holds("dbname", "@", false) ||
      holds("port", "0123456789,", true)) {
    return absl::InvalidArgumentError(
        "its host or database contains an @, or its port is not a number; in the password of a "
        "URI, write @ as %40 and / as %2F");
  }
  return conninfo;
}

}  // namespace hulld::server
