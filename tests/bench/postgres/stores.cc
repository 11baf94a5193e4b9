#include "tests/bench/postgres/stores.h"

#include <sys/stat.h>

#include <filesystem>
#include <fstream>
#include <initializer_list>
#include <vector>

#include "hulld/v1/hull.grpc.pb.h"
#include "tests/bench/service/ball_hull.h"
#include "tests/bench/service/growing_writer.h"

namespace hulld::bench {

Stores::Stores(const Arguments& arguments) : arguments_(arguments) {
  std::filesystem::create_directories(arguments.folder);
}

std::string Stores::Conninfo(const std::string& database) const {
  return arguments_.database + " dbname=" + database;
}

void Stores::Make(const std::string& database) const {
  const std::string admin = Conninfo("postgres");
  RunSql(admin, "DROP DATABASE IF EXISTS " + database + " WITH (FORCE)");
  RunSql(admin, "CREATE DATABASE " + database);
}

std::unique_ptr<ChildServer> Stores::Start(const std::string& kind, const std::string& name) const {
  std::vector<std::string> command = {
      arguments_.hulld, "--listen",    "127.0.0.1:0", "--max-hulls",
      "100000000",      "--log-level", "info",        "--max-streams-per-client",
      "100000"};
  const auto add = [&](std::initializer_list<std::string> more) {
    command.insert(command.end(), more);
  };
  if (kind == "rocksdb") {
    add({"--data-dir", arguments_.folder + "/" + name});
    return std::make_unique<ChildServer>(command);
  }
  const std::string conninfo = arguments_.folder + "/" + name + ".conninfo";
  std::ofstream(conninfo) << Conninfo(name) << "\n";
  chmod(conninfo.c_str(), 0600);
  add({"--store", "postgres", "--postgres-servers", kind, "--postgres-conninfo-file", conninfo});
  return std::make_unique<ChildServer>(command);
}

std::unique_ptr<ChildServer> Stores::StartEmpty(const std::string& kind,
                                                const std::string& name) const {
  if (kind == "rocksdb") {
    std::filesystem::remove_all(arguments_.folder + "/" + name);
  } else {
    Make(name);
  }
  return Start(kind, name);
}

std::unique_ptr<ChildServer> Stores::StartFloor() const {
  return std::make_unique<ChildServer>(
      std::vector<std::string>{HULLD_FLOOR_PROGRAM, "127.0.0.1:0"});
}

std::unique_ptr<LibpqFloor> Stores::MakeLibpqFloor(const std::string& kind,
                                                   const std::string& database) const {
  {
    const std::unique_ptr<ChildServer> server = StartEmpty(kind, database);
    const auto channel = ConnectAlone(server->address());
    MakeBallHull(*v1::HullService::NewStub(channel), kGrowingHull, kVertices, 1);
    GrowingWriter writer(channel, kGrowingHull, "bench");
    for (int i = 0; i < 5; ++i) writer.SendAndReceive();
  }
  return std::make_unique<LibpqFloor>(Conninfo(database), kGrowingHull, kind == "many");
}

}  // namespace hulld::bench
