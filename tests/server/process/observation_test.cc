// Observability: metrics, request IDs, log lines, health.

#include <absl/strings/str_cat.h>
#include <arpa/inet.h>
#include <gmock/gmock.h>
#include <grpcpp/generic/generic_stub.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <prometheus/text_serializer.h>
#include <sys/socket.h>
#include <unistd.h>

#include <chrono>
#include <future>
#include <memory>
#include <optional>
#include <set>
#include <sstream>
#include <string>
#include <thread>

#include "server/process/log.h"
#include "tests/server/harness/captured_log.h"
#include "tests/server/harness/test_server.h"

namespace hulld::server {
namespace observation_test {

using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::StartsWith;

// Returns a connection to "127.0.0.1:port", or -1.
int Connect(const std::string& address) {
  const int fd = socket(AF_INET, SOCK_STREAM, 0);
  sockaddr_in name = {};
  name.sin_family = AF_INET;
  name.sin_port = htons(static_cast<uint16_t>(std::stoi(address.substr(address.find(':') + 1))));
  name.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  if (connect(fd, reinterpret_cast<const sockaddr*>(&name), sizeof name) == 0) return fd;
  close(fd);
  return -1;
}

// Sends these bytes to "127.0.0.1:port" and returns the reply, up to the close by the server.
std::string HttpReply(const std::string& address, const std::string& request) {
  const int fd = Connect(address);
  std::string reply;
  EXPECT_EQ(send(fd, request.data(), request.size(), MSG_NOSIGNAL),
            static_cast<ssize_t>(request.size()));
  char buffer[4096];
  for (ssize_t n = 0; (n = recv(fd, buffer, sizeof buffer, 0)) > 0;) reply.append(buffer, n);
  close(fd);
  return reply;
}

v1::CheckCollisionRequest PairRequest(const std::string& a, const std::string& b, double x) {
  v1::CheckCollisionRequest request;
  *request.mutable_a() = PlacementOf(a);
  *request.mutable_b() = PlacementOf(b, x);
  return request;
}

class Observation : public ServerTest {
 protected:
  std::string Metrics() const {
    return prometheus::TextSerializer().Serialize(server_->metrics().Collect());
  }

  // Returns the value of one series in Prometheus notation; -1 if missing.
  double Metric(const std::string& series) const { return ValueIn(Metrics(), series); }

  // Like Metric, but in these metrics: values that must agree come from one collection.
  static double ValueIn(const std::string& metrics, const std::string& series) {
    std::istringstream lines(metrics);
    for (std::string line; std::getline(lines, line);) {
      if (line.starts_with(series + " ")) return std::stod(line.substr(series.size() + 1));
    }
    return -1;
  }
};

TEST_F(Observation, MetricsAreServedOverHttpOnlyOnLoopback) {
  EXPECT_EQ(server_->metrics_address(), "");
  Config config = TestConfig();
  config.metrics_address = "127.0.0.1:0";
  Restart(config);
  const std::string reply = HttpReply(server_->metrics_address(), "GET /metrics HTTP/1.0\r\n\r\n");
  EXPECT_THAT(reply, StartsWith("HTTP/1.1 200"));
  EXPECT_THAT(reply, HasSubstr("Content-Type: text/plain; version=0.0.4; charset=utf-8\r\n"));
  EXPECT_THAT(reply, HasSubstr("\nhulld_build_info{"));
  EXPECT_THAT(reply, HasSubstr("version=\"" HULLD_VERSION "\"} 1"));
  EXPECT_THAT(reply, HasSubstr("\nhulld_requests_running{rpc=\"GetHull\"} 0"));
  EXPECT_THAT(reply, HasSubstr("\nprocess_resident_memory_bytes "));
  EXPECT_THAT(reply, HasSubstr("\nhulld_queue_tasks{pool=\"readers\"} 0"));

  config.metrics_address = "0.0.0.0:0";
  config.listen = "127.0.0.1:0";
  const absl::Status exposed = Server::Start(config).status();
  EXPECT_EQ(exposed.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(exposed.message()), HasSubstr("--metrics-insecure"));
  config.metrics_insecure = true;
  EXPECT_TRUE(Server::Start(config).ok());
  config.metrics_address = server_->metrics_address();
  const absl::Status taken = Server::Start(config).status();
  EXPECT_EQ(taken.code(), absl::StatusCode::kUnavailable);
  EXPECT_THAT(std::string(taken.message()), HasSubstr("--metrics-address"));
  config.metrics_address = "9551";
  EXPECT_THAT(std::string(Server::Start(config).status().message()),
              HasSubstr("--metrics-address is \"9551\""));
}

TEST_F(Observation, TheMetricsEndpointServesNothingElse) {
  Config config = TestConfig();
  config.metrics_address = "127.0.0.1:0";
  Restart(config);
  const auto reply = [this](const std::string& request) {
    return HttpReply(server_->metrics_address(), request);
  };
  const std::string end = "\r\nConnection: close\r\n\r\n";
  EXPECT_THAT(reply("GET / HTTP/1.1\r\nHost: h" + end), StartsWith("HTTP/1.1 404"));
  EXPECT_THAT(reply("GET /metrics/../etc/ HTTP/1.1\r\nHost: h" + end), StartsWith("HTTP/1.1 404"));
  EXPECT_THAT(reply("GET /metrics?x=1 HTTP/1.1\r\nHost: h" + end), StartsWith("HTTP/1.1 200"));
  EXPECT_THAT(reply("POST /metrics HTTP/1.1\r\nHost: h\r\nContent-Length: 0" + end),
              StartsWith("HTTP/1.1 405"));
  const std::string head = reply("HEAD /metrics HTTP/1.1\r\nHost: h" + end);
  EXPECT_THAT(head, StartsWith("HTTP/1.1 200"));
  EXPECT_TRUE(head.ends_with("\r\n\r\n"));
  EXPECT_THAT(reply("GET http://host:9090/metrics HTTP/1.1\r\nHost: h" + end),
              StartsWith("HTTP/1.1 200"));
  EXPECT_THAT(reply("GET http://host HTTP/1.1\r\nHost: h" + end), StartsWith("HTTP/1.1 404"));
  // A body ends the connection, so it is never taken for a request.
  const std::string body = "GET /metrics HTTP/1.1\r\n\r\n";
  const std::string with_body =
      reply("POST /metrics HTTP/1.1\r\nContent-Length: " + std::to_string(body.size()) +
            "\r\n\r\n" + body);
  EXPECT_THAT(with_body, StartsWith("HTTP/1.1 405"));
  EXPECT_THAT(with_body, Not(HasSubstr("200 OK")));
  EXPECT_THAT(
      reply("POST /metrics HTTP/1.1\r\nTransfer-Encoding: chunked\r\n\r\n1\r\nx\r\n0\r\n\r\n"),
      StartsWith("HTTP/1.1 405"));
  // Malformed HTTP, and an unterminated header.
  EXPECT_EQ(reply("GET /metrics HTTP/1.1\r\nX: " + std::string(9000, 'x')), "");
  EXPECT_THAT(reply("\x16\x03\x01 hello\r\n\r\n"), StartsWith("HTTP/1.1 400"));
  // Two requests of one connection.
  const std::string two =
      reply("GET /metrics HTTP/1.1\r\nHost: h\r\n\r\nGET /none HTTP/1.1\r\nHost: h" + end);
  EXPECT_THAT(two, StartsWith("HTTP/1.1 200"));
  EXPECT_THAT(two, HasSubstr("HTTP/1.1 404"));
}

// Clients that send half a request delay no other, even if there are more than the endpoint keeps.
TEST_F(Observation, ASilentConnectionDoesNotDelayTheMetrics) {
  Config config = TestConfig();
  config.metrics_address = "127.0.0.1:0";
  Restart(config);
  std::vector<int> silent;
  for (int i = 0; i < 200; ++i) {
    silent.push_back(Connect(server_->metrics_address()));
    EXPECT_EQ(send(silent.back(), "GET /me", 7, MSG_NOSIGNAL), 7);
  }
  EXPECT_THAT(HttpReply(server_->metrics_address(), "GET /metrics HTTP/1.0\r\n\r\n"),
              StartsWith("HTTP/1.1 200"));
  for (const int descriptor : silent) close(descriptor);
}

TEST_F(Observation, OpenAndRunningCallsAreShown) {
  Put("a", Cube());
  ASSERT_TRUE(server_->WaitIdle(std::chrono::minutes(5)));
  EXPECT_EQ(Metric("hulld_connections"), 1);
  EXPECT_GT(Metric("process_open_fds"), 5);
  EXPECT_GT(Metric("process_max_fds"), Metric("process_open_fds"));
  const double before = Metric("process_open_fds");
  {
    Appender open(*hulls_, "a", "w");
    ASSERT_TRUE(open.is_open());
    EXPECT_EQ(Metric("hulld_requests_running{rpc=\"AppendPoints\"}"), 1);
    EXPECT_EQ(Metric("hulld_requests_running{rpc=\"GetHull\"}"), 0);
    ASSERT_TRUE(open.Finish().ok());
  }
  ASSERT_TRUE(server_->WaitIdle(std::chrono::minutes(5)));
  EXPECT_EQ(Metric("hulld_requests_running{rpc=\"AppendPoints\"}"), 0);
  const std::string address = server_->address();
  const int another = Connect(address);
  // Both ends are in this process. Bounded by the test's time limit only.
  while (Metric("hulld_connections") != 2) std::this_thread::yield();
  EXPECT_GE(Metric("process_open_fds"), before + 2);
  close(another);
  while (Metric("hulld_connections") != 1) std::this_thread::yield();
  // This store has nothing on disk.
  EXPECT_EQ(Metric("hulld_store_disk_bytes"), 0);
  EXPECT_EQ(Metric("hulld_snapshot_duration_seconds_count"), 0);
  Get("a");
  EXPECT_EQ(Metric("hulld_snapshot_duration_seconds_count"), 1);
}

TEST_F(Observation, TokensAreCountedByNameUpToALimit) {
  server::Metrics metrics;
  metrics.CountToken("");
  for (size_t i = 0; i < server::Metrics::kMaxTokens + 7; ++i)
    metrics.CountToken("t" + std::to_string(i));
  metrics.CountToken("t0");
  const std::string text = prometheus::TextSerializer().Serialize(metrics.Collect());
  EXPECT_THAT(text, HasSubstr("hulld_token_requests_total{token=\"t0\"} 2\n"));
  EXPECT_THAT(text, HasSubstr("hulld_token_requests_total{token=\"t99\"} 1\n"));
  EXPECT_THAT(text, HasSubstr("hulld_token_requests_total{token=\"other\"} 7\n"));
  EXPECT_THAT(text, Not(HasSubstr("token=\"t100\"")));
}

TEST_F(Observation, AuthenticationFailuresAreCountedFromZero) {
  const server::Metrics metrics;
  const std::string text = prometheus::TextSerializer().Serialize(metrics.Collect());
  for (const char* reason : {"unauthenticated", "permission_denied"}) {
    EXPECT_THAT(text,
                HasSubstr(absl::StrCat("hulld_auth_failures_total{reason=\"", reason, "\"} 0\n")));
  }
}

TEST_F(Observation, CallsPointsHullsAndPairsAreCounted) {
  Create("a");
  {
    Appender appender(*hulls_, "a", "w");
    Coordinates points = Cube();
    const Coordinates again = Cube();
    points.insert(points.end(), again.begin(), again.end());
    points.insert(points.end(), {0.5, 0.5, 0.5});
    ASSERT_TRUE(appender.Append(1, points).has_value());
    ASSERT_TRUE(appender.Finish().ok());
  }
  Check(PairRequest("a", "a", 50));
  Check(PairRequest("a", "a", 1));
  CheckError(PairRequest("a", "none", 0));
  EXPECT_EQ(Metric("hulld_points_received_total"), 17);
  EXPECT_EQ(Metric("hulld_points_kept_total"), 8);
  EXPECT_EQ(Metric("hulld_points_duplicate_total"), 8);
  EXPECT_EQ(Metric("hulld_points_inside_total"), 1);
  EXPECT_EQ(Metric("hulld_hulls"), 1);
  EXPECT_EQ(Metric("hulld_vertices"), 8);
  EXPECT_GT(Metric("hulld_registry_lock_hold_max_seconds"), 0);
  EXPECT_EQ(Metric("hulld_requests_total{code=\"OK\",rpc=\"CreateHull\"}"), 1);
  EXPECT_EQ(Metric("hulld_requests_total{code=\"OK\",rpc=\"CheckCollision\"}"), 2);
  EXPECT_EQ(Metric("hulld_requests_total{code=\"NOT_FOUND\",rpc=\"CheckCollision\"}"), 1);
  EXPECT_EQ(Metric("hulld_request_duration_seconds_count{rpc=\"CheckCollision\"}"), 3);
  EXPECT_EQ(Metric("hulld_message_duration_seconds_count{rpc=\"AppendPoints\"}"), 1);
  // Far apart: decided by their spheres. Sharing a facet: decided by exact arithmetic only.
  EXPECT_EQ(Metric("hulld_pairs_total{rung=\"bounds\"}"), 1);
  EXPECT_EQ(Metric("hulld_pairs_total{rung=\"exact\"}"), 1);
  EXPECT_EQ(Metric("hulld_exact_fallbacks_total"), 1);
  // None of these calls waits; building the canonical snapshot is not a job for gRPC's thread.
  EXPECT_EQ(Metric("hulld_queue_wait_seconds_count{pool=\"readers\"}"), 0);
  Get("a");
  EXPECT_EQ(Metric("hulld_queue_wait_seconds_count{pool=\"readers\"}"), 1);
  EXPECT_EQ(Metric("hulld_queue_tasks{pool=\"preparers\"}"), 0);
}

TEST_F(Observation, TheStoreAndItsCacheReport) {
  Put("a", Cube());
  Check(PairRequest("a", "a", 50));
  Check(PairRequest("a", "a", 50));
  EXPECT_EQ(Metric("hulld_store_commit_duration_seconds_count"), 2);
  EXPECT_EQ(Metric("hulld_store_commit_changes_sum"), 2);
  EXPECT_EQ(Metric("hulld_store_failures_total{operation=\"write\"}"), 0);
  EXPECT_EQ(Metric("hulld_store_read_only"), 0);
  // The writer left it in memory.
  EXPECT_EQ(Metric("hulld_cache_lookups_total{result=\"miss\"}"), 0);
  EXPECT_GE(Metric("hulld_cache_lookups_total{result=\"hit\"}"), 2);
  EXPECT_GT(Metric("hulld_cache_bytes"), 0);
  EXPECT_GT(Metric("hulld_cache_limit_bytes"), Metric("hulld_cache_bytes"));
}

TEST_F(Observation, ReaderAndWriterMemoryAreReportedSeparately) {
  Put("a", Cube());
  EXPECT_EQ(Metric("hulld_cache_reading_bytes"), 0);
  EXPECT_GT(Metric("hulld_cache_writing_bytes"), 0);
  // A stream holds its placements and the versions of their hulls.
  grpc::ClientContext context;
  auto stream = collisions_->StreamCollisions(&context);
  v1::StreamCollisionsRequest open;
  for (const double x : {0., 9.}) *open.mutable_open()->add_placements() = PlacementOf("a", x);
  for (const uint32_t i : {0, 1}) open.mutable_open()->add_pairs(i);
  ASSERT_TRUE(stream->Write(open));
  v1::StreamCollisionsResponse answer;
  ASSERT_TRUE(stream->Read(&answer));
  EXPECT_GT(Metric("hulld_cache_reading_bytes"), 0);
  // Without storage, no hull can be evicted. The stream may still return memory meanwhile.
  const std::string now = Metrics();
  EXPECT_EQ(ValueIn(now, "hulld_cache_bytes"),
            ValueIn(now, "hulld_cache_reading_bytes") + ValueIn(now, "hulld_cache_writing_bytes"));
  stream->WritesDone();
  ASSERT_TRUE(stream->Finish().ok());
}

TEST_F(Observation, PairsOfBatchesScenesAndStreamsAreCountedByRung) {
  Put("a", Cube());
  grpc::ClientContext batch_context;
  v1::BatchCheckCollisionsRequest batch;
  for (const double x : {0.0, 9.0, 99.0}) *batch.add_placements() = PlacementOf("a", x);
  for (const uint32_t i : {0, 1, 0, 2, 1, 2}) batch.add_pairs(i);
  auto answers = collisions_->BatchCheckCollisions(&batch_context, batch);
  v1::BatchCheckCollisionsResponse part;
  while (answers->Read(&part)) {
  }
  ASSERT_TRUE(answers->Finish().ok());
  EXPECT_EQ(Metric("hulld_pairs_total{rung=\"bounds\"}"), 3);

  grpc::ClientContext scene_context;
  v1::FindCollisionsRequest scene;
  for (const double x : {0.0, 1.0, 99.0}) *scene.add_placements() = PlacementOf("a", x);
  auto found = collisions_->FindCollisions(&scene_context, scene);
  v1::FindCollisionsResponse scene_part;
  while (found->Read(&scene_part)) {
  }
  ASSERT_TRUE(found->Finish().ok());
  EXPECT_EQ(Metric("hulld_pairs_total{rung=\"exact\"}"), 1);

  grpc::ClientContext stream_context;
  auto stream = collisions_->StreamCollisions(&stream_context);
  v1::StreamCollisionsRequest open;
  *open.mutable_open()->add_placements() = PlacementOf("a");
  *open.mutable_open()->add_placements() = PlacementOf("a", 9);
  open.mutable_open()->add_pairs(0);
  open.mutable_open()->add_pairs(1);
  ASSERT_TRUE(stream->Write(open));
  v1::StreamCollisionsResponse answer;
  ASSERT_TRUE(stream->Read(&answer));
  EXPECT_EQ(Metric("hulld_pairs_total{rung=\"bounds\"}"), 4);
  stream->WritesDone();
  ASSERT_TRUE(stream->Finish().ok());
}

// Returns the value of a key in metadata; empty if missing.
std::string ValueOf(const std::multimap<grpc::string_ref, grpc::string_ref>& metadata,
                    const char* key) {
  const auto found = metadata.find(key);
  return found == metadata.end() ? "" : std::string(found->second.data(), found->second.size());
}

TEST_F(Observation, RepliesCarryTheGivenOrReportedRequestId) {
  const auto ask = [this](const std::string& given, const std::string& hull_id = "none") {
    grpc::ClientContext context;
    if (!given.empty()) context.AddMetadata("x-request-id", given);
    v1::GetHullRequest request;
    v1::GetHullResponse response;
    request.set_hull_id(hull_id);
    hulls_->GetHull(&context, request, &response);
    return ValueOf(context.GetServerTrailingMetadata(), "x-request-id");
  };
  EXPECT_EQ(ask("cell-1/job_42"), "cell-1/job_42");
  std::set<std::string> made = {ask(""), ask(""), ask("no spaces"), ask(std::string(129, 'x'))};
  EXPECT_EQ(made.size(), 4);
  EXPECT_FALSE(made.contains(""));
  EXPECT_FALSE(made.contains("no spaces"));
  EXPECT_EQ(ask(std::string(128, 'x')), std::string(128, 'x'));
  // A successful call without a client's ID gets none: nothing is logged about it.
  Put("cube", Cube());
  EXPECT_EQ(ask("", "cube"), "");
  EXPECT_EQ(ask("mine", "cube"), "mine");
  EXPECT_NE(ask("no spaces", "cube"), "");
}

TEST_F(Observation, AnAbandonedAuditEndsUnfinished) {
  Put("ball", Sphere(50'000));
  // Makes the snapshot, so that only an audit remains.
  Get("ball");
  const std::string begun = "hulld_queue_wait_seconds_count{pool=\"long_readers\"}";
  const double before = Metric(begun);
  grpc::ClientContext context;
  grpc::Status status;
  std::thread client([&] {
    v1::GetHullRequest request;
    v1::GetHullResponse response;
    request.set_hull_id("ball");
    request.set_audit(true);
    status = hulls_->GetHull(&context, request, &response);
  });
  // Bounded by the test's time limit only.
  while (Metric(begun) == before) std::this_thread::yield();
  context.TryCancel();
  client.join();
  EXPECT_EQ(status.error_code(), grpc::StatusCode::CANCELLED);
  ASSERT_TRUE(server_->WaitIdle(std::chrono::minutes(5)));
  // The client reports this status by itself; here the server did.
  EXPECT_EQ(Metric("hulld_requests_total{code=\"OK\",rpc=\"GetHull\"}"), 1);
  EXPECT_EQ(Metric("hulld_requests_total{code=\"CANCELLED\",rpc=\"GetHull\"}"), 1);
}

TEST_F(Observation, ErrorsNameTheRequestInTheirDetails) {
  grpc::ClientContext context;
  context.AddMetadata("x-request-id", "lost-1");
  v1::GetHullRequest request;
  v1::GetHullResponse response;
  request.set_hull_id("none");
  const grpc::Status status = hulls_->GetHull(&context, request, &response);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::NOT_FOUND);
  EXPECT_THAT(status.error_message(), Not(HasSubstr("lost-1")));
  EXPECT_EQ(ValueOf(context.GetServerTrailingMetadata(), "x-request-id"), "lost-1");
  // google.rpc.Status: code 5; message; details, first an Any of RequestInfo { request_id }.
  const std::string request_info = "\x0a\x06lost-1";
  const std::string type = "type.googleapis.com/google.rpc.RequestInfo";
  std::string any = "\x0a" + std::string(1, static_cast<char>(type.size())) + type;
  any += "\x12" + std::string(1, static_cast<char>(request_info.size())) + request_info;
  const std::string& message = status.error_message();
  EXPECT_THAT(status.error_details(),
              StartsWith("\x08\x05\x12" + std::string(1, static_cast<char>(message.size())) +
                         message + "\x1a" + std::string(1, static_cast<char>(any.size())) + any));
}

TEST(LineBudget, AllowsALimitedNumberOfLinesAndCountsTheRest) {
  const LineBudget::Clock::time_point start{};
  LineBudget budget(2, std::chrono::seconds(10));
  EXPECT_EQ(budget.Spend(start), 0);
  EXPECT_EQ(budget.Spend(start + std::chrono::seconds(9)), 0);
  EXPECT_EQ(budget.Spend(start + std::chrono::seconds(9)), std::nullopt);
  EXPECT_EQ(budget.Spend(start + std::chrono::milliseconds(9999)), std::nullopt);
  // The next interval begins with its first line, however late.
  EXPECT_EQ(budget.Spend(start + std::chrono::seconds(15)), 2);
  EXPECT_EQ(budget.Spend(start + std::chrono::seconds(24)), 0);
  EXPECT_EQ(budget.Spend(start + std::chrono::seconds(24)), std::nullopt);
  EXPECT_EQ(budget.Spend(start + std::chrono::seconds(25)), 1);
}

// A name that is not UTF-8: protobuf would log it to standard error in full, every time.
TEST_F(Observation, MalformedMessagesDoNotFloodTheLog) {
  const CapturedLog log;
  RouteLibraryLogs();
  constexpr int kMessages = 10 * kLibraryLines;
  const std::string bad_name = "\x0a\x02\xc3\x28";
  const grpc::Slice slice(bad_name);
  const grpc::ByteBuffer request(&slice, 1);
  testing::internal::CaptureStderr();
  for (int i = 0; i < kMessages; ++i) {
    grpc::GenericStub stub(channel_);
    grpc::ClientContext context;
    grpc::ByteBuffer response;
    std::promise<grpc::Status> finished;
    stub.UnaryCall(&context, "/hulld.v1.HullService/GetHull", grpc::StubOptions(), &request,
                   &response, [&](grpc::Status status) { finished.set_value(std::move(status)); });
    EXPECT_FALSE(finished.get_future().get().ok());
  }
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
  const std::string text = log.text();
  EXPECT_THAT(text, HasSubstr("warning protobuf: String field 'hulld.v1.GetHullRequest.hull_id'"));
  size_t lines = 0;
  for (size_t at = 0; (at = text.find("protobuf: ", at)) != std::string::npos; ++at) ++lines;
  EXPECT_LE(lines, size_t{kLibraryLines});
}

TEST_F(Observation, LogLinesAboutACallNameItsRequest) {
  const CapturedLog log;
  grpc::ClientContext context;
  context.AddMetadata("x-request-id", "made-1");
  v1::CreateHullRequest request;
  v1::CreateHullResponse response;
  request.set_hull_id("a");
  ASSERT_TRUE(hulls_->CreateHull(&context, request, &response).ok());
  grpc::ClientContext again;
  again.AddMetadata("x-request-id", "made-2");
  EXPECT_FALSE(hulls_->CreateHull(&again, request, &response).ok());
  server_.reset();  // so that nothing logs after this
  EXPECT_THAT(log.text(), HasSubstr("info hull created rpc=CreateHull request_id=made-1 peer="));
  EXPECT_THAT(log.text(), HasSubstr("debug request failed rpc=CreateHull request_id=made-2 peer="));
  EXPECT_THAT(log.text(), HasSubstr(" code=ALREADY_EXISTS milliseconds="));
}

TEST_F(Observation, SlowRequestsAreLoggedWithTheirSizes) {
  Config config = TestConfig();
  config.limits.slow_request = std::chrono::milliseconds(1);
  Restart(config);
  Put("ball", Sphere(100));
  const CapturedLog log;
  // About 10^8 operations: more than a millisecond on any machine.
  v1::BatchCheckCollisionsRequest request;
  request.set_method(v1::METHOD_TEXTBOOK_SAT);
  *request.add_placements() = PlacementOf("ball");
  *request.add_placements() = PlacementOf("ball", 0.5);
  for (int i = 0; i < 4; ++i) {
    request.add_pairs(0);
    request.add_pairs(1);
  }
  grpc::ClientContext context;
  context.AddMetadata("x-request-id", "slow-1");
  auto stream = collisions_->BatchCheckCollisions(&context, request);
  v1::BatchCheckCollisionsResponse part;
  while (stream->Read(&part)) {
  }
  ASSERT_TRUE(stream->Finish().ok());
  server_.reset();
  EXPECT_THAT(log.text(), ::testing::ContainsRegex(
                              "warning slow request rpc=BatchCheckCollisions request_id=slow-1 "
                              "peer=[^ ]+ code=OK milliseconds=[0-9.]+ pairs=4 points=0\n"));
}

TEST(LogEventTest, TextIsQuotedAndEscapedWhereNeeded) {
  const CapturedLog log;
  LogEvent(LogLevel::info, "done",
           {{"id", "a/b"}, {"name", "two words"}, {"bad", "a\n\"b\""}, {"count", uint64_t{3}}});
  EXPECT_EQ(log.text(), "info done id=a/b name=\"two words\" bad=\"a\\u000a\\\"b\\\"\" count=3\n");
}

// A watcher of grpc.health.v1; Debian does not ship its generated code.
TEST_F(Observation, HealthWatchesReportTheDrain) {
  grpc::GenericStub stub(channel_);
  grpc::ClientContext context;
  grpc::CompletionQueue queue;
  const auto done = [&queue] {
    void* tag = nullptr;
    bool ok = false;
    return queue.Next(&tag, &ok) && ok;
  };
  const auto stream = stub.PrepareCall(&context, "/grpc.health.v1.Health/Watch", &queue);
  stream->StartCall(nullptr);
  ASSERT_TRUE(done());
  const grpc::Slice empty;
  stream->Write(grpc::ByteBuffer(&empty, 1), nullptr);
  ASSERT_TRUE(done());
  // HealthCheckResponse.status: 1 SERVING, 2 NOT_SERVING.
  const auto next = [&]() -> int {
    grpc::ByteBuffer reply;
    stream->Read(&reply, nullptr);
    std::vector<grpc::Slice> slices;
    if (!done() || !reply.Dump(&slices).ok() || slices.size() != 1) return 0;
    return slices[0].size() == 2 ? slices[0].begin()[1] : 0;
  };
  EXPECT_EQ(next(), 1);
  server_->BeginDrain();
  EXPECT_EQ(next(), 2);
  context.TryCancel();
  EXPECT_EQ(next(), 0);
  grpc::Status status;
  stream->Finish(&status, nullptr);
  done();
}

}  // namespace observation_test
}  // namespace hulld::server
