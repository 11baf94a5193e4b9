#ifndef HULLD_TESTS_SERVER_HARNESS_POSTGRES_POSTGRES_CLUSTER_H_
#define HULLD_TESTS_SERVER_HARNESS_POSTGRES_POSTGRES_CLUSTER_H_

#include <sys/types.h>

#include <memory>
#include <string>
#include <vector>

namespace hulld::server {

// A PostgreSQL server with its own data directory, in memory (/dev/shm) or, if that is too small,
// in /tmp. It listens only on a unix socket there and ends with the test. Under root it runs as the
// user postgres, because PostgreSQL refuses to run as root. Any failure ends the test program.
class PostgresCluster {
 public:
  // Returns true if PostgreSQL's server is installed. Tests are skipped without it.
  static bool IsInstalled();
  // Message of skipped tests.
  static constexpr char kMissing[] = "PostgreSQL is not installed (Debian: postgresql-15)";

  // Created at first use.
  static PostgresCluster& Shared();

  PostgresCluster() : PostgresCluster(WalIn{}) {}
  // Writes its write-ahead log, in segments of 1 MiB, to an empty directory that belongs to the
  // server (GiveToServer).
  struct WalIn {
    std::string directory;
  };
  explicit PostgresCluster(const WalIn& wal);
  // A standby of `primary`, which must outlive it.
  struct StandbyOf {
    PostgresCluster& primary;
  };
  explicit PostgresCluster(const StandbyOf& standby);
  PostgresCluster(const PostgresCluster&) = delete;
  PostgresCluster& operator=(const PostgresCluster&) = delete;
  ~PostgresCluster();

  // Creates an empty database owned by the role hulld; returns its name.
  std::string MakeDatabase(const std::string& tablespace = "pg_default");
  // Returns a connection string for the role hulld, which is not a superuser. host: a proxy's;
  // empty: the server's own.
  std::string Conninfo(const std::string& database, const std::string& host = "") const;
  // Writes the connection string to a file for --postgres-conninfo-file, deleted with this object.
  // host: as above, or several, separated by commas.
  std::string WriteConninfo(const std::string& database, const std::string& host = "");
  const std::string& socket_directory() const { return directory_; }
  static constexpr char kPassword[] = "Wort-der-Rolle-7f";

  // Runs statements as a superuser; returns the first column of the last one's rows.
  std::vector<std::string> RunSql(const std::string& database, const std::string& sql) const;

  // Locks an existing table until the returned handle is destroyed; its readers wait.
  std::shared_ptr<void> HoldTable(const std::string& database, const std::string& table) const;

  // Starts the server and waits until it answers.
  void Start();
  // Replaces all local data by a copy of `primary` and follows it as its synchronous standby: every
  // later commit is on both.
  void Follow(PostgresCluster& primary);
  // Promotes a standby to an independent primary.
  void Promote();
  // Stops all processes immediately without saving, as pg_ctl stop -m immediate.
  void StopImmediately();
  // Sends SIGKILL to the server's first process; its children exit too.
  void Kill();
  // Sends SIGKILL to all processes, as if the machine failed.
  void KillAll();
  // Send SIGSTOP and SIGCONT to all processes.
  void Suspend();
  void Resume();

  // Gives the user who runs PostgreSQL write access to this path.
  static void GiveToServer(const std::string& path);

 private:
  void MakeDirectory();
  void InitializeData(const std::vector<std::string>& options);
  // Copies a data directory that initdb made once, cached in the build folder: a copy takes a
  // seventh of the time, and hundreds of tests need one. Therefore all clusters of a build have the
  // same system identifier.
  void MakeData();
  std::vector<pid_t> Children() const;
  void WaitForEnd();

  std::string directory_;
  pid_t server_ = -1;
  int databases_ = 0;
  int files_ = 0;
};

}  // namespace hulld::server

#endif  // HULLD_TESTS_SERVER_HARNESS_POSTGRES_POSTGRES_CLUSTER_H_
