#ifndef HULLD_TESTS_FUZZ_SERVICE_SERVICE_FUZZ_H_
#define HULLD_TESTS_FUZZ_SERVICE_SERVICE_FUZZ_H_

#include <grpcpp/generic/generic_stub.h>
#include <grpcpp/grpcpp.h>

#include <cstdint>
#include <map>
#include <memory>
#include <span>
#include <string>

#include "hulld/v1/body.grpc.pb.h"
#include "hulld/v1/collision.grpc.pb.h"
#include "hulld/v1/hull.grpc.pb.h"
#include "hulld/v1/maintenance.grpc.pb.h"
#include "hulld/v1/status.grpc.pb.h"
#include "server/server.h"

namespace hulld::fuzz {

// An in-process server with small limits, behind a unix socket, that runs programs of calls.
class ServiceFuzz {
 public:
  // store: "memory" or "rocksdb" in a temporary directory. Aborts if the server does not start.
  explicit ServiceFuzz(const std::string& store);
  ~ServiceFuzz();

  // Decodes the bytes into a program of calls, of every RPC and kind: unary, streams in either
  // direction that are cancelled, half-closed early, or never read, expired deadlines, and
  // malformed messages. Runs it on the server with a few initial hulls. Returns the first violation
  // of the API contract, or empty. Checks: each call ends with a listed status, replies are
  // consistent (reply_check.h), certificates prove their relations, answers of streams and scenes
  // equal a batch's, answers about a body follow from its pieces, hulls that the program cannot
  // name are unchanged, all hulls equal their acknowledged states, and no call outlives the
  // program. After some programs a durable store, or a backup of it, is reopened: every hull, its
  // mesh, and its writer's sequence are unchanged.
  std::string Run(std::span<const uint8_t> program);

  // Coverage counts of all programs so far: "CreateHull OK", "CreateHull ALREADY_EXISTS",
  // "--max-hulls", ...
  const std::map<std::string, int>& reached() const { return reached_; }

 private:
  friend class ServiceProgram;

  void Start();
  void Stop();
  std::string Prepare();
  std::string Reopen();
  // Returns all hulls, including the guards.
  std::map<std::string, v1::HullInfo> Hulls();
  // Returns everything that readers can see of them, as text.
  std::map<std::string, std::string> Contents();

  const std::string store_;
  std::string directory_;
  int opened_ = 0;
  int programs_ = 0;
  std::string data_dir_;
  std::unique_ptr<server::Server> server_;
  std::shared_ptr<grpc::Channel> channel_;
  std::unique_ptr<v1::HullService::Stub> hulls_;
  std::unique_ptr<v1::BodyService::Stub> bodies_;
  std::unique_ptr<v1::CollisionService::Stub> collisions_;
  std::unique_ptr<v1::StatusService::Stub> status_;
  std::unique_ptr<v1::MaintenanceService::Stub> maintenance_;
  std::unique_ptr<grpc::GenericStub> generic_;
  std::map<std::string, int> reached_;
  // The store ID required in every reply, and the last revision seen.
  std::string store_id_;
  uint64_t revision_ = 0;
};

}  // namespace hulld::fuzz

#endif  // HULLD_TESTS_FUZZ_SERVICE_SERVICE_FUZZ_H_
