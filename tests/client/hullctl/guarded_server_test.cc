// The library and hullctl against a server that requires TLS and tokens: successful use, and
// hullctl's messages for mistakes.

#include <absl/strings/str_cat.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "client/client.h"
#include "client/connection_security.h"
#include "tests/client/hullctl/hullctl_on_server.h"
#include "tests/server/harness/test_certificates.h"
#include "tests/server/harness/test_server.h"

namespace hulld {
namespace guarded_server_test {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::MatchesRegex;
using ::testing::Not;

class GuardedServer : public server::ServerTest {
 protected:
  void SetUp() override {
    unsetenv("HULLD_TOKEN");
    // Like hullctl's main.
    std::signal(SIGPIPE, SIG_IGN);
    std::string pattern = ::testing::TempDir() + "/hulld_guarded_server_test_XXXXXX";
    ASSERT_NE(mkdtemp(pattern.data()), nullptr);
    directory_ = pattern;
    const server::TestIdentity identity = authority_.Issue("hulld");
    config_ = TestConfig();
    config_.tls_cert = Write("server.crt", identity.certificate);
    config_.tls_key = Write("server.key", identity.key);
    config_.tokens_file = directory_ + "/tokens";
    authorities_ = Write("authority.crt", authority_.certificate());
    Write("tokens", absl::StrCat(NewToken("boss", "admin", ""), NewToken("view", "read-only", ""),
                                 NewToken("cell", "read-write", "cell-1/")));
  }

  ~GuardedServer() override {
    unsetenv("HULLD_TOKEN");
    UseNoContexts();
    std::filesystem::remove_all(directory_);
  }

  std::string Write(const std::string& name, const std::string& text) {
    const std::string path = directory_ + "/" + name;
    server::WriteSecret(path, text);
    return path;
  }

  // Returns the line for the server's file, and writes the token to the file `name`.
  std::string NewToken(const std::string& name, const std::string& role,
                       const std::string& prefix) {
    std::vector<std::string> arguments = {
        "token", "new", name, "--role", role, "--token-out", directory_ + "/" + name};
    if (!prefix.empty()) arguments.insert(arguments.end(), {"--prefix", prefix});
    const Ran made = RunTool(arguments);
    EXPECT_EQ(made.code, 0) << made.err;
    return made.out;
  }

  std::string TokenOf(const std::string& name) {
    const absl::StatusOr<std::string> token = ReadTokenFile(directory_ + "/" + name);
    EXPECT_TRUE(token.ok()) << token.status();
    return token.ok() ? *token : "";
  }

  // Runs hullctl against the server, over TLS as `token`.
  Ran As(const std::string& token, std::vector<std::string> arguments) {
    arguments.insert(arguments.end(), {"--server", server_->address(), "--ca-cert", authorities_,
                                       "--token-file", directory_ + "/" + token});
    return RunTool(arguments);
  }

  const server::TestAuthority authority_{"authority"};
  std::string directory_;
  std::string authorities_;
  server::Config config_;
};

TEST_F(GuardedServer, TheServerAcceptsTokensMadeByHullctl) {
  Restart(config_);
  EXPECT_EQ(As("boss", {"create", "cell-10/a"}).code, 0);
  EXPECT_EQ(As("cell", {"create", "cell-1/a"}).code, 0);
  const Ran list = As("cell", {"list"});
  EXPECT_EQ(list.code, 0) << list.err;
  EXPECT_THAT(list.out, AllOf(HasSubstr("cell-1/a"), Not(HasSubstr("cell-10/a"))));
  const Ran denied = As("cell", {"get", "cell-10/a"});
  EXPECT_EQ(denied.code, 1);
  EXPECT_THAT(denied.err, HasSubstr("is outside the prefix \"cell-1/\""));
  const Ran role = As("view", {"delete", "cell-1/a"});
  EXPECT_EQ(role.code, 1);
  EXPECT_THAT(role.err, HasSubstr("token \"view\" has the role read-only"));
  EXPECT_THAT(As("cell", {"status"}).out, HasSubstr("hulls                  -"));
  const Ran limits = As("cell", {"status", "--output", "wide"});
  EXPECT_THAT(limits.out, AllOf(HasSubstr("max calls per client    512\n"),
                                HasSubstr("max batches per client  16\n")));
  EXPECT_EQ(RunTool({"health", "--server", server_->address(), "--ca-cert", authorities_}).out,
            "SERVING\n");
}

TEST_F(GuardedServer, EveryKindOfCallOfTheLibrarySendsTheToken) {
  Restart(config_);
  ClientOptions options;
  options.server = server_->address();
  options.security.tls = true;
  options.security.authorities = authority_.certificate();
  options.security.token = TokenOf("boss");
  const Client client(options);
  ASSERT_TRUE(client.CreateHull("h").ok());
  auto appender = client.OpenAppend("h");
  ASSERT_TRUE(appender.ok()) << appender.status();
  EXPECT_TRUE((*appender)->Finish().ok());
  EXPECT_TRUE(client.GetHullMesh("h").ok());
  v1::BatchCheckCollisionsRequest batch;
  *batch.add_placements() = server::PlacementOf("h");
  EXPECT_TRUE(
      client.BatchCheckCollisions(batch, [](const auto&) { return absl::OkStatus(); }).ok());
  v1::CollisionStreamOpen open;
  *open.add_placements() = server::PlacementOf("h");
  EXPECT_TRUE(client.OpenCollisionStream()->Open(open).ok());
  EXPECT_TRUE(client.CheckHealth().ok());
}

TEST_F(GuardedServer, TheTokenMayComeFromTheEnvironment) {
  Restart(config_);
  const std::vector<std::string> list = {"list", "--server", server_->address(), "--ca-cert",
                                         authorities_};
  const Ran none = RunTool(list);
  EXPECT_EQ(none.code, 1);
  EXPECT_THAT(none.err, AllOf(HasSubstr("has no token"), HasSubstr("--token-file")));
  setenv("HULLD_TOKEN", TokenOf("view").c_str(), 1);
  EXPECT_EQ(RunTool(list).code, 0);
  setenv("HULLD_TOKEN", "hunter2", 1);
  const Ran wrong = RunTool(list);
  EXPECT_EQ(wrong.code, 1);
  EXPECT_THAT(wrong.err, AllOf(HasSubstr("unknown or no longer valid"), Not(HasSubstr("hunter2"))));
}

TEST_F(GuardedServer, AContextStoresEverythingAServerRequires) {
  Restart(config_);
  ASSERT_EQ(setenv("XDG_CONFIG_HOME", (directory_ + "/config").c_str(), 1), 0);
  const Ran added = As("view", {"context", "add", "guarded"});
  EXPECT_EQ(added.code, 0) << added.err;
  EXPECT_EQ(added.out, "context guarded added and selected\n");
  EXPECT_EQ(RunTool({"list"}).code, 0);
  // The token of a context is for its server only.
  const Ran elsewhere = RunTool({"context", "show", "--server", "127.0.0.1:1"});
  EXPECT_EQ(elsewhere.out, "server  127.0.0.1:1  (--server)\n");
  // A variable overrides it; an option overrides both.
  setenv("HULLD_TOKEN", "hunter2", 1);
  EXPECT_EQ(RunTool({"list"}).code, 1);
  EXPECT_EQ(RunTool({"list", "--token-file", directory_ + "/view"}).code, 0);
  EXPECT_EQ(RunTool({"list", "--context", "guarded"}).code, 0);
  std::ifstream file(directory_ + "/config/hullctl/contexts.json");
  const std::string kept{std::istreambuf_iterator<char>(file), {}};
  EXPECT_THAT(kept, AllOf(HasSubstr("/view\""), Not(HasSubstr(TokenOf("view")))));
}

TEST_F(GuardedServer, MutualTlsNeedsCertAndKey) {
  config_.tls_client_ca = authorities_;
  Restart(config_);
  const server::TestIdentity client = authority_.Issue("client");
  const std::string certificate = Write("client.crt", client.certificate);
  const std::string key = Write("client.key", client.key);
  const Ran with = As("boss", {"status", "--cert", certificate, "--key", key});
  EXPECT_EQ(with.code, 0) << with.err;
  const Ran without = As("boss", {"status"});
  EXPECT_EQ(without.code, 3);
  EXPECT_THAT(without.err, HasSubstr("--cert"));
  const Ran half = As("boss", {"status", "--cert", certificate});
  EXPECT_EQ(half.code, 2);
  EXPECT_THAT(half.err, HasSubstr("set both or neither"));
}

TEST_F(GuardedServer, AFailedConnectionSuggestsARemedy) {
  Restart(config_);
  setenv("HULLD_TOKEN", TokenOf("boss").c_str(), 1);
  const auto expect = [this](std::vector<std::string> options, const std::string& hint) {
    options.insert(options.begin(), {"status", "--server", server_->address()});
    const Ran ran = RunTool(options);
    EXPECT_EQ(ran.code, 3) << hint;
    EXPECT_THAT(ran.err, HasSubstr(hint));
  };
  expect({}, "it requires TLS; pass --tls or --ca-cert");
  const server::TestAuthority other("other authority");
  expect({"--ca-cert", Write("other.crt", other.certificate())},
         "its certificate is signed by no authority in the file of --ca-cert");
  expect({"--ca-cert", authorities_, "--server-name", "elsewhere.example"}, "--server-name");

  const server::TestIdentity expired =
      authority_.Issue("hulld", std::chrono::hours(-2), std::chrono::hours(-1));
  server::Config config = config_;
  config.tls_cert = Write("expired.crt", expired.certificate);
  config.tls_key = Write("expired.key", expired.key);
  Restart(config);
  expect({"--ca-cert", authorities_}, "its certificate has expired");

  config = TestConfig();
  Restart(config);
  expect({"--ca-cert", authorities_}, "it does not use TLS");
}

TEST(ConnectionSecurity, ATokenIsNotSentUnencryptedToOtherMachines) {
  ConnectionSecurity security;
  security.token = "secret";
  EXPECT_TRUE(ValidateSecurity(security, "127.0.0.1:1").ok());
  EXPECT_TRUE(ValidateSecurity(security, "unix:/run/hulld.sock").ok());
  const absl::Status refused = ValidateSecurity(security, "hulld.example:1");
  EXPECT_THAT(std::string(refused.message()), AllOf(HasSubstr("--tls"), Not(HasSubstr("secret"))));
  security.allow_plaintext_token = true;
  EXPECT_TRUE(ValidateSecurity(security, "hulld.example:1").ok());
  security.allow_plaintext_token = false;
  security.tls = true;
  EXPECT_TRUE(ValidateSecurity(security, "hulld.example:1").ok());
  security.token = "two words";
  EXPECT_FALSE(ValidateSecurity(security, "127.0.0.1:1").ok());
}

TEST(ConnectionSecurity, TokenFilesArePrivateAndContainOneToken) {
  const std::string path = ::testing::TempDir() + "/hulld_token_file_test";
  server::WriteSecret(path, "hulld_abc\n");
  EXPECT_EQ(*ReadTokenFile(path), "hulld_abc");
  ASSERT_EQ(chmod(path.c_str(), 0640), 0);
  EXPECT_THAT(std::string(ReadTokenFile(path).status().message()), HasSubstr("chmod 600"));
  for (const char* text : {"", "\n", "hulld_abc def\n"}) {
    server::WriteSecret(path, text);
    EXPECT_THAT(std::string(ReadTokenFile(path).status().message()), Not(HasSubstr("abc")));
    EXPECT_FALSE(ReadTokenFile(path).ok());
  }
  std::remove(path.c_str());
}

TEST(HullctlToken, NewTokensAreRandomAndNeverOverwriteAFile) {
  const Ran first = RunTool({"token", "new", "a", "--role", "admin"});
  EXPECT_THAT(first.out, MatchesRegex("token +hulld_[A-Za-z0-9_-]{43}\nline +a admin \\* "
                                      "sha256:[0-9a-f]{64}\n"));
  EXPECT_NE(RunTool({"token", "new", "a", "--role", "admin"}).out, first.out);
  const std::string path = ::testing::TempDir() + "/hulld_token_new_test";
  std::ofstream(path) << "mine";
  EXPECT_EQ(RunTool({"token", "new", "a", "--role", "admin", "--token-out", path}).code, 2);
  EXPECT_EQ(RunTool({"token", "new", "a", "--role", "root"}).code, 2);
  EXPECT_EQ(RunTool({"token", "new", "a b", "--role", "admin"}).code, 2);
  EXPECT_EQ(RunTool({"token", "new", "a", "--role", "admin", "--prefix", "cell-1"}).code, 2);
  std::remove(path.c_str());
}

}  // namespace guarded_server_test
}  // namespace hulld
