#include "client/hullctl/context/context_file.h"

#include <absl/strings/str_cat.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <thread>
#include <vector>

#include "tests/client/hullctl/hullctl_on_server.h"

namespace hulld {
namespace context_file_test {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;

SettingsLayer Options(const ConnectionSettings& settings) { return {"", settings, false}; }

TEST(Combine, EarlierLayersWinSettingBySetting) {
  const auto chosen = Combine({Options({{"server", "a:1"}}),
                               {"environment", {{"server", "b:1"}, {"ca-cert", "b.crt"}}, false},
                               {"context c", {{"server", "a:1"}, {"cert", "c.crt"}}, true}});
  EXPECT_EQ(chosen.at("server").value, "a:1");
  EXPECT_EQ(chosen.at("server").source, "--server");
  EXPECT_EQ(chosen.at("ca-cert").value, "b.crt");
  EXPECT_EQ(chosen.at("cert").source, "context c");
  EXPECT_EQ(Combine({}).at("server").source, "default");
}

TEST(Combine, AContextForAnotherServerIsIgnoredWithItsToken) {
  const SettingsLayer context{"context c", {{"server", "c:1"}, {"token-file", "c.token"}}, true};
  EXPECT_FALSE(Combine({Options({{"server", "a:1"}}), context}).contains("token-file"));
  EXPECT_TRUE(Combine({Options({{"server", "c:1"}}), context}).contains("token-file"));
  EXPECT_TRUE(Combine({Options({}), context}).contains("token-file"));
}

TEST(Combine, OneTokenIsChosen) {
  const ConnectionSettings both = {{"token", "t"}, {"token-file", "f"}};
  const auto same = Combine({{"environment", both, false}});
  EXPECT_FALSE(same.contains("token"));
  EXPECT_EQ(same.at("token-file").value, "f");
  const auto earlier =
      Combine({{"environment", {{"token", "t"}}, false}, {"context", {{"token-file", "f"}}, true}});
  EXPECT_FALSE(earlier.contains("token-file"));
  EXPECT_EQ(earlier.at("token").value, "t");
}

class Contexts : public ::testing::Test {
 protected:
  void SetUp() override {
    std::string pattern = ::testing::TempDir() + "/hulld_contexts_XXXXXX";
    ASSERT_NE(mkdtemp(pattern.data()), nullptr);
    directory_ = pattern;
    setenv("XDG_CONFIG_HOME", (directory_ + "/new/config").c_str(), 1);
    for (const char* variable : {"HULLCTL_SERVER", "HULLCTL_CONTEXT", "HULLD_TOKEN"}) {
      unsetenv(variable);
    }
  }
  ~Contexts() override {
    UseNoContexts();
    unsetenv("HULLCTL_SERVER");
    unsetenv("HULLCTL_CONTEXT");
    std::filesystem::remove_all(directory_);
  }

  void Write(const std::string& text) {
    std::filesystem::create_directories(std::filesystem::path(ContextFilePath()).parent_path());
    std::ofstream(ContextFilePath()) << text;
  }

  std::string directory_;
};

TEST_F(Contexts, AFileIsReadBackAsItWasWritten) {
  ASSERT_TRUE(ReadContextFile().ok());
  EXPECT_TRUE(ReadContextFile()->contexts.empty());
  const ContextFile file{"a",
                         {{"a", {{"server", "a:1"}, {"tls", "true"}}},
                          {"b", {{"server", "b:1"}, {"ca-cert", "/x \"y\"\\\n.crt"}}}}};
  const absl::Status written = WriteContextFile(file);
  ASSERT_TRUE(written.ok()) << written;
  const auto read = ReadContextFile();
  ASSERT_TRUE(read.ok()) << read.status();
  EXPECT_EQ(read->current, "a");
  EXPECT_EQ(read->contexts, file.contexts);
  struct stat info = {};
  ASSERT_EQ(stat(ContextFilePath().c_str(), &info), 0);
  EXPECT_EQ(info.st_mode & 0777, 0600u);
  ASSERT_TRUE(WriteContextFile({}).ok());
  // Only the file remains in its folder.
  int entries = 0;
  for (const auto& entry : std::filesystem::directory_iterator(
           std::filesystem::path(ContextFilePath()).parent_path())) {
    EXPECT_EQ(entry.path(), ContextFilePath());
    ++entries;
  }
  EXPECT_EQ(entries, 1);
}

TEST_F(Contexts, DamagedFilesAreExplained) {
  const auto problem = [this](const std::string& text) {
    Write(text);
    const Ran ran = RunTool({"list"});
    EXPECT_EQ(ran.code, 2);
    EXPECT_THAT(ran.err, AllOf(HasSubstr(ContextFilePath()), HasSubstr("fix it, or delete it")));
    EXPECT_EQ(std::count(ran.err.begin(), ran.err.end(), '\n'), 1) << ran.err;
    return ran.err;
  };
  EXPECT_THAT(problem(""), HasSubstr("not JSON"));
  EXPECT_THAT(problem("{\"contexts\":"), HasSubstr("not JSON"));
  EXPECT_THAT(problem(R"({"current":"a"})"), HasSubstr("its current context \"a\" does not exist"));
  EXPECT_THAT(problem(R"({"contexts":[]})"), HasSubstr("\"contexts\" is unknown"));
  EXPECT_THAT(problem(R"({"contexts":{"a":{}}})"), HasSubstr("context \"a\" has no server"));
  EXPECT_THAT(problem(R"({"contexts":{"a b":{"server":"a:1"}}})"), HasSubstr("a name is up to"));
  EXPECT_THAT(problem(R"({"contexts":{"a":{"server":"a:1","tls":"yes"}}})"),
              HasSubstr("tls is not true or false"));
  // A token does not belong in this file, and errors do not quote it.
  EXPECT_THAT(problem(R"({"contexts":{"a":{"server":"a:1","token":"hunter2"}}})"),
              AllOf(HasSubstr("\"token\", which is not a setting"), Not(HasSubstr("hunter2"))));
  // Commands without a server ignore the error.
  EXPECT_EQ(RunTool({"generate", "cube", "1"}).code, 0);
  Write(R"({"contexts":{"a":{"server":"nowhere"}},"current":"a"})");
  EXPECT_THAT(RunTool({"list"}).err,
              HasSubstr("server of context a: \"nowhere\" is not HOST:PORT"));
}

TEST_F(Contexts, AreAddedUsedListedAndRemoved) {
  EXPECT_EQ(RunTool({"context", "add", "a", "--server", "127.0.0.1:1"}).out,
            "context a added and selected\n");
  EXPECT_EQ(RunTool({"context", "add", "b", "--server", "b.example:1", "--tls"}).out,
            "context b added\n");
  EXPECT_THAT(RunTool({"context", "add", "a", "--server", "127.0.0.1:2"}).err,
              HasSubstr("pass --replace"));
  EXPECT_EQ(RunTool({"context", "list", "--output", "name"}).out, "a\nb\n");
  EXPECT_EQ(RunTool({"context", "list"}).out,
            "CONTEXT  SERVER       TLS  TOKEN FILE  USED\na        127.0.0.1:1  no   -           "
            "yes\nb        b.example:1  yes  -           no\n");
  EXPECT_THAT(RunTool({"context", "use", "bb"}).err,
              HasSubstr("unknown context \"bb\"; did you mean \"b\"?"));
  EXPECT_EQ(RunTool({"context", "use", "b"}).code, 0);
  EXPECT_EQ(RunTool({"context", "show", "--output", "name"}).out, "b.example:1\n");
  EXPECT_EQ(RunTool({"context", "show", "a", "--output", "name"}).out, "127.0.0.1:1\n");
  EXPECT_EQ(RunTool({"context", "remove", "b"}).code, 0);
  EXPECT_EQ(RunTool({"context", "show"}).out, "server  127.0.0.1:50551  (default)\n");
  EXPECT_EQ(RunTool({"context", "remove", "b"}).code, 2);
}

TEST_F(Contexts, ChangesAtTheSameTimeAreAllKept) {
  constexpr int kPrograms = 16;
  std::vector<std::thread> programs;
  for (int i = 0; i < kPrograms; ++i) {
    programs.emplace_back([i] {
      EXPECT_EQ(RunTool({"context", "add", absl::StrCat("c", i), "--server", "a:1"}).code, 0);
    });
  }
  for (std::thread& program : programs) program.join();
  EXPECT_EQ(ReadContextFile()->contexts.size(), kPrograms);
}

TEST_F(Contexts, PathsAreAbsolute) {
  EXPECT_EQ(RunTool({"context", "add", "a", "--server", "unix:socket"}).code, 0);
  EXPECT_EQ(ReadContextFile()->contexts.at("a").at("server"),
            "unix:" + (std::filesystem::current_path() / "socket").string());
}

TEST_F(Contexts, ASymbolicLinkIsKept) {
  const std::string target = directory_ + "/target.json";
  Write("");
  std::filesystem::remove(ContextFilePath());
  std::ofstream(target) << "{}";
  std::filesystem::create_symlink(target, ContextFilePath());
  EXPECT_EQ(RunTool({"context", "add", "a", "--server", "a:1"}).code, 0);
  EXPECT_TRUE(std::filesystem::is_symlink(ContextFilePath()));
  EXPECT_EQ(ReadContextFile()->contexts.size(), 1);
}

TEST_F(Contexts, FlagsOfTheEnvironmentAcceptAnyLetterCase) {
  for (const char* value : {"true", "True", "YES", "1"}) {
    setenv("HULLCTL_TLS", value, 1);
    EXPECT_EQ(SettingsOfEnvironment()->at("tls"), "true") << value;
  }
  setenv("HULLCTL_TLS", "Maybe", 1);
  EXPECT_THAT(std::string(SettingsOfEnvironment().status().message()), HasSubstr("\"Maybe\""));
  unsetenv("HULLCTL_TLS");
}

TEST_F(Contexts, OptionThenEnvironmentThenContextThenDefault) {
  const auto server = [](std::vector<std::string> options) {
    options.insert(options.begin(), {"context", "show", "--output", "name"});
    const Ran ran = RunTool(options);
    return ran.code == 0 ? ran.out.substr(0, ran.out.size() - 1) : ran.err;
  };
  ASSERT_EQ(RunTool({"context", "add", "a", "--server", "a:1"}).code, 0);
  ASSERT_EQ(RunTool({"context", "add", "b", "--server", "b:1"}).code, 0);
  EXPECT_EQ(server({}), "a:1");
  setenv("HULLCTL_CONTEXT", "b", 1);
  EXPECT_EQ(server({}), "b:1");
  EXPECT_EQ(server({"--context", "a"}), "a:1");
  setenv("HULLCTL_SERVER", "env:1", 1);
  EXPECT_EQ(server({}), "env:1");
  EXPECT_EQ(server({"--context", "a"}), "a:1");
  EXPECT_EQ(server({"--server", "c:1"}), "c:1");
  EXPECT_THAT(server({"--server", "c:1", "--context", "a"}),
              HasSubstr("differs from the server of --context a"));
  setenv("HULLCTL_CONTEXT", "nope", 1);
  EXPECT_THAT(server({}), HasSubstr("$HULLCTL_CONTEXT: unknown context \"nope\""));
}

TEST_F(Contexts, UnusableContextsAreNotAdded) {
  const std::string token = directory_ + "/token";
  std::ofstream(token) << "secret\n";
  chmod(token.c_str(), 0644);
  const auto error = [](std::vector<std::string> options) {
    options.insert(options.begin(), {"context", "add", "a"});
    const Ran ran = RunTool(options);
    EXPECT_EQ(ran.code, 2);
    return ran.err;
  };
  EXPECT_THAT(error({}), HasSubstr("--server HOST:PORT"));
  EXPECT_THAT(error({"--server", "a:1", "--token-file", token}), HasSubstr("chmod 600"));
  chmod(token.c_str(), 0600);
  EXPECT_THAT(error({"--server", "a:1", "--token-file", token}), HasSubstr("unencrypted"));
  EXPECT_THAT(error({"--server", "a:1", "--ca-cert", "/no/such"}),
              HasSubstr("--ca-cert: /no/such: No such file"));
  EXPECT_THAT(error({"--server", "a:1", "--ca-cert", directory_}), HasSubstr("Is a directory"));
  const std::string key = directory_ + "/key";
  std::ofstream(key) << "-----BEGIN ENCRYPTED PRIVATE KEY-----\n";
  const std::string certificate = directory_ + "/certificate";
  std::ofstream(certificate) << "-----BEGIN CERTIFICATE-----\n";
  EXPECT_THAT(error({"--server", "a:1", "--cert", certificate, "--key", key}),
              HasSubstr("without a passphrase"));
  EXPECT_TRUE(ReadContextFile()->contexts.empty());
}

}  // namespace context_file_test
}  // namespace hulld
