// The program itself, with certificates and tokens: reloading, and secrets in the log.

#include <absl/strings/str_cat.h>
#include <gmock/gmock.h>
#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>
#include <openssl/sha.h>

#include <cstdlib>
#include <filesystem>

#include "hulld/v1/hull.grpc.pb.h"
#include "tests/server/harness/hulld_process.h"
#include "tests/server/harness/test_certificates.h"

namespace hulld::server {
namespace guard_process_test {

using ::testing::HasSubstr;
using ::testing::Not;

constexpr char kToken[] = "correct-horse-battery-staple";
constexpr char kWrongToken[] = "tr0ub4dor-and-3";

std::string HashOf(const std::string& token) {
  unsigned char hash[SHA256_DIGEST_LENGTH];
  SHA256(reinterpret_cast<const unsigned char*>(token.data()), token.size(), hash);
  std::string text;
  for (const unsigned char byte : hash) {
    for (const int digit : {byte >> 4, byte & 15}) text += "0123456789abcdef"[digit];
  }
  return text;
}

std::string Line(const std::string& token) {
  return absl::StrCat("robot read-only * sha256:", HashOf(token), "\n");
}

class GuardProcess : public ::testing::Test {
 protected:
  void SetUp() override {
    std::string pattern = ::testing::TempDir() + "/hulld_guard_test_XXXXXX";
    ASSERT_NE(mkdtemp(pattern.data()), nullptr);
    directory_ = pattern;
    WriteIdentity(authority_.Issue("hulld"));
    WriteTokens(Line(kToken));
  }

  void TearDown() override { std::filesystem::remove_all(directory_); }

  void WriteIdentity(const TestIdentity& identity) {
    identity_ = identity;
    WriteSecret(directory_ + "/crt", identity.certificate);
    WriteSecret(directory_ + "/key", identity.key);
  }

  void WriteTokens(const std::string& text) { WriteSecret(directory_ + "/tokens", text); }

  std::vector<std::string> Arguments() const {
    return {"--listen",      "127.0.0.1:0",
            "--tls-cert",    directory_ + "/crt",
            "--tls-key",     directory_ + "/key",
            "--tokens-file", directory_ + "/tokens",
            "--log-level",   "debug"};
  }

  grpc::StatusCode Call(const std::string& address, const std::string& token,
                        const TestAuthority& authority, bool change = false) {
    grpc::ChannelArguments arguments;
    arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
    const auto stub = v1::HullService::NewStub(grpc::CreateCustomChannel(
        address, grpc::SslCredentials({authority.certificate(), "", ""}), arguments));
    grpc::ClientContext context;
    context.AddMetadata("authorization", std::string("Bearer ").append(token));
    if (change) {
      v1::CreateHullRequest request;
      v1::CreateHullResponse response;
      request.set_hull_id("h");
      return stub->CreateHull(&context, request, &response).error_code();
    }
    v1::ListHullsResponse response;
    return stub->ListHulls(&context, {}, &response).error_code();
  }

  const TestAuthority authority_{"authority"};
  const TestAuthority other_{"other authority"};
  TestIdentity identity_;
  std::string directory_;
};

TEST_F(GuardProcess, ChangedFilesAreDetectedWithoutASignal) {
  Process hulld(Arguments());
  const std::string address = AddressIn(hulld.ReadLineWith("listening on "));
  EXPECT_EQ(Call(address, kToken, authority_), grpc::StatusCode::OK);
  WriteTokens(Line(kWrongToken));
  EXPECT_NE(hulld.ReadLineWith("loaded 1 token"), "");
  EXPECT_EQ(Call(address, kToken, authority_), grpc::StatusCode::UNAUTHENTICATED);
  EXPECT_EQ(Call(address, kWrongToken, authority_), grpc::StatusCode::OK);
  WriteIdentity(other_.Issue("renewed"));
  EXPECT_NE(hulld.ReadLineWith("using the TLS certificate of CN = renewed"), "");
  EXPECT_EQ(Call(address, kWrongToken, other_), grpc::StatusCode::OK);
}

TEST_F(GuardProcess, NoSecretReachesTheLog) {
  Process hulld(Arguments());
  const std::string address = AddressIn(hulld.ReadLineWith("listening on "));
  EXPECT_EQ(Call(address, kToken, authority_), grpc::StatusCode::OK);
  EXPECT_EQ(Call(address, kToken, authority_, true), grpc::StatusCode::PERMISSION_DENIED);
  EXPECT_EQ(Call(address, kWrongToken, authority_), grpc::StatusCode::UNAUTHENTICATED);
  // Operator mistakes: a token instead of its hash, and a truncated key.
  WriteTokens(absl::StrCat("robot read-only * ", kToken, "\n"));
  WriteSecret(directory_ + "/key", identity_.key.substr(0, identity_.key.size() / 2));
  hulld.Signal(SIGHUP);
  EXPECT_NE(hulld.ReadLineWith("SIGHUP received"), "");
  EXPECT_EQ(Call(address, kToken, authority_), grpc::StatusCode::OK);
  hulld.Signal(SIGTERM);
  EXPECT_NE(hulld.ReadLineWith("ended"), "");
  EXPECT_EQ(hulld.Wait(), 0);

  std::string log;
  for (const std::string& line : hulld.lines()) log += line;
  EXPECT_THAT(log, HasSubstr("the tokens were not reloaded: --tokens-file"));
  EXPECT_THAT(log, HasSubstr("the TLS certificates were not reloaded: --tls-key"));
  for (const std::string& secret : {std::string(kToken), std::string(kWrongToken), HashOf(kToken),
                                    identity_.key.substr(40, 40)}) {
    EXPECT_THAT(log, Not(HasSubstr(secret)));
  }
}

TEST_F(GuardProcess, CheckConfigEndsWith0Or2AndNamesTheSetting) {
  const auto check = [](std::vector<std::string> arguments, int status, const std::string& what) {
    arguments.emplace_back("--check-config");
    Process hulld(arguments);
    EXPECT_NE(hulld.ReadLineWith(what).empty(), status != 0) << what;
    EXPECT_EQ(hulld.Wait(), status) << what;
  };
  const auto expect = [this, check](const std::vector<std::string>& changed, int status,
                                    const std::string& what) {
    std::vector<std::string> arguments = Arguments();
    arguments.insert(arguments.end(), changed.begin(), changed.end());
    check(arguments, status, what);
  };
  expect({}, 0, "hulld:");
  expect({"--listen", "0.0.0.0:50551"}, 0, "hulld:");
  expect({"--listen", "nowhere"}, 2, "--listen is \"nowhere\"");
  check({"--listen", "0.0.0.0:50551"}, 2, "--insecure");
  expect({"--metrics-address", "nonsense"}, 2, "--metrics-address is \"nonsense\"");
  expect({"--metrics-address", "0.0.0.0:9464"}, 2, "--metrics-insecure");
  expect({"--max-hulls", "none"}, 2, "--max-hulls");
  expect({"--tls-key", directory_ + "/crt"}, 2, "--tls-key " + directory_ + "/crt: ");
  expect({"--tls-client-ca", "/nonexistent"}, 2, "--tls-client-ca /nonexistent: ");
  expect({"--tokens-file", directory_ + "/crt"}, 2, "--tokens-file " + directory_ + "/crt: line 1");
  WriteIdentity(authority_.Issue("old", std::chrono::hours(-2), std::chrono::hours(-1)));
  expect({}, 2, "--tls-cert: the certificate of CN = old expired on ");
}

}  // namespace guard_process_test
}  // namespace hulld::server
