#ifndef HULLD_TESTS_BENCH_SERVICE_REMOTE_SUBJECT_H_
#define HULLD_TESTS_BENCH_SERVICE_REMOTE_SUBJECT_H_

#include <grpcpp/grpcpp.h>

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "client/client.h"
#include "hulld/v1/collision.grpc.pb.h"
#include "tests/bench/service/child_server.h"

namespace hulld::bench {

// A server under measurement, over one transport.
class RemoteSubject {
 public:
  // name: "hulld" or "floor". transport: "tcp" or "unix". command: the program and its arguments.
  RemoteSubject(std::string name, std::string transport, std::vector<std::string> command);

  const std::string& name() const { return name_; }
  const std::string& transport() const { return transport_; }
  bool is_floor() const { return name_ == "floor"; }
  // What the running threads of its process have used so far, in seconds of processor time.
  double ProcessorSeconds() const;

  const Client& client() const { return client_; }
  // The stub of connection i, each of which is a connection of its own.
  v1::CollisionService::Stub& stub(size_t i);

 private:
  const std::string name_;
  const std::string transport_;
  ChildServer server_;
  Client client_;
  std::vector<std::unique_ptr<v1::CollisionService::Stub>> stubs_;
};

// What one round of a workload saw.
struct Sample {
  // In the workload's unit: calls, pairs, points, updates.
  double per_second = 0;
  // The time of one call; 0: not measured.
  double p50_us = 0;
  double p99_us = 0;
  // The server's processor time per unit, filled in by the code that runs the workload.
  double server_cpu_us = 0;
};

struct RemoteWorkload {
  // As in "check 8 clients".
  std::string name;
  std::string unit;
  // Measures one round.
  std::function<Sample(RemoteSubject&)> run;
  // The same work by core in this process; may be empty.
  std::function<Sample()> run_in_process = nullptr;
  // The same with hulls that are placed each time, at the poses that the request holds; empty where
  // run_in_process does that, or nothing needs to be placed anew.
  std::function<Sample()> run_placing = nullptr;
};

// The workloads; hulls are created on hulld when first needed. `seconds`: how long one round takes,
// for those that can take any time.
std::vector<RemoteWorkload> MakeCheckWorkloads(double seconds);
std::vector<RemoteWorkload> MakeBatchWorkloads(double seconds);
std::vector<RemoteWorkload> MakeStreamWorkloads(double seconds);
std::vector<RemoteWorkload> MakeSceneWorkloads(double seconds);
std::vector<RemoteWorkload> MakeIngestWorkloads();

// The UR5's hulls under "ur5/0", "ur5/1" ..., unless they are there.
void PutUr5(RemoteSubject& subject);
std::string Ur5Id(size_t hull);

// Ends the program with an error unless the status is OK.
void CheckOk(const absl::Status& status, const std::string& what);
void CheckOk(const grpc::Status& status, const std::string& what);

}  // namespace hulld::bench

#endif  // HULLD_TESTS_BENCH_SERVICE_REMOTE_SUBJECT_H_
