#ifndef HULLD_SERVER_STORE_POSTGRES_CONNINFO_H_
#define HULLD_SERVER_STORE_POSTGRES_CONNINFO_H_

#include <absl/status/statusor.h>

#include <map>
#include <string>

namespace hulld::server {

// Connection parameters of a database by keyword, for PQconnectdbParams. They may include
// passwords, so no error or log line quotes the text; libpq's own errors name host, port, user and
// database.
using Conninfo = std::map<std::string, std::string>;

// text: a connection string of libpq, keywords with values or a URI. Missing keywords get defaults
// that bound the wait for an unreachable machine and select a writable server. INVALID_ARGUMENT,
// without quoting the text: it is not a connection string, or a password in it ends early, so that
// its rest would be parsed as a host or a database.
absl::StatusOr<Conninfo> ParseConninfo(const std::string& text);

}  // namespace hulld::server

#endif  // HULLD_SERVER_STORE_POSTGRES_CONNINFO_H_
