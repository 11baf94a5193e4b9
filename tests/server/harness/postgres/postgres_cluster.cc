#include "tests/server/harness/postgres/postgres_cluster.h"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_join.h>
#include <fcntl.h>
#include <libpq-fe.h>
#include <pwd.h>
#include <signal.h>
#include <spawn.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <thread>

namespace hulld::server {
namespace {

constexpr char kAdminPassword[] = "Wort-des-Verwalters-3c";

[[noreturn]] void Fail(const std::string& what) {
  std::fprintf(stderr, "PostgresCluster: %s\n", what.c_str());
  std::abort();
}

// Where the newest server's programs are; empty: nowhere.
std::string ProgramDirectory() {
  std::vector<std::string> found;
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator("/usr/lib/postgresql", error)) {
    if (std::filesystem::exists(entry.path() / "bin" / "initdb", error)) {
      found.push_back(entry.path() / "bin");
    }
  }
  return found.empty() ? "" : std::ranges::max(found);
}

// The arguments that run a program as a user who may run PostgreSQL, and end it with us.
std::vector<std::string> AsServer(std::vector<std::string> arguments) {
  std::vector<std::string> all = {"setpriv", "--pdeathsig", "QUIT"};
  if (geteuid() == 0) {
    const passwd* user = getpwnam("postgres");
    if (user == nullptr) user = getpwnam("nobody");
    if (user == nullptr) Fail("there is neither a user postgres nor nobody");
    all.insert(all.end(), {absl::StrCat("--reuid=", user->pw_uid),
                           absl::StrCat("--regid=", user->pw_gid), "--clear-groups"});
  }
  all.push_back("--");
  all.insert(all.end(), arguments.begin(), arguments.end());
  return all;
}

// What it prints goes to a file.
pid_t Spawn(std::vector<std::string> arguments, const std::string& log) {
  std::vector<char*> argv;
  for (std::string& argument : arguments) argv.push_back(argument.data());
  argv.push_back(nullptr);
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, log.c_str(),
                                   O_WRONLY | O_CREAT | O_APPEND, 0600);
  posix_spawn_file_actions_adddup2(&actions, STDOUT_FILENO, STDERR_FILENO);
  pid_t pid = -1;
  if (posix_spawnp(&pid, argv[0], &actions, nullptr, argv.data(), environ) != 0) {
    Fail(absl::StrCat("cannot start ", absl::StrJoin(arguments, " ")));
  }
  posix_spawn_file_actions_destroy(&actions);
  return pid;
}

std::string Contents(const std::string& path) {
  std::ifstream file(path);
  return {std::istreambuf_iterator<char>(file), {}};
}

}  // namespace

bool PostgresCluster::IsInstalled() { return !ProgramDirectory().empty(); }

PostgresCluster& PostgresCluster::Shared() {
  static PostgresCluster cluster;
  return cluster;
}

PostgresCluster::PostgresCluster() {
  // Short, as a socket's path holds 107 characters.
  std::string name = "/tmp/hulld-postgres-XXXXXX";
  directory_ = mkdtemp(name.data());
  const std::string password_file = directory_ + "/password";
  std::ofstream(password_file) << kAdminPassword << "\n";
  if (geteuid() == 0) {
    const passwd* user = getpwnam("postgres");
    if (user == nullptr) user = getpwnam("nobody");
    for (const std::string& path : {directory_, password_file}) {
      if (user == nullptr || chown(path.c_str(), user->pw_uid, user->pw_gid) != 0) {
        Fail("cannot give a directory to the user who runs PostgreSQL");
      }
    }
  }
  chmod(directory_.c_str(), 0755);
  const std::string log = directory_ + "/initdb.log";
  const pid_t initdb =
      Spawn(AsServer({ProgramDirectory() + "/initdb", "-D", directory_ + "/data", "-U", "postgres",
                      "--pwfile", password_file, "--auth=scram-sha-256", "--locale=C",
                      "--encoding=UTF8", "--no-sync", "--no-instructions"}),
            log);
  int status = 0;
  if (waitpid(initdb, &status, 0) != initdb || status != 0) Fail(Contents(log));
  Start();
  Ask("postgres", absl::StrCat("CREATE ROLE hulld LOGIN PASSWORD '", kPassword, "'"));
}

PostgresCluster::~PostgresCluster() {
  if (server_ > 0) StopImmediately();
  std::error_code error;
  std::filesystem::remove_all(directory_, error);
}

void PostgresCluster::Start() {
  const std::string log = directory_ + "/server.log";
  const std::string conninfo = absl::StrCat("host=", directory_, " connect_timeout=5");
  while (true) {
    server_ = Spawn(AsServer({ProgramDirectory() + "/postgres", "-D", directory_ + "/data", "-k",
                              directory_, "-c", "listen_addresses=", "-c", "shared_buffers=16MB",
                              "-c", "max_connections=200", "-c", "autovacuum=off"}),
                    log);
    int status = 0;
    while (waitpid(server_, &status, WNOHANG) == 0) {
      if (PQping(conninfo.c_str()) == PQPING_OK) return;
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
    // Processes of one that was killed may still be there.
    if (Contents(log).find("shared memory block") == std::string::npos) Fail(Contents(log));
  }
}

void PostgresCluster::WaitForEnd() {
  int status = 0;
  if (waitpid(server_, &status, 0) != server_) Fail("the server is not ours to wait for");
  server_ = -1;
}

void PostgresCluster::StopImmediately() {
  kill(server_, SIGQUIT);
  WaitForEnd();
}

void PostgresCluster::Kill() {
  kill(server_, SIGKILL);
  WaitForEnd();
}

void PostgresCluster::SignalAll(bool stop) {
  const int number = stop ? SIGSTOP : SIGCONT;
  // First the one that would make more of them.
  kill(server_, number);
  std::ifstream children(absl::StrCat("/proc/", server_, "/task/", server_, "/children"));
  for (pid_t child = 0; children >> child;) kill(child, number);
}

std::string PostgresCluster::MakeDatabase() {
  const std::string name = absl::StrCat("test_", ++databases_);
  Ask("postgres", absl::StrCat("CREATE DATABASE ", name, " OWNER hulld"));
  return name;
}

std::string PostgresCluster::Conninfo(const std::string& database, const std::string& host) const {
  return absl::StrCat("host=", host.empty() ? directory_ : host, " dbname=", database,
                      " user=hulld password=", kPassword);
}

std::string PostgresCluster::WriteConninfo(const std::string& database) const {
  const std::string path = absl::StrCat(directory_, "/", database, ".conninfo");
  const int fd = open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0600);
  const std::string text = Conninfo(database) + "\n";
  if (write(fd, text.data(), text.size()) != static_cast<ssize_t>(text.size())) Fail(path);
  close(fd);
  return path;
}

std::vector<std::string> PostgresCluster::Ask(const std::string& database,
                                              const std::string& sql) const {
  PGconn* const connection = PQconnectdb(absl::StrCat("host=", directory_, " dbname=", database,
                                                      " user=postgres password=", kAdminPassword)
                                             .c_str());
  PGresult* const result = PQexec(connection, sql.c_str());
  const ExecStatusType status = PQresultStatus(result);
  if (status != PGRES_COMMAND_OK && status != PGRES_TUPLES_OK) {
    Fail(absl::StrCat(sql, ": ", PQerrorMessage(connection)));
  }
  std::vector<std::string> rows;
  for (int i = 0; i < PQntuples(result); ++i) rows.emplace_back(PQgetvalue(result, i, 0));
  PQclear(result);
  PQfinish(connection);
  return rows;
}

}  // namespace hulld::server
