#ifndef HULLD_TESTS_SERVER_HARNESS_POSTGRES_POSTGRES_CLUSTER_H_
#define HULLD_TESTS_SERVER_HARNESS_POSTGRES_POSTGRES_CLUSTER_H_

#include <sys/types.h>

#include <string>
#include <vector>

namespace hulld::server {

// A PostgreSQL server with a data directory of its own in the temporary folder, on a unix socket
// there and nowhere else. It ends with the test. As it refuses to run as root, it then runs as the
// user postgres. What fails here ends the test program.
class PostgresCluster {
 public:
  // Whether PostgreSQL's server is installed; tests are skipped without it.
  static bool IsInstalled();
  // What skipped tests say.
  static constexpr char kMissing[] = "PostgreSQL is not installed (Debian: postgresql-15)";

  // Made at first use.
  static PostgresCluster& Shared();

  PostgresCluster();
  PostgresCluster(const PostgresCluster&) = delete;
  PostgresCluster& operator=(const PostgresCluster&) = delete;
  ~PostgresCluster();

  // An empty database that belongs to the role hulld; returns its name.
  std::string MakeDatabase();
  // Of the role hulld, which is no superuser. host: of a proxy; empty: of the server itself.
  std::string Conninfo(const std::string& database, const std::string& host = "") const;
  // In a file of ours, as --postgres-conninfo-file wants it; it goes with this.
  std::string WriteConninfo(const std::string& database) const;
  const std::string& socket_directory() const { return directory_; }
  static constexpr char kPassword[] = "Wort-der-Rolle-7f";

  // Runs statements as a superuser; the first column of the rows of the last.
  std::vector<std::string> Ask(const std::string& database, const std::string& sql) const;

  // Waits until it answers.
  void Start();
  // All its processes at once, as pg_ctl stop -m immediate, which asks nobody and saves nothing.
  void StopImmediately();
  // kill -9 of the server's first process; the others follow.
  void Kill();
  // SIGSTOP and SIGCONT of all its processes.
  void Suspend() { SignalAll(true); }
  void Resume() { SignalAll(false); }

 private:
  void SignalAll(bool stop);
  void WaitForEnd();

  std::string directory_;
  pid_t server_ = -1;
  int databases_ = 0;
};

}  // namespace hulld::server

#endif  // HULLD_TESTS_SERVER_HARNESS_POSTGRES_POSTGRES_CLUSTER_H_
