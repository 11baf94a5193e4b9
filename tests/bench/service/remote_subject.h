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

// A measured server, over one transport.
class RemoteSubject {
 public:
  // name: "hulld" or "floor". transport: "tcp" or "unix". command: the program and its arguments.
  RemoteSubject(std::string name, std::string transport, std::vector<std::string> command);

  const std::string& name() const { return name_; }
  const std::string& transport() const { return transport_; }
  bool is_floor() const { return name_ == "floor"; }
  // Returns the processor time of the running threads of its process so far, in seconds.
  double ProcessorSeconds() const;

  const Client& client() const { return client_; }
  // Returns stub i; each has a separate connection.
  v1::CollisionService::Stub& stub(size_t i);

 private:
  const std::string name_;
  const std::string transport_;
  ChildServer server_;
  Client client_;
  std::vector<std::unique_ptr<v1::CollisionService::Stub>> stubs_;
};

// Result of a round of a workload.
struct Sample {
  // In the workload's unit: calls, pairs, points, updates.
  double per_second = 0;
  // The time of a call; 0: not measured.
  double p50_us = 0;
  double p99_us = 0;
  // The server's processor time per unit, set by the code that runs the workload.
  double server_cpu_us = 0;
};

struct RemoteWorkload {
  // For example "check 8 clients".
  std::string name;
  std::string unit;
  // Measures one round.
  std::function<Sample(RemoteSubject&)> run;
  // Does the same work with core in this process; may be empty.
  std::function<Sample()> run_in_process = nullptr;
  // Like run_in_process, but places the hulls each time at the poses of the request; empty if
  // run_in_process does that, or nothing needs placing.
  std::function<Sample()> run_placing = nullptr;
};

// Return the workloads; hulls are created on hulld when first needed. `seconds`: the duration of a
// round, for workloads of variable duration.
std::vector<RemoteWorkload> MakeCheckWorkloads(double seconds);
std::vector<RemoteWorkload> MakeBatchWorkloads(double seconds);
std::vector<RemoteWorkload> MakeStreamWorkloads(double seconds);
std::vector<RemoteWorkload> MakeSceneWorkloads(double seconds);
std::vector<RemoteWorkload> MakeIngestWorkloads();

// Creates the UR5's hulls as "ur5/0", "ur5/1" ..., unless they exist.
void PutUr5(RemoteSubject& subject);
std::string Ur5Id(size_t hull);

// Ends the program with an error unless the status is OK.
void CheckOk(const absl::Status& status, const std::string& what);
void CheckOk(const grpc::Status& status, const std::string& what);

}  // namespace hulld::bench

#endif  // HULLD_TESTS_BENCH_SERVICE_REMOTE_SUBJECT_H_
