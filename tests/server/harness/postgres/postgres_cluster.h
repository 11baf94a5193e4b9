#ifndef HULLD_TESTS_SERVER_HARNESS_POSTGRES_POSTGRES_CLUSTER_H_
#define HULLD_TESTS_SERVER_HARNESS_POSTGRES_POSTGRES_CLUSTER_H_

#include <sys/types.h>

#include <memory>
#include <string>
#include <vector>

namespace hulld::server {

// A PostgreSQL server with a data directory of its own, in memory (/dev/shm) or, where that is
// small, in /tmp, on a unix socket there and nowhere else. It ends with the test. As it refuses to
// run as root, it then runs as the user postgres. What fails here ends the test program.
class PostgresCluster {
 public:
  // Whether PostgreSQL's server is installed; tests are skipped without it.
  static bool IsInstalled();
  // What skipped tests say.
  static constexpr char kMissing[] = "PostgreSQL is not installed (Debian: postgresql-15)";

  // Made at first use.
  static PostgresCluster& Shared();

  PostgresCluster() : PostgresCluster(WalIn{}) {}
  // Keeps its log in a directory of its own, which belongs to the server (GiveToServer) and is
  // empty, in segments of 1 MiB.
  struct WalIn {
    std::string directory;
  };
  explicit PostgresCluster(const WalIn& wal);
  // A standby of `primary`, which has to live on.
  struct StandbyOf {
    PostgresCluster& primary;
  };
  explicit PostgresCluster(const StandbyOf& standby);
  PostgresCluster(const PostgresCluster&) = delete;
  PostgresCluster& operator=(const PostgresCluster&) = delete;
  ~PostgresCluster();

  // An empty database that belongs to the role hulld; returns its name.
  std::string MakeDatabase(const std::string& tablespace = "pg_default");
  // A connection string for the role hulld, which is no superuser. host: that of a proxy; empty:
  // that of the server itself.
  std::string Conninfo(const std::string& database, const std::string& host = "") const;
  // In a file of ours, as --postgres-conninfo-file wants it; it goes with this. host: as above, or
  // several, separated by commas.
  std::string WriteConninfo(const std::string& database, const std::string& host = "");
  const std::string& socket_directory() const { return directory_; }
  static constexpr char kPassword[] = "Wort-der-Rolle-7f";

  // Runs statements as a superuser; the first column of the rows of the last.
  std::vector<std::string> Ask(const std::string& database, const std::string& sql) const;

  // Locks a table, which has to be there: until what is returned ends, who looks into it waits.
  std::shared_ptr<void> HoldTable(const std::string& database, const std::string& table) const;

  // Waits until it answers.
  void Start();
  // Copies `primary` in the place of all that is here, and follows it as its synchronous standby:
  // from then on what is committed there is on both.
  void Follow(PostgresCluster& primary);
  // A standby goes on by itself, and takes changes.
  void Promote();
  // All its processes at once, as pg_ctl stop -m immediate, which asks nobody and saves nothing.
  void StopImmediately();
  // kill -9 of the server's first process; the others follow.
  void Kill();
  // kill -9 of all its processes, as when its machine is gone.
  void KillAll();
  // SIGSTOP and SIGCONT of all its processes.
  void Suspend();
  void Resume();

  // Lets the user who runs PostgreSQL write what is at this path.
  static void GiveToServer(const std::string& path);

 private:
  void MakeDirectory();
  void InitializeData(const std::vector<std::string>& options);
  // As initdb makes it, kept in the build folder: a copy takes a seventh of its time, and hundreds
  // of tests need one. All clusters of a build have one system identifier.
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
