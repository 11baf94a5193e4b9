// Memory that callers can make the server allocate, before and after they are authenticated.

#include <gmock/gmock.h>
#include <grpcpp/grpcpp.h>
#include <grpcpp/impl/codegen/client_callback.h>
#include <grpcpp/support/byte_buffer.h>
#include <gtest/gtest.h>

#include <cstdio>
#include <filesystem>
#include <fstream>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "grpc/reflection/v1alpha/reflection.grpc.pb.h"
#include "hulld/v1/collision.grpc.pb.h"
#include "server/settings/config.h"
#include "tests/server/harness/hulld_process.h"
#include "tests/server/harness/test_certificates.h"

namespace hulld::server {
namespace hostile_request_test {

#ifdef HULLD_SANITIZED
constexpr bool kKeepsWhatWasFreed = true;
#else
constexpr bool kKeepsWhatWasFreed = false;
#endif

// Returns a field of /proc/PID/status, in KiB.
long StatusField(pid_t pid, const std::string& name) {
  std::ifstream file("/proc/" + std::to_string(pid) + "/status");
  std::string line;
  while (std::getline(file, line)) {
    if (line.starts_with(name + ":")) return std::stol(line.substr(name.size() + 1));
  }
  ADD_FAILURE() << "no " << name;
  return 0;
}

// Empty placements, two bytes each: parsed, they take forty times as much.
grpc::ByteBuffer EmptyPlacements() {
  std::string bytes;
  while (bytes.size() < (16u << 20) - 64) bytes.append("\x0a\x00", 2);
  const grpc::Slice slice(bytes);
  return grpc::ByteBuffer(&slice, 1);
}

// Sends the bytes as a batch over a separate connection; returns its status.
grpc::StatusCode SendBatch(const std::string& address, const grpc::ByteBuffer& request) {
  grpc::ChannelArguments arguments;
  arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
  const auto channel =
      grpc::CreateCustomChannel(address, grpc::InsecureChannelCredentials(), arguments);
  const grpc::internal::RpcMethod method("/hulld.v1.CollisionService/BatchCheckCollisions",
                                         grpc::internal::RpcMethod::SERVER_STREAMING, channel);
  grpc::ClientContext context;
  const std::unique_ptr<grpc::ClientReader<v1::BatchCheckCollisionsResponse>> reader(
      grpc::internal::ClientReaderFactory<v1::BatchCheckCollisionsResponse>::Create(
          channel.get(), method, &context, request));
  v1::BatchCheckCollisionsResponse response;
  while (reader->Read(&response)) {
  }
  return reader->Finish().error_code();
}

class HostileRequest : public ::testing::Test {
 protected:
  // Many concurrent callers: limits the server's peak memory above its idle memory.
  static void ExpectLittleMemory(const std::vector<std::string>& settings,
                                 grpc::StatusCode expected) {
    if (kKeepsWhatWasFreed) GTEST_SKIP() << "AddressSanitizer retains freed memory";
    constexpr int kCallers = 64;
    std::vector<std::string> arguments = {"--store",     "memory",       "--listen",
                                          "127.0.0.1:0", "--log-format", "json"};
    arguments.insert(arguments.end(), settings.begin(), settings.end());
    Process hulld(arguments);
    const std::string address = AddressIn(hulld.ReadLineWith("listening on "));
    const grpc::ByteBuffer request = EmptyPlacements();
    const long before = StatusField(hulld.pid(), "VmRSS");
    std::vector<std::thread> callers;
    for (int i = 0; i < kCallers; ++i) {
      callers.emplace_back([&] {
        const grpc::StatusCode code = SendBatch(address, request);
        // gRPC itself ends calls if it has no memory for their messages.
        EXPECT_TRUE(code == expected || code == grpc::RESOURCE_EXHAUSTED ||
                    code == grpc::UNAVAILABLE)
            << code;
      });
    }
    for (std::thread& caller : callers) caller.join();
    const long peak = (StatusField(hulld.pid(), "VmHWM") - before) >> 10;
    std::printf("%d callers took %ld MiB\n", kCallers, peak);
    EXPECT_LT(peak, 300);
  }
};

TEST_F(HostileRequest, CallersWithoutATokenUseLittleMemory) {
  std::string pattern = ::testing::TempDir() + "/hulld_hostile_XXXXXX";
  ASSERT_NE(mkdtemp(pattern.data()), nullptr);
  WriteSecret(pattern + "/tokens", "robot read-only * sha256:" + std::string(64, '0') + "\n");
  ExpectLittleMemory({"--tokens-file", pattern + "/tokens"}, grpc::UNAUTHENTICATED);
  std::filesystem::remove_all(pattern);
}

TEST_F(HostileRequest, AuthorizedCallersUseLittleMemory) {
  ExpectLittleMemory({}, grpc::RESOURCE_EXHAUSTED);
}

// Regression test: gRPC's own reflection service used a thread per stream, without a token.
TEST_F(HostileRequest, IdleReflectionStreamsOccupyNoThreads) {
  using grpc::reflection::v1alpha::ServerReflection;
  using grpc::reflection::v1alpha::ServerReflectionRequest;
  using grpc::reflection::v1alpha::ServerReflectionResponse;
  // Below the limit of one connection.
  constexpr int kStreams = 80;
  Process hulld({"--store", "memory", "--listen", "127.0.0.1:0", "--log-format", "json",
                 "--max-anonymous-calls", std::to_string(kStreams * Limits::kAnonymousShare)});
  const auto stub = ServerReflection::NewStub(grpc::CreateChannel(
      AddressIn(hulld.ReadLineWith("listening on ")), grpc::InsecureChannelCredentials()));
  struct Stream {
    grpc::ClientContext context;
    std::unique_ptr<grpc::ClientReaderWriter<ServerReflectionRequest, ServerReflectionResponse>>
        call;
  };
  const auto open = [&stub](Stream& stream) {
    stream.call = stub->ServerReflectionInfo(&stream.context);
    ServerReflectionRequest request;
    request.set_file_containing_symbol("hulld.v1.HullService.GetHull");
    ServerReflectionResponse response;
    if (!stream.call->Write(request) || !stream.call->Read(&response)) return 0;
    return response.file_descriptor_response().file_descriptor_proto_size();
  };
  std::vector<std::unique_ptr<Stream>> streams;
  streams.push_back(std::make_unique<Stream>());
  // hull.proto and its dependencies: geometry.proto, freshness.proto, and Duration.
  constexpr int kFiles = 4;
  EXPECT_EQ(open(*streams.back()), kFiles);
  const long before = StatusField(hulld.pid(), "Threads");
  while (streams.size() < kStreams) {
    streams.push_back(std::make_unique<Stream>());
    EXPECT_EQ(open(*streams.back()), kFiles);
  }
  EXPECT_LT(StatusField(hulld.pid(), "Threads") - before, 20);
  Stream one_more;
  EXPECT_EQ(open(one_more), 0);
  EXPECT_EQ(one_more.call->Finish().error_code(), grpc::RESOURCE_EXHAUSTED);
  for (const auto& stream : streams) stream->context.TryCancel();
}

}  // namespace hostile_request_test
}  // namespace hulld::server
