// Tokens over the wire: permissions of each role, and visibility of hulls by prefix.

#include <absl/strings/ascii.h>
#include <absl/strings/str_cat.h>
#include <gmock/gmock.h>
#include <google/protobuf/descriptor.h>
#include <grpcpp/generic/generic_stub.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cstring>
#include <filesystem>
#include <functional>
#include <map>
#include <set>
#include <string>
#include <string_view>

#include "hulld/v1/body.pb.h"
#include "server/access/caller.h"
#include "tests/server/harness/test_certificates.h"
#include "tests/server/harness/test_server.h"
#include "tests/server/harness/test_tokens.h"

namespace hulld::server {
namespace access_test {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;

// Status and reply bytes of a call.
struct Outcome {
  grpc::Status status;
  std::string replies;
};

// A call, in the form used by the tests below.
struct CallRule {
  Permission needed;
  // The messages of a request about a hull.
  std::function<std::vector<std::string>(const std::string& hull_id)> request;
  // The refusal of a hull outside the caller's prefix is the status of the call or an entry in its
  // reply. kNoHull: the call names no hull.
  enum { kByStatus, kInReply, kNoHull } refusal;
};

template <typename Request>
std::vector<std::string> WithHullId(const std::string& hull_id) {
  Request request;
  request.set_hull_id(hull_id);
  return {request.SerializeAsString()};
}

template <typename Request>
std::vector<std::string> WithBodyId(const std::string& body_id) {
  Request request;
  request.set_body_id(body_id);
  return {request.SerializeAsString()};
}

// Every call of the API; a new one needs a rule here.
const std::map<std::string, CallRule>& Rules() {
  static const auto* const rules = new std::map<std::string, CallRule>{
      {"hulld.v1.HullService.CreateHull",
       {Permission::kWrite, WithHullId<v1::CreateHullRequest>, CallRule::kByStatus}},
      {"hulld.v1.HullService.AppendPoints",
       {Permission::kWrite,
        [](const std::string& hull_id) {
          return std::vector{OpenMessage(hull_id, "w", true).SerializeAsString(),
                             ChunkMessage(1, Cube()).SerializeAsString()};
        },
        CallRule::kByStatus}},
      {"hulld.v1.HullService.ReplaceHull",
       {Permission::kWrite,
        [](const std::string& hull_id) {
          v1::ReplaceHullRequest open;
          open.mutable_open()->set_hull_id(hull_id);
          open.mutable_open()->set_create_if_absent(true);
          v1::ReplaceHullRequest points;
          for (const double number : Cube()) points.mutable_points()->add_xyz(number);
          v1::ReplaceHullRequest end;
          end.mutable_points();
          return std::vector{open.SerializeAsString(), points.SerializeAsString(),
                             end.SerializeAsString()};
        },
        CallRule::kByStatus}},
      {"hulld.v1.HullService.GetHull",
       {Permission::kRead, WithHullId<v1::GetHullRequest>, CallRule::kByStatus}},
      {"hulld.v1.HullService.GetHullMesh",
       {Permission::kRead, WithHullId<v1::GetHullMeshRequest>, CallRule::kByStatus}},
      {"hulld.v1.HullService.ListHulls",
       {Permission::kRead,
        [](const std::string& hull_id) {
          v1::ListHullsRequest request;
          request.set_prefix(hull_id);
          return std::vector{request.SerializeAsString()};
        },
        CallRule::kByStatus}},
      {"hulld.v1.HullService.DeleteHull",
       {Permission::kWrite, WithHullId<v1::DeleteHullRequest>, CallRule::kByStatus}},
      {"hulld.v1.HullService.WatchHulls",
       {Permission::kRead, WithHullId<v1::WatchHullsRequest>, CallRule::kByStatus}},
      {"hulld.v1.CollisionService.CheckCollision",
       {Permission::kRead,
        [](const std::string& hull_id) {
          v1::CheckCollisionRequest request;
          *request.mutable_a() = PlacementOf("cell-1/own");
          *request.mutable_b() = PlacementOf(hull_id);
          return std::vector{request.SerializeAsString()};
        },
        CallRule::kByStatus}},
      {"hulld.v1.CollisionService.BatchCheckCollisions",
       {Permission::kRead,
        [](const std::string& hull_id) {
          v1::BatchCheckCollisionsRequest request;
          *request.add_placements() = PlacementOf("cell-1/own");
          *request.add_placements() = PlacementOf(hull_id);
          request.add_pairs(0);
          request.add_pairs(1);
          return std::vector{request.SerializeAsString()};
        },
        CallRule::kInReply}},
      {"hulld.v1.CollisionService.StreamCollisions",
       {Permission::kRead,
        [](const std::string& hull_id) {
          v1::StreamCollisionsRequest open;
          *open.mutable_open()->add_placements() = PlacementOf("cell-1/own");
          *open.mutable_open()->add_placements() = PlacementOf(hull_id);
          open.mutable_open()->add_pairs(0);
          open.mutable_open()->add_pairs(1);
          v1::StreamCollisionsRequest update;
          update.mutable_update()->set_refresh_hulls(true);
          update.mutable_update()->add_placements(1);
          for (const double number : {1, 0, 0, 0, 3, 0, 0}) {
            update.mutable_update()->add_poses(number);
          }
          return std::vector{open.SerializeAsString(), update.SerializeAsString()};
        },
        CallRule::kInReply}},
      {"hulld.v1.CollisionService.FindCollisions",
       {Permission::kRead,
        [](const std::string& hull_id) {
          v1::FindCollisionsRequest request;
          *request.add_placements() = PlacementOf("cell-1/own");
          *request.add_placements() = PlacementOf(hull_id);
          return std::vector{request.SerializeAsString()};
        },
        CallRule::kInReply}},
      {"hulld.v1.CollisionService.WatchCollisions",
       {Permission::kRead,
        [](const std::string& hull_id) {
          v1::WatchCollisionsRequest open;
          *open.mutable_open()->add_placements() = PlacementOf("cell-1/own");
          *open.mutable_open()->add_placements() = PlacementOf(hull_id);
          return std::vector{open.SerializeAsString()};
        },
        CallRule::kInReply}},
      {"hulld.v1.BodyService.PutBody",
       {Permission::kWrite,
        [](const std::string& body_id) {
          v1::PutBodyRequest request;
          request.set_body_id(body_id);
          *request.add_pieces() = PlacementOf("cell-1/own");
          return std::vector{request.SerializeAsString()};
        },
        CallRule::kByStatus}},
      {"hulld.v1.BodyService.GetBody",
       {Permission::kRead, WithBodyId<v1::GetBodyRequest>, CallRule::kByStatus}},
      {"hulld.v1.BodyService.ListBodies",
       {Permission::kRead,
        [](const std::string& body_id) {
          v1::ListBodiesRequest request;
          request.set_prefix(body_id);
          return std::vector{request.SerializeAsString()};
        },
        CallRule::kByStatus}},
      {"hulld.v1.BodyService.DeleteBody",
       {Permission::kWrite, WithBodyId<v1::DeleteBodyRequest>, CallRule::kByStatus}},
      {"hulld.v1.StatusService.GetStatus",
       {Permission::kRead, [](const std::string&) { return std::vector{std::string()}; },
        CallRule::kNoHull}},
      {"hulld.v1.MaintenanceService.SaveBackup",
       {Permission::kAdmin, [](const std::string&) { return std::vector{std::string()}; },
        CallRule::kNoHull}},
  };
  return *rules;
}

class Access : public ServerTest {
 protected:
  void SetUp() override {
    path_ = absl::StrCat(::testing::TempDir(), "/hulld_access_test_", getpid());
    WriteSecret(path_, TokenLine("viewer", "read-only", "*", "viewer's secret") +
                           TokenLine("robot", "read-write", "*", "robot's secret") +
                           TokenLine("boss", "admin", "*", "boss's secret") +
                           TokenLine("cell", "admin", "cell-1/", "cell's secret"));
    Config config = TestConfig();
    config.tokens_file = path_;
    Restart(config);
    for (const char* hull : {"cell-1/own", "cell-10/theirs", "cell", "cell-1"}) {
      ASSERT_TRUE(Do("hulld.v1.HullService.AppendPoints", "robot's secret", hull).status.ok());
    }
  }

  ~Access() override { std::filesystem::remove(path_); }

  // Returns every call that reflection lists, as "hulld.v1.Service.Method".
  std::set<std::string> KnownCalls() {
    const Outcome services = Run("/grpc.reflection.v1alpha.ServerReflection/ServerReflectionInfo",
                                 {}, {std::string(":\0", 2)});
    std::set<std::string> calls;
    const std::string_view replies = services.replies;
    constexpr std::string_view kPackage = "hulld.v1.";
    for (std::size_t at = replies.find(kPackage); at != replies.npos;
         at = replies.find(kPackage, at + 1)) {
      std::size_t end = at + kPackage.size();
      while (end < replies.size() && absl::ascii_isalpha(replies[end])) ++end;
      const std::string name(replies.substr(at, end - at));
      const auto* const service =
          google::protobuf::DescriptorPool::generated_pool()->FindServiceByName(name);
      if (service == nullptr) {
        ADD_FAILURE() << name;
        continue;
      }
      for (int i = 0; i < service->method_count(); ++i) {
        calls.insert(service->method(i)->full_name());
      }
    }
    return calls;
  }

  Outcome Run(const std::string& method, const std::vector<std::string>& authorizations,
              const std::vector<std::string>& messages) {
    grpc::GenericStub stub(channel_);
    grpc::ClientContext context;
    for (const std::string& text : authorizations) context.AddMetadata("authorization", text);
    grpc::CompletionQueue queue;
    const auto stream = stub.PrepareCall(&context, method, &queue);
    const auto done = [&queue] {
      void* tag = nullptr;
      bool ok = false;
      return queue.Next(&tag, &ok) && ok;
    };
    Outcome outcome;
    stream->StartCall(nullptr);
    bool open = done();
    for (const std::string& message : messages) {
      if (!open) break;
      const grpc::Slice slice(message);
      stream->Write(grpc::ByteBuffer(&slice, 1), nullptr);
      open = done();
    }
    if (open) {
      stream->WritesDone(nullptr);
      done();
    }
    for (bool more = true; more;) {
      grpc::ByteBuffer reply;
      stream->Read(&reply, nullptr);
      more = done();
      // A call that does not end by itself.
      if (more && method.ends_with("WatchHulls")) context.TryCancel();
      std::vector<grpc::Slice> slices;
      if (!more || !reply.Dump(&slices).ok()) continue;
      for (const grpc::Slice& slice : slices) {
        outcome.replies.append(reinterpret_cast<const char*>(slice.begin()), slice.size());
      }
    }
    stream->Finish(&outcome.status, nullptr);
    done();
    return outcome;
  }

  Outcome Do(const std::string& call, const std::string& token, const std::string& hull_id) {
    const size_t dot = call.rfind('.');
    return Run(absl::StrCat("/", call.substr(0, dot), "/", call.substr(dot + 1)),
               {absl::StrCat("Bearer ", token)}, Rules().at(call).request(hull_id));
  }

  std::vector<std::string> ListedBy(const std::string& token, const std::string& prefix) {
    std::vector<std::string> ids;
    v1::ListHullsRequest request;
    request.set_prefix(prefix);
    request.set_page_size(1);
    do {
      grpc::ClientContext context;
      context.AddMetadata("authorization", absl::StrCat("Bearer ", token));
      v1::ListHullsResponse response;
      const grpc::Status status = hulls_->ListHulls(&context, request, &response);
      EXPECT_TRUE(status.ok()) << status.error_message();
      for (const v1::HullInfo& hull : response.hulls()) ids.push_back(hull.hull_id());
      request.set_page_token(response.next_page_token());
    } while (!request.page_token().empty());
    return ids;
  }

  std::string path_;
};

// A token may use a body if it may use all of its pieces. Errors never name a hull outside the
// token's prefix.
TEST_F(Access, APieceOutsideOfThePrefixIsRefusedUnnamed) {
  v1::PutBodyRequest put;
  put.set_body_id("cell-1/body");
  *put.add_pieces() = PlacementOf("cell-1/own");
  *put.add_pieces() = PlacementOf("cell-10/theirs", 3, 0, 0);
  const auto run = [this](const std::string& method, const std::string& token,
                          const google::protobuf::Message& request) {
    return Run(method, {absl::StrCat("Bearer ", token)}, {request.SerializeAsString()}).status;
  };
  const std::string put_method = "/hulld.v1.BodyService/PutBody";
  EXPECT_EQ(run(put_method, "cell's secret", put).error_code(),
            grpc::StatusCode::PERMISSION_DENIED);
  ASSERT_TRUE(run(put_method, "robot's secret", put).ok());
  v1::GetBodyRequest get;
  get.set_body_id("cell-1/body");
  v1::CheckCollisionRequest check;
  *check.mutable_a() = PlacementOf("cell-1/body");
  *check.mutable_b() = PlacementOf("cell-1/own");
  for (const auto& [method, request] : std::map<std::string, const google::protobuf::Message*>{
           {"/hulld.v1.BodyService/GetBody", &get},
           {"/hulld.v1.CollisionService/CheckCollision", &check}}) {
    EXPECT_TRUE(run(method, "viewer's secret", *request).ok());
    const grpc::Status status = run(method, "cell's secret", *request);
    EXPECT_EQ(status.error_code(), grpc::StatusCode::PERMISSION_DENIED) << method;
    EXPECT_THAT(status.error_message(), AllOf(HasSubstr("piece 1"), Not(HasSubstr("theirs"))));
  }
}

TEST_F(Access, EveryCallOfTheServerHasARule) {
  const std::set<std::string> calls = KnownCalls();
  EXPECT_EQ(calls.size(), Rules().size());
  for (const std::string& call : calls) EXPECT_EQ(Rules().count(call), 1) << call;
}

TEST_F(Access, EveryCallNeedsAKnownToken) {
  for (const auto& [call, rule] : Rules()) {
    const size_t dot = call.rfind('.');
    const std::string method = absl::StrCat("/", call.substr(0, dot), "/", call.substr(dot + 1));
    const std::vector<std::string> request = rule.request("cell-1/new");
    const std::vector<std::vector<std::string>> wrong = {
        {},
        {"Bearer hunter2"},
        {"Bearer "},
        {"hunter2"},
        {"Basic hunter2"},
        {"Bearer viewer's secret "},
        {"Bearer robot's secret", "Bearer robot's secret"}};
    for (const std::vector<std::string>& authorizations : wrong) {
      const Outcome outcome = Run(method, authorizations, request);
      EXPECT_EQ(outcome.status.error_code(), grpc::StatusCode::UNAUTHENTICATED) << call;
      EXPECT_THAT(outcome.status.error_message(),
                  AllOf(Not(HasSubstr("hunter2")), Not(HasSubstr("secret"))));
      EXPECT_EQ(outcome.replies, "") << call;
    }
    EXPECT_NE(Run(method, {"bearer boss's secret"}, request).status.error_code(),
              grpc::StatusCode::UNAUTHENTICATED)
        << call;
  }
}

TEST_F(Access, EveryCallNeedsItsRole) {
  const std::map<Permission, std::string> tokens = {{Permission::kRead, "viewer's secret"},
                                                    {Permission::kWrite, "robot's secret"},
                                                    {Permission::kAdmin, "boss's secret"}};
  for (const auto& [call, rule] : Rules()) {
    for (const auto& [permission, token] : tokens) {
      const grpc::Status status = Do(call, token, "cell-1/own").status;
      if (permission >= rule.needed) {
        EXPECT_NE(status.error_code(), grpc::StatusCode::PERMISSION_DENIED) << call;
        continue;
      }
      EXPECT_EQ(status.error_code(), grpc::StatusCode::PERMISSION_DENIED) << call;
      EXPECT_THAT(status.error_message(), HasSubstr(std::string("needs ") + RoleName(rule.needed)));
    }
  }
}

// Neither the code nor the message nor the reply differs from that of a missing hull.
TEST_F(Access, NoCallRevealsHullsUnderOtherPrefixes) {
  for (const auto& [call, rule] : Rules()) {
    if (rule.refusal == CallRule::kNoHull) continue;
    for (const char* theirs : {"cell-10/theirs", "cell", "cell-1"}) {
      const bool is_list = call.ends_with("ListHulls") || call.ends_with("ListBodies");
      if (is_list && std::string("cell-1/").starts_with(theirs)) continue;
      const std::string none = absl::StrCat(std::string(theirs, std::strlen(theirs) - 1), "X");
      const Outcome there = Do(call, "cell's secret", theirs);
      Outcome absent = Do(call, "cell's secret", none);
      const std::string& said =
          rule.refusal == CallRule::kByStatus ? there.status.error_message() : there.replies;
      EXPECT_THAT(said, HasSubstr("is outside the prefix \"cell-1/\"")) << call << " " << theirs;
      EXPECT_EQ(there.status.error_code(), rule.refusal == CallRule::kByStatus
                                               ? grpc::StatusCode::PERMISSION_DENIED
                                               : grpc::StatusCode::OK)
          << call;
      const auto renamed = [&](std::string text) {
        for (size_t at = 0; (at = text.find(none, at)) != std::string::npos;) {
          text.replace(at, none.size(), theirs);
        }
        return text;
      };
      EXPECT_EQ(renamed(absent.status.error_message()), there.status.error_message()) << call;
      EXPECT_EQ(renamed(absent.replies), there.replies) << call;
    }
    EXPECT_NE(Do(call, "cell's secret", "cell-1/own").status.error_code(),
              grpc::StatusCode::PERMISSION_DENIED)
        << call;
  }
}

TEST_F(Access, ListsShowOnlyTheCallersHulls) {
  EXPECT_THAT(ListedBy("boss's secret", ""),
              ElementsAre("cell", "cell-1", "cell-1/own", "cell-10/theirs"));
  for (const char* prefix : {"", "c", "cell-1", "cell-1/", "cell-1/o"}) {
    EXPECT_THAT(ListedBy("cell's secret", prefix), ElementsAre("cell-1/own")) << prefix;
  }
  EXPECT_THAT(ListedBy("cell's secret", "cell-1/x"), ElementsAre());
}

TEST_F(Access, AWatchReportsOnlyTheCallersHulls) {
  int n = 0;
  for (const char* prefix : {"", "c", "cell-1/"}) {
    ++n;
    grpc::ClientContext context;
    context.AddMetadata("authorization", "Bearer cell's secret");
    v1::WatchHullsRequest request;
    request.set_prefix(prefix);
    const auto reader = hulls_->WatchHulls(&context, request);
    std::vector<std::string> ids;
    v1::WatchHullsResponse message;
    const auto read_to = [&](const std::string& last) {
      while ((ids.empty() || ids.back() != last) && reader->Read(&message)) {
        for (const v1::HullEvent& event : message.events()) ids.push_back(event.hull().hull_id());
      }
    };
    read_to("cell-1/own");
    const std::string theirs = absl::StrCat("cell-10/of", n);
    const std::string own = absl::StrCat("cell-1/of", n);
    for (const std::string& id : {theirs, own}) {
      ASSERT_TRUE(Do("hulld.v1.HullService.CreateHull", "robot's secret", id).status.ok());
    }
    read_to(own);
    for (const std::string& id : ids) EXPECT_TRUE(id.starts_with("cell-1/")) << id;
    context.TryCancel();
    reader->Finish();
  }
  grpc::ClientContext context;
  context.AddMetadata("authorization", "Bearer cell's secret");
  v1::WatchHullsRequest request;
  request.set_prefix("cell-10/");
  const auto reader = hulls_->WatchHulls(&context, request);
  EXPECT_EQ(reader->Finish().error_code(), grpc::StatusCode::PERMISSION_DENIED);
}

TEST_F(Access, CallersWithAPrefixMayNotUseTheWholeStore) {
  const grpc::Status status =
      Do("hulld.v1.MaintenanceService.SaveBackup", "cell's secret", "").status;
  EXPECT_EQ(status.error_code(), grpc::StatusCode::PERMISSION_DENIED);
  EXPECT_THAT(status.error_message(), HasSubstr("\"cell-1/\""));
}

TEST_F(Access, CallersWithAPrefixMayNotReadTheSizesOfTheStore) {
  const auto ask = [this](const std::string& token) {
    v1::GetStatusResponse response;
    const Outcome outcome = Do("hulld.v1.StatusService.GetStatus", token, "");
    EXPECT_TRUE(outcome.status.ok() && response.ParseFromString(outcome.replies));
    return response;
  };
  EXPECT_EQ(ask("viewer's secret").hull_count(), 4);
  EXPECT_FALSE(ask("cell's secret").has_hull_count());
  EXPECT_FALSE(ask("cell's secret").has_vertex_count());
}

TEST_F(Access, HealthNeedsNoToken) {
  EXPECT_TRUE(Run("/grpc.health.v1.Health/Check", {}, {""}).status.ok());
}

TEST_F(Access, ChangedTokensApplyFromTheNextCallAndABrokenFileChangesNothing) {
  const auto code = [this](const std::string& token) {
    return Do("hulld.v1.HullService.GetHull", token, "cell-1/own").status.error_code();
  };
  const std::string line = TokenLine("new", "read-only", "*", "new secret");
  for (const std::string& broken : {line + "new secret\n", line + line}) {
    WriteSecret(path_, broken);
    server_->ReloadFiles();
    EXPECT_EQ(code("viewer's secret"), grpc::StatusCode::OK);
    EXPECT_EQ(code("new secret"), grpc::StatusCode::UNAUTHENTICATED);
  }
  WriteSecret(path_, line);
  server_->ReloadFiles();
  EXPECT_EQ(code("viewer's secret"), grpc::StatusCode::UNAUTHENTICATED);
  EXPECT_EQ(code("new secret"), grpc::StatusCode::OK);
  std::filesystem::remove(path_);
  server_->ReloadFiles();
  EXPECT_EQ(code("new secret"), grpc::StatusCode::UNAUTHENTICATED);
}

TEST_F(Access, WithoutTokensATokenIsIgnored) {
  Restart(TestConfig());
  Put("h", Cube());
  EXPECT_TRUE(Do("hulld.v1.HullService.GetHull", "anything", "h").status.ok());
}

}  // namespace access_test
}  // namespace hulld::server
