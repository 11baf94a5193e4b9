#ifndef HULLD_SERVER_STORE_POSTGRES_CONNINFO_H_
#define HULLD_SERVER_STORE_POSTGRES_CONNINFO_H_

#include <absl/status/statusor.h>

#include <map>
#include <string>

namespace hulld::server {

// How to reach a database. It may hold passwords, so that no error and no line of the log is made
// of its text; libpq's own errors name host, port, user and database.
class Conninfo {
 public:
  // text: a connection string of libpq, keywords with values or a URI. What it leaves open is
  // filled so that nothing waits for long for a machine that is gone, and so that a server is
  // chosen that takes changes. INVALID_ARGUMENT, which quotes nothing of the text: it is no
  // connection string, or a password in it ends early, so that the rest would be taken for a host
  // or a database.
  static absl::StatusOr<Conninfo> Parse(const std::string& text);

  // By keyword, as PQconnectdbParams wants them.
  const std::map<std::string, std::string>& parameters() const { return parameters_; }

 private:
  std::map<std::string, std::string> parameters_;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_STORE_POSTGRES_CONNINFO_H_
