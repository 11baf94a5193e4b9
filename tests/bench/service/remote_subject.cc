#include "tests/bench/service/remote_subject.h"

#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <utility>

#include "tests/bench/queries/query_sets.h"

namespace hulld::bench {
namespace {

ClientOptions OptionsFor(const std::string& address) {
  ClientOptions options;
  options.server = address;
  return options;
}

}  // namespace

RemoteSubject::RemoteSubject(std::string name, std::string transport,
                             std::vector<std::string> command)
    : name_(std::move(name)),
      transport_(std::move(transport)),
      server_(std::move(command)),
      client_(OptionsFor(server_.address())) {}

double RemoteSubject::ProcessorSeconds() const {
  // Nanoseconds by thread; the times of the whole process come in steps of 10 ms.
  double seconds = 0;
  const std::string tasks = "/proc/" + std::to_string(server_.pid()) + "/task";
  for (const auto& task : std::filesystem::directory_iterator(tasks)) {
    std::ifstream file(task.path() / "schedstat");
    double nanoseconds = 0;
    if (file >> nanoseconds) seconds += 1e-9 * nanoseconds;
  }
  return seconds;
}

v1::CollisionService::Stub& RemoteSubject::stub(size_t i) {
  while (stubs_.size() <= i) {
    grpc::ChannelArguments arguments;
    arguments.SetMaxReceiveMessageSize(-1);
    arguments.SetInt(GRPC_ARG_ENABLE_HTTP_PROXY, 0);
    // Otherwise channels to one address share a connection.
    arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
    stubs_.push_back(v1::CollisionService::NewStub(grpc::CreateCustomChannel(
        server_.address(), grpc::InsecureChannelCredentials(), arguments)));
  }
  return *stubs_[i];
}

std::string Ur5Id(size_t hull) { return "ur5/" + std::to_string(hull); }

void PutUr5(RemoteSubject& subject) {
  if (subject.is_floor() || subject.client().GetHull(Ur5Id(0)).ok()) return;
  const QuerySet set = MakeQuerySet("ur5", Regime::kFar, 0);
  for (size_t i = 0; i < set.hulls.size(); ++i) {
    AppendOptions options;
    options.create_if_absent = true;
    auto appender = subject.client().OpenAppend(Ur5Id(i), options);
    CheckOk(appender.status(), "opening an append");
    v1::PointBlock block;
    for (const Vector& p : set.hulls[i].vertices())
      block.mutable_xyz()->Add(p.data(), p.data() + 3);
    CheckOk((*appender)->Append(std::move(block)), "appending");
    CheckOk((*appender)->Finish(), "appending");
  }
}

void CheckOk(const absl::Status& status, const std::string& what) {
  if (status.ok()) return;
  std::fprintf(stderr, "remote_benchmark: %s: %s\n", what.c_str(), status.ToString().c_str());
  std::exit(1);
}

void CheckOk(const grpc::Status& status, const std::string& what) {
  CheckOk(absl::Status(static_cast<absl::StatusCode>(status.error_code()),
                       std::string(status.error_message())),
          what);
}

}  // namespace hulld::bench
