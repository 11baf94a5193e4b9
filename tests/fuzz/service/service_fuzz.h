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

// A server with small limits, in this process, behind a unix socket, and programs of calls that
// are run on it.
class ServiceFuzz {
 public:
  // store: "memory" or "rocksdb", which is kept in a temporary directory. Aborts when no server can
  // be started.
  explicit ServiceFuzz(const std::string& store);
  ~ServiceFuzz();

  // Reads the bytes as a program of calls, of every RPC and kind: unary, streams in either
  // direction that are cancelled, half-closed early or never read, deadlines that have passed, and
  // bytes that are no message. Runs it on the server with a few hulls as they are at first. What is
  // wrong with any reply by the contract, or nothing: each call ends with a status that its
  // contract lists, replies are consistent (reply_check.h), certificates prove what they are for,
  // answers from a stream or a scene are those of a batch, those about a body follow from those
  // about its pieces, hulls that the program cannot name stay
  // as they were, the others are as acknowledged, and no call outlives the program. After some
  // programs a durable store is opened again, itself or a backup of it: every hull, its mesh and
  // its writer's sequence are then as before.
  std::string Run(std::span<const uint8_t> program);

  // How often what was reached in all programs so far: "CreateHull OK", "CreateHull
  // ALREADY_EXISTS", "--max-hulls" and so on.
  const std::map<std::string, int>& reached() const { return reached_; }

 private:
  friend class ServiceProgram;

  void Start();
  void Stop();
  std::string Prepare();
  std::string Reopen();
  // All hulls, the guards too.
  std::map<std::string, v1::HullInfo> Hulls();
  // All that readers can see of them, in words of its own.
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
  // What every reply must carry, and the last revision seen.
  std::string store_id_;
  uint64_t revision_ = 0;
};

}  // namespace hulld::fuzz

#endif  // HULLD_TESTS_FUZZ_SERVICE_SERVICE_FUZZ_H_
