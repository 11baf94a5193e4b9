#include "server/settings/config.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <map>
#include <sstream>

namespace hulld::server {
namespace config_test {

using ::testing::HasSubstr;

class ConfigTest : public ::testing::Test {
 protected:
  absl::StatusOr<CommandLine> Parse(const std::vector<std::string>& arguments) {
    return ParseCommandLine(arguments, [this](const std::string& name) {
      const auto found = environment_.find(name);
      return found == environment_.end() ? std::nullopt : std::optional(found->second);
    });
  }

  Config Accepted(const std::vector<std::string>& arguments) {
    const absl::StatusOr<CommandLine> parsed = Parse(arguments);
    EXPECT_TRUE(parsed.ok()) << parsed.status().ToString();
    return parsed.ok() ? parsed->config : Config();
  }

  void ExpectRefused(const std::vector<std::string>& arguments, const std::string& what) {
    const absl::StatusOr<CommandLine> parsed = Parse(arguments);
    ASSERT_EQ(parsed.status().code(), absl::StatusCode::kInvalidArgument) << what;
    EXPECT_THAT(std::string(parsed.status().message()), HasSubstr(what));
  }

  std::string WriteFile(const std::string& text) {
    const std::string path = ::testing::TempDir() + "/hulld_config_test_" +
                             ::testing::UnitTest::GetInstance()->current_test_info()->name() +
                             ".toml";
    std::ofstream(path) << text;
    return path;
  }

  std::map<std::string, std::string> environment_;
};

TEST_F(ConfigTest, DefaultsAreTheDocumentedOnes) {
  const Config config = Accepted({});
  EXPECT_EQ(config.listen, "127.0.0.1:50551");
  EXPECT_FALSE(config.insecure);
  EXPECT_EQ(config.drain_timeout, std::chrono::seconds(10));
  EXPECT_EQ(config.limits.max_points_per_chunk, 200'000);
  EXPECT_EQ(config.limits.max_vertices_per_hull, 1'000'000);
  EXPECT_EQ(config.limits.max_hulls, 100'000);
  EXPECT_EQ(config.limits.max_pairs_per_batch, 1'000'000);
  EXPECT_EQ(config.limits.max_textbook_axes, 10'000'000);
}

TEST_F(ConfigTest, FlagBeatsVariableBeatsFileBeatsDefault) {
  const std::string file = WriteFile("max-hulls = 1\nmax-pairs-per-batch = 1\nthreads = 1\n");
  environment_["HULLD_MAX_HULLS"] = "2";
  environment_["HULLD_MAX_PAIRS_PER_BATCH"] = "2";
  const Config config = Accepted({"--config", file, "--max-hulls", "3"});
  EXPECT_EQ(config.limits.max_hulls, 3);
  EXPECT_EQ(config.limits.max_pairs_per_batch, 2);
  EXPECT_EQ(config.threads, 1);
  EXPECT_EQ(config.limits.max_points_per_chunk, 200'000);
}

TEST_F(ConfigTest, EverySettingCanComeFromEachSource) {
  const std::map<std::string, std::string> settings = {{"listen", "unix:/tmp/x"},
                                                       {"insecure", "true"},
                                                       {"threads", "3"},
                                                       {"store", "memory"},
                                                       {"drain-timeout", "0.5"},
                                                       {"log-level", "debug"},
                                                       {"log-format", "json"},
                                                       {"max-points-per-chunk", "11"},
                                                       {"max-vertices-per-hull", "12"},
                                                       {"max-hulls", "13"},
                                                       {"max-pairs-per-batch", "14"},
                                                       {"max-textbook-axes", "15"},
                                                       {"max-message-bytes", "16"},
                                                       {"max-points-per-hull", "27"},
                                                       {"max-placements", "28"},
                                                       {"max-connections", "31"},
                                                       {"max-connections-per-address", "32"},
                                                       {"max-anonymous-calls", "33"},
                                                       {"max-calls", "19"},
                                                       {"max-waiting-calls", "20"},
                                                       {"max-streams-per-client", "21"},
                                                       {"max-concurrent-batches", "22"},
                                                       {"max-calls-per-client", "29"},
                                                       {"max-batches-per-client", "30"},
                                                       {"max-request-time", "2.5"},
                                                       {"slow-request", "0.25"},
                                                       {"metrics-address", "127.0.0.1:1"},
                                                       {"metrics-insecure", "true"},
                                                       {"data-dir", "/tmp/d"},
                                                       {"durability", "relaxed"},
                                                       {"memory-limit", "17000000"},
                                                       {"max-writers-per-hull", "18"},
                                                       {"max-pieces-per-body", "19"},
                                                       {"tls-cert", "/c"},
                                                       {"tls-key", "/k"},
                                                       {"tls-client-ca", "/a"},
                                                       {"tokens-file", "/t"}};
  std::vector<std::string> flags;
  std::map<std::string, std::string> variables;
  std::string toml;
  for (const auto& [name, value] : settings) {
    flags.push_back("--" + name + "=" + value);
    std::string variable = "HULLD_";
    for (const char c : name) variable.push_back(c == '-' ? '_' : static_cast<char>(toupper(c)));
    variables[variable] = value;
    const bool is_text = name == "listen" || name == "metrics-address" || name == "store" ||
                         name == "durability" || name.starts_with("log") || value.starts_with("/");
    toml += name + " = " + (is_text ? "\"" + value + "\"" : value) + "\n";
  }
  const auto expect_all = [](const Config& config) {
    EXPECT_EQ(config.listen, "unix:/tmp/x");
    EXPECT_TRUE(config.insecure);
    EXPECT_EQ(config.threads, 3);
    EXPECT_EQ(config.drain_timeout, std::chrono::milliseconds(500));
    EXPECT_EQ(config.log_level, "debug");
    EXPECT_EQ(config.log_format, "json");
    EXPECT_EQ(config.limits.max_points_per_chunk, 11);
    EXPECT_EQ(config.limits.max_vertices_per_hull, 12);
    EXPECT_EQ(config.limits.max_hulls, 13);
    EXPECT_EQ(config.limits.max_pairs_per_batch, 14);
    EXPECT_EQ(config.limits.max_textbook_axes, 15);
    EXPECT_EQ(config.store, "memory");
    EXPECT_EQ(config.data_dir, "/tmp/d");
    EXPECT_EQ(config.durability, "relaxed");
    EXPECT_EQ(config.limits.memory_limit, 17000000);
    EXPECT_EQ(config.limits.max_writers_per_hull, 18);
    EXPECT_EQ(config.limits.max_pieces_per_body, 19);
    EXPECT_EQ(config.limits.max_message_bytes, 16);
    EXPECT_EQ(config.limits.max_points_per_hull, 27);
    EXPECT_EQ(config.limits.max_placements, 28);
    EXPECT_EQ(config.limits.max_connections, 31);
    EXPECT_EQ(config.limits.max_connections_per_address, 32);
    EXPECT_EQ(config.limits.max_anonymous_calls, 33);
    EXPECT_EQ(config.limits.max_calls, 19);
    EXPECT_EQ(config.limits.max_waiting_calls, 20);
    EXPECT_EQ(config.limits.max_streams_per_client, 21);
    EXPECT_EQ(config.limits.max_concurrent_batches, 22);
    EXPECT_EQ(config.limits.max_calls_per_client, 29);
    EXPECT_EQ(config.limits.max_batches_per_client, 30);
    EXPECT_EQ(config.limits.max_request_time, std::chrono::milliseconds(2500));
    EXPECT_EQ(config.limits.slow_request, std::chrono::milliseconds(250));
    EXPECT_EQ(config.metrics_address, "127.0.0.1:1");
    EXPECT_TRUE(config.metrics_insecure);
    EXPECT_EQ(config.tls_cert, "/c");
    EXPECT_EQ(config.tls_key, "/k");
    EXPECT_EQ(config.tls_client_ca, "/a");
    EXPECT_EQ(config.tokens_file, "/t");
  };
  expect_all(Accepted(flags));
  const std::string file = WriteFile(toml);
  expect_all(Accepted({"--config=" + file}));
  environment_ = {{"HULLD_CONFIG", file}};
  expect_all(Accepted({}));
  environment_ = variables;
  expect_all(Accepted({}));
}

TEST_F(ConfigTest, PostgresNeedsItsFileAndNoSettingsOfOtherStores) {
  const std::vector<std::string> postgres = {"--store=postgres", "--postgres-conninfo-file=/p"};
  EXPECT_EQ(Accepted(postgres).postgres_conninfo_file, "/p");
  EXPECT_FALSE(Accepted(postgres).take_over);
  EXPECT_TRUE(Accepted({postgres[0], postgres[1], "--take-over"}).take_over);
  ExpectRefused({"--store=postgres"}, "--postgres-conninfo-file");
  ExpectRefused({postgres[0], postgres[1], "--durability=relaxed"}, "synchronous_commit");
  ExpectRefused({"--take-over"}, "--take-over requires --store postgres");
  EXPECT_EQ(Accepted(postgres).postgres_servers, "one");
  EXPECT_EQ(Accepted({postgres[0], postgres[1], "--postgres-servers=many"}).postgres_servers,
            "many");
  ExpectRefused({postgres[0], postgres[1], "--postgres-servers=two"}, "--postgres-servers");
  ExpectRefused({"--postgres-servers=many"}, "--postgres-servers many requires --store postgres");
  ExpectRefused({postgres[0], postgres[1], "--postgres-servers=many", "--take-over"},
                "--take-over requires --postgres-servers one");
  environment_["HULLD_STORE"] = "postgres";
  environment_["HULLD_POSTGRES_CONNINFO_FILE"] = "/q";
  EXPECT_EQ(Accepted({}).postgres_conninfo_file, "/q");
  // Servers that always took over would keep taking the store from each other forever.
  environment_["HULLD_TAKE_OVER"] = "true";
  EXPECT_FALSE(Accepted({}).take_over);
}

TEST_F(ConfigTest, ErrorsNameFlagVariableOrKey) {
  ExpectRefused({"--max-hulls", "0"}, "--max-hulls: \"0\" is not a whole number from 1");
  ExpectRefused({"--max-hulls=-1"}, "--max-hulls: \"-1\" is not a whole number");
  ExpectRefused({"--max-vertices-per-hull", "4294967296"}, "--max-vertices-per-hull");
  ExpectRefused({"--drain-timeout", "nan"}, "--drain-timeout: \"nan\" is not a number of seconds");
  ExpectRefused({"--log-level", "loud"}, "--log-level");
  ExpectRefused({"--store", "disk"}, "--store");
  ExpectRefused({"--no-such-flag"}, "--no-such-flag");
  ExpectRefused({"--config", "/nonexistent.toml"}, "--config: /nonexistent.toml");
  ExpectRefused({"--config", WriteFile("max-hull = 3\n")}, "max-hull");
  environment_["HULLD_MAX_HULLS"] = "many";
  ExpectRefused({"--max-hulls=3"}, "HULLD_MAX_HULLS: --max-hulls: \"many\"");
}

TEST_F(ConfigTest, AMisspelledNameIsRefusedWithTheNearestOne) {
  ExpectRefused({"--lisen=127.0.0.1:1"}, "unknown flag --lisen; did you mean --listen?");
  ExpectRefused({"--max-hull", "3"}, "unknown flag --max-hull; did you mean --max-hulls?");
  ExpectRefused({"--log-level", "info", "doctor"},
                "\"doctor\" must come first, as in 'hulld doctor --help'");
  ExpectRefused({"docter"}, "unexpected argument \"docter\"; did you mean doctor?");
  const std::string file = WriteFile("# limits\nmax-hull = 3\n");
  ExpectRefused({"--config", file}, file + ":2: unknown key \"max-hull\"; did you mean max-hulls?");
  const auto with_variable = [](const char* name) {
    return std::string(CheckVariables({name}).message());
  };
  EXPECT_THAT(with_variable("HULLD_LISEN"),
              HasSubstr("variable HULLD_LISEN is not a setting; did you mean HULLD_LISTEN?"));
  EXPECT_THAT(with_variable("HULLD_MAX_HULL"), HasSubstr("did you mean HULLD_MAX_HULLS?"));
  // Variables of hullctl, and those that Kubernetes sets for a service named hulld.
  for (const char* name : {"HULLD_TOKEN", "HULLD_PORT", "HULLD_SERVICE_HOST", "HULLD_LISTEN"}) {
    EXPECT_EQ(with_variable(name), "") << name;
  }
}

TEST_F(ConfigTest, ErrorsOfTheFileNameItsLine) {
  const auto refused = [this](const std::string& text, const std::string& what) {
    const std::string file = WriteFile(text);
    ExpectRefused({"--config", file}, file + ":2: " + what);
  };
  refused("threads = 1\nstore = memory\n", "\"store = memory\" is not TOML: ");
  refused("threads = 1\nthreads = 2\n", "\"threads = 2\" is not TOML: ");
  refused("threads = 1\nstore\n", "\"store\" is not TOML: ");
  refused("threads = 1\nmax-hulls = [2]\n",
          "the value of max-hulls is not a string, number, or boolean");
  refused("threads = 1\n[limits]\nmax-hulls = 2\n", "unknown key \"limits\"");
  refused("threads = 1\nmax-hulls = -2\n", "--max-hulls: \"-2\" is not a whole number");
  refused("threads = 1\nconfig = \"other.toml\"\n", "unknown key \"config\"");
}

TEST_F(ConfigTest, SizesAcceptUnits) {
  EXPECT_EQ(Accepted({"--memory-limit=1GB"}).limits.memory_limit, 1'000'000'000);
  EXPECT_EQ(Accepted({"--memory-limit=64MiB"}).limits.memory_limit, 64 << 20);
  EXPECT_EQ(Accepted({"--memory-limit=0"}).limits.memory_limit, 0);
  EXPECT_EQ(Accepted({"--request-memory", "32MB"}).limits.request_memory, 32'000'000);
  EXPECT_EQ(
      Accepted({"--config", WriteFile("max-message-bytes = \"4MiB\"\n")}).limits.max_message_bytes,
      4 << 20);
  ExpectRefused({"--memory-limit=10"}, "\"10\" is not a size from 16777216 to ");
  ExpectRefused({"--memory-limit=1XB"}, "or a unit: kB, MB, GB, KiB, MiB, GiB");
  ExpectRefused({"--memory-limit=-1"}, "\"-1\" is not a size");
  ExpectRefused({"--request-memory=0"}, "\"0\" is not a size from 1 to ");
  ExpectRefused({"--memory-limit=99999999999GiB"}, "is not a size");
}

TEST_F(ConfigTest, TheInvalidVariableAmongSeveralIsNamed) {
  // --listen is read before --max-hulls.
  ASSERT_EQ(setenv("HULLD_LISTEN", "127.0.0.1:0", 1), 0);
  ASSERT_EQ(setenv("HULLD_MAX_HULLS", "many", 1), 0);
  const absl::StatusOr<CommandLine> parsed = ParseCommandLine({}, ProcessEnvironment);
  unsetenv("HULLD_LISTEN");
  unsetenv("HULLD_MAX_HULLS");
  EXPECT_THAT(std::string(parsed.status().message()),
              HasSubstr("HULLD_MAX_HULLS: --max-hulls: \"many\""));
}

TEST_F(ConfigTest, TheDefaultDataDirectoryFollowsXdg) {
  EXPECT_EQ(Accepted({}).data_dir, "hulld-data");
  environment_["HOME"] = "/home/me";
  EXPECT_EQ(Accepted({}).data_dir, "/home/me/.local/state/hulld");
  environment_["XDG_STATE_HOME"] = "/state";
  EXPECT_EQ(Accepted({}).data_dir, "/state/hulld");
  EXPECT_THAT(Parse({})->settings, HasSubstr("data-dir=\"/state/hulld\""));
  EXPECT_EQ(Accepted({"--data-dir", "here"}).data_dir, "here");
}

TEST_F(ConfigTest, PrintedSettingsReadBackAsTheSameSettings) {
  environment_["HULLD_TLS_CERT"] = "/c \"d\"";
  const std::vector<std::string> arguments = {"--max-hulls=7", "--insecure", "--check-config"};
  const absl::StatusOr<CommandLine> parsed = Parse(arguments);
  ASSERT_TRUE(parsed.ok());
  EXPECT_TRUE(parsed->check);
  environment_.clear();
  const absl::StatusOr<CommandLine> again = Parse({"--config", WriteFile(parsed->settings)});
  ASSERT_TRUE(again.ok()) << again.status();
  EXPECT_EQ(again->settings, parsed->settings);
  EXPECT_EQ(again->config.limits.max_hulls, 7);
  EXPECT_TRUE(again->config.insecure);
  EXPECT_FALSE(again->check);
}

TEST_F(ConfigTest, ADirectoryIsNotAFileOfSettings) {
  ExpectRefused({"--config", ::testing::TempDir()}, "it is a directory");
}

TEST_F(ConfigTest, AnEmptyValueDoesNotTakeTheNextFlag) {
  ExpectRefused({"--max-hulls=", "--insecure"}, "\"\" is not a whole number");
  const Config config = Accepted({"--data-dir=", "--insecure"});
  EXPECT_NE(config.data_dir, "--insecure");
  EXPECT_TRUE(config.insecure);
}

TEST_F(ConfigTest, ThreadsAreAWholeNumber) {
  ExpectRefused({"--threads", "2.5"}, "\"2.5\" is not a whole number from 0 to 1024");
}

TEST_F(ConfigTest, HelpNamesEveryFlagAndVersionIsPrinted) {
  const absl::StatusOr<CommandLine> help = Parse({"--help"});
  ASSERT_TRUE(help.ok());
  for (const char* flag : {"--listen",
                           "--insecure",
                           "--threads",
                           "--store",
                           "--drain-timeout",
                           "--log-level",
                           "--log-format",
                           "--max-points-per-chunk",
                           "--max-vertices-per-hull",
                           "--max-hulls",
                           "--max-pairs-per-batch",
                           "--max-textbook-axes",
                           "--max-message-bytes",
                           "--data-dir",
                           "--durability",
                           "--postgres-conninfo-file",
                           "--postgres-servers",
                           "--take-over",
                           "--memory-limit",
                           "--max-writers-per-hull",
                           "--max-pieces-per-body",
                           "--max-points-per-hull",
                           "--max-placements",
                           "--max-calls",
                           "--max-waiting-calls",
                           "--max-streams-per-client",
                           "--max-concurrent-batches",
                           "--max-request-time",
                           "--slow-request",
                           "--metrics-address",
                           "--metrics-insecure",
                           "--config",
                           "--tls-cert",
                           "--tls-key",
                           "--tls-client-ca",
                           "--tokens-file",
                           "--check-config"}) {
    EXPECT_THAT(help->print, HasSubstr(flag));
  }
  EXPECT_THAT(help->print, HasSubstr("HULLD_MAX_HULLS"));
  EXPECT_THAT(help->print, HasSubstr("--memory-limit SIZE"));
  std::istringstream lines(help->print);
  for (std::string line; std::getline(lines, line);) EXPECT_LE(line.size(), 100U) << line;
  EXPECT_EQ(Parse({"--version"})->print, "hulld " HULLD_VERSION "\n");
}

}  // namespace config_test
}  // namespace hulld::server
