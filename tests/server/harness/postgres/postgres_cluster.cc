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
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <thread>

namespace hulld::server {
namespace {

constexpr char kAdminPassword[] = "Wort-des-Verwalters-3c";
// Several times the size of all clusters of a few concurrent tests, so that they do not fill it.
constexpr uintmax_t kSpaceInMemory = uintmax_t{2} << 30;
// Far more attempts than a standby needs to catch up.
constexpr int kMaxAttempts = 10'000;

[[noreturn]] void Fail(const std::string& what) {
  std::fprintf(stderr, "PostgresCluster: %s\n", what.c_str());
  std::abort();
}

// Options of initdb, independent of the data directory.
constexpr const char* kInitialOptions[] = {
    "-U",        "postgres",         "--auth=scram-sha-256", "--locale=C", "--encoding=UTF8",
    "--no-sync", "--no-instructions"};

// Returns the directory of the newest server's programs; empty if none is installed.
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

// Returns arguments that run a program as a user permitted to run PostgreSQL, and end it with this
// process.
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

// The program's output goes to a file.
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

// Requires: the program succeeds.
void RunToEnd(std::vector<std::string> arguments, const std::string& log) {
  const pid_t pid = Spawn(std::move(arguments), log);
  int status = 0;
  if (waitpid(pid, &status, 0) != pid || status != 0) Fail(Contents(log));
}

}  // namespace

bool PostgresCluster::IsInstalled() { return !ProgramDirectory().empty(); }

PostgresCluster& PostgresCluster::Shared() {
  static PostgresCluster cluster;
  return cluster;
}

void PostgresCluster::GiveToServer(const std::string& path) {
  if (geteuid() != 0) return;
  const passwd* user = getpwnam("postgres");
  if (user == nullptr) user = getpwnam("nobody");
  if (user == nullptr || chown(path.c_str(), user->pw_uid, user->pw_gid) != 0) {
    Fail(absl::StrCat("cannot give ", path, " to the user who runs PostgreSQL"));
  }
}

void PostgresCluster::MakeDirectory() {
  // Each cluster has two thousand files. Creating them on ext4 takes a second of CPU if as many
  // were deleted in the preceding seconds, which consecutive tests do. In memory it takes no time.
  std::error_code error;
  const auto in_memory = std::filesystem::space("/dev/shm", error);
  const bool fits = !error && in_memory.available >= kSpaceInMemory;
  // Kept short: a socket path has at most 107 characters.
  std::string name = absl::StrCat(fits ? "/dev/shm" : "/tmp", "/hulld-postgres-XXXXXX");
  directory_ = mkdtemp(name.data());
  GiveToServer(directory_);
  chmod(directory_.c_str(), 0755);
}

void PostgresCluster::InitializeData(const std::vector<std::string>& options) {
  const std::string password_file = directory_ + "/password";
  std::ofstream(password_file) << kAdminPassword << "\n";
  GiveToServer(password_file);
  std::vector<std::string> initdb = {ProgramDirectory() + "/initdb", "-D", directory_ + "/data",
                                     "--pwfile", password_file};
  initdb.insert(initdb.end(), std::begin(kInitialOptions), std::end(kInitialOptions));
  initdb.insert(initdb.end(), options.begin(), options.end());
  RunToEnd(AsServer(std::move(initdb)), directory_ + "/initdb.log");
}

void PostgresCluster::MakeData() {
  namespace fs = std::filesystem;
  const size_t key = std::hash<std::string>()(
      absl::StrCat(ProgramDirectory(), kAdminPassword, absl::StrJoin(kInitialOptions, " ")));
  const fs::path kept = absl::StrCat(HULLD_BINARY_DIR, "/postgres_data_", key);
  const fs::path data = directory_ + "/data";
  if (fs::exists(kept)) {
    fs::copy(kept, data, fs::copy_options::recursive);
    GiveToServer(data);
    for (const auto& entry : fs::recursive_directory_iterator(data)) GiveToServer(entry.path());
    return;
  }
  InitializeData({});
  // Renamed atomically: another program may look for it concurrently. The first complete copy wins.
  const fs::path copy = absl::StrCat(kept.string(), ".", getpid());
  std::error_code error;
  fs::copy(data, copy, fs::copy_options::recursive, error);
  if (!error) fs::rename(copy, kept, error);
  if (error) fs::remove_all(copy, error);
}

PostgresCluster::PostgresCluster(const WalIn& wal) {
  MakeDirectory();
  if (wal.directory.empty()) {
    MakeData();
  } else {
    InitializeData({"--waldir", wal.directory, "--wal-segsize=1"});
  }
  Start();
  RunSql("postgres", absl::StrCat("CREATE ROLE hulld LOGIN PASSWORD '", kPassword, "'"));
}

PostgresCluster::PostgresCluster(const StandbyOf& standby) {
  MakeDirectory();
  Follow(standby.primary);
}

void PostgresCluster::Follow(PostgresCluster& primary) {
  std::filesystem::remove_all(directory_ + "/data");
  const std::string conninfo =
      absl::StrCat("host=", primary.directory_, " user=postgres password=", kAdminPassword,
                   " application_name=standby");
  RunToEnd(AsServer({ProgramDirectory() + "/pg_basebackup", "--pgdata", directory_ + "/data",
                     "--write-recovery-conf", "--wal-method", "stream", "--checkpoint", "fast",
                     "--no-sync", "--dbname", conninfo}),
           directory_ + "/basebackup.log");
  Start();
  // Set after the copy, which must not wait for a standby when promoted.
  primary.RunSql("postgres", "ALTER SYSTEM SET synchronous_standby_names = 'standby'");
  primary.RunSql("postgres", "SELECT pg_reload_conf()");
  const std::string is_followed = "SELECT 1 FROM pg_stat_replication WHERE sync_state = 'sync'";
  for (int attempt = 0; primary.RunSql("postgres", is_followed).empty(); ++attempt) {
    if (attempt == kMaxAttempts) Fail(Contents(directory_ + "/server.log"));
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
}

void PostgresCluster::Promote() {
  if (RunSql("postgres", "SELECT pg_promote()").front() != "t") Fail("the standby is not promoted");
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
                              "-c", "max_connections=200", "-c", "autovacuum=off", "-c",
                              "recovery_init_sync_method=syncfs"}),
                    log);
    int status = 0;
    while (waitpid(server_, &status, WNOHANG) == 0) {
      if (PQping(conninfo.c_str()) == PQPING_OK) return;
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
    // Processes of a killed server may still exist.
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

std::vector<pid_t> PostgresCluster::Children() const {
  std::ifstream children(absl::StrCat("/proc/", server_, "/task/", server_, "/children"));
  return {std::istream_iterator<pid_t>(children), {}};
}

void PostgresCluster::KillAll() {
  Suspend();
  for (const pid_t child : Children()) kill(child, SIGKILL);
  Kill();
}

void PostgresCluster::Suspend() {
  // Stops the parent first, so that it starts no more children.
  kill(server_, SIGSTOP);
  for (const pid_t child : Children()) kill(child, SIGSTOP);
}

void PostgresCluster::Resume() {
  for (const pid_t child : Children()) kill(child, SIGCONT);
  kill(server_, SIGCONT);
}

std::string PostgresCluster::MakeDatabase(const std::string& tablespace) {
  const std::string name = absl::StrCat("test_", ++databases_);
  RunSql("postgres",
         absl::StrCat("CREATE DATABASE ", name, " OWNER hulld TABLESPACE ", tablespace));
  return name;
}

std::shared_ptr<void> PostgresCluster::HoldTable(const std::string& database,
                                                 const std::string& table) const {
  const std::shared_ptr<PGconn> session(PQconnectdb(Conninfo(database).c_str()), PQfinish);
  const std::string lock = absl::StrCat("BEGIN; LOCK TABLE ", table, " IN ACCESS EXCLUSIVE MODE");
  PQclear(PQexec(session.get(), lock.c_str()));
  if (PQtransactionStatus(session.get()) != PQTRANS_INTRANS) Fail(PQerrorMessage(session.get()));
  return session;
}

std::string PostgresCluster::Conninfo(const std::string& database, const std::string& host) const {
  return absl::StrCat("host=", host.empty() ? directory_ : host, " dbname=", database,
                      " user=hulld password=", kPassword);
}

std::string PostgresCluster::WriteConninfo(const std::string& database, const std::string& host) {
  const std::string path = absl::StrCat(directory_, "/conninfo_", ++files_);
  const int fd = open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0600);
  const std::string text = Conninfo(database, host) + "\n";
  if (write(fd, text.data(), text.size()) != static_cast<ssize_t>(text.size())) Fail(path);
  close(fd);
  return path;
}

std::vector<std::string> PostgresCluster::RunSql(const std::string& database,
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
