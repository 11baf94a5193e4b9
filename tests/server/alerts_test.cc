// Tests of the alerts in docker/prometheus. Faults are injected into a running server, its metrics
// are scraped as by Prometheus, and promtool evaluates the rules over them.

#include <absl/strings/str_cat.h>
#include <absl/strings/str_join.h>
#include <gtest/gtest.h>
#include <prometheus/text_serializer.h>
#include <rocksdb/env.h>
#include <sys/resource.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <map>
#include <memory>
#include <sstream>
#include <string>
#include <vector>

#include "tests/server/harness/faulty_file_system.h"
#include "tests/server/harness/test_certificates.h"
#include "tests/server/harness/test_server.h"
#include "tests/server/harness/test_tokens.h"
#include "tests/source_tree.h"

namespace hulld::server {
namespace alerts_test {

using Fault = FaultyFileSystem::Fault;

std::string RulesFolder() { return (SourceTree() / "docker/prometheus/").string(); }

constexpr int kStepSeconds = 15;
constexpr int kStepsPerMinute = 60 / kStepSeconds;

// Returns true if `command` succeeds, and its output.
std::pair<bool, std::string> RunCommand(const std::string& command) {
  FILE* const pipe = popen((command + " 2>&1").c_str(), "r");
  if (pipe == nullptr) return {false, "cannot run it"};
  std::string output;
  char buffer[4096];
  for (size_t n = 0; (n = fread(buffer, 1, sizeof buffer, pipe)) > 0;) output.append(buffer, n);
  return {pclose(pipe) == 0, output};
}

class Alerts : public ServerTest {
 protected:
  Alerts() {
    std::string name = ::testing::TempDir() + "hulld_alerts_XXXXXX";
    directory_ = mkdtemp(name.data());
  }
  ~Alerts() override {
    TearDown();
    std::filesystem::remove_all(directory_);
  }

  void SetUp() override {
    if (!RunCommand("promtool --version").first) GTEST_SKIP() << "promtool is not installed";
    Restart(AlertsConfig());
  }

  Config AlertsConfig() {
    Config config = TestConfig();
    config.store = "rocksdb";
    config.data_dir = directory_ + "/data";
    config.store_env = env_.get();
    return config;
  }

  // Scrapes the metrics for this many minutes, at the rules' steps, calling `act` before each
  // scrape.
  void Scrape(int minutes, const std::function<void()>& act) {
    for (int i = 0; i < minutes * kStepsPerMinute; ++i, ++steps_) {
      act();
      std::istringstream lines(
          prometheus::TextSerializer().Serialize(server_->metrics().Collect()));
      for (std::string line; std::getline(lines, line);) {
        if (line.empty() || line[0] == '#') continue;
        const size_t space = line.rfind(' ');
        std::vector<std::string>& values = series_[line.substr(0, space)];
        values.resize(steps_, "_");
        values.push_back(line.substr(space + 1));
      }
    }
  }

  // Expects that exactly these alerts fire at the last step.
  void ExpectFiring(const std::vector<std::string>& alerts) {
    const std::string path = directory_ + "/test.yml";
    std::ofstream file(path);
    file << "rule_files: [" << RulesFolder()
         << "hulld.rules.yml]\nevaluation_interval: " << kStepSeconds
         << "s\ntests:\n  - interval: " << kStepSeconds << "s\n    input_series:\n"
         << "      - {series: 'up{job=\"hulld\", instance=\"a\"}', values: '1x" << steps_ << "'}\n";
    for (const auto& [name, values] : series_) {
      const size_t brace = name.find('{');
      const std::string labels =
          brace == name.npos ? "}" : absl::StrCat(", ", name.substr(brace + 1));
      file << "      - {series: '" << name.substr(0, brace) << "{job=\"hulld\", instance=\"a\""
           << labels << "', values: '" << absl::StrJoin(values, " ") << "'}\n";
    }
    file << "    promql_expr_test:\n"
         << "      - expr: group by (alertname) (ALERTS{alertstate=\"firing\"})\n"
         << "        eval_time: " << (steps_ - 1) * kStepSeconds
         << "s\n        exp_samples:" << (alerts.empty() ? " []\n" : "\n");
    for (const std::string& alert : alerts) {
      file << "          - {labels: '{alertname=\"" << alert << "\"}', value: 1}\n";
    }
    file.close();
    const auto [succeeded, output] = RunCommand("promtool test rules " + path);
    EXPECT_TRUE(succeeded) << output;
  }

  std::string directory_;
  const std::shared_ptr<FaultyFileSystem> files_ = std::make_shared<FaultyFileSystem>();
  const std::unique_ptr<rocksdb::Env> env_ = rocksdb::NewCompositeEnv(files_);
  // By series, one value for each step; "_" before the series exists.
  std::map<std::string, std::vector<std::string>> series_;
  size_t steps_ = 0;
};

TEST_F(Alerts, TheRulesAndTheirOwnTestsAreSound) {
  const auto [sound, findings] =
      RunCommand(absl::StrCat("promtool check rules ", RulesFolder(), "hulld.rules.yml"));
  EXPECT_TRUE(sound) << findings;
  const auto [passed, failures] =
      RunCommand(absl::StrCat("promtool test rules ", RulesFolder(), "hulld.*_test.yml"));
  EXPECT_TRUE(passed) << failures;
}

TEST_F(Alerts, NoneFiresWhileAServerWorks) {
  Put("cube", Cube());
  v1::CheckCollisionRequest pair;
  *pair.mutable_a() = PlacementOf("cube");
  *pair.mutable_b() = PlacementOf("cube", 9);
  int hulls = 0;
  Scrape(20, [&] {
    Put(absl::StrCat("h", ++hulls), Cube());
    Check(pair);
  });
  ExpectFiring({});
}

TEST_F(Alerts, AFullDiskIsReported) {
  Put("cube", Cube());
  Scrape(6, [] {});
  files_->SetFault(Fault::kNoSpace);
  Scrape(3, [this] { EXPECT_FALSE(Delete("cube").ok()); });
  ExpectFiring({"HulldStoreFailing", "HulldStoreReadOnly"});
  files_->SetFault(Fault::kNone);
  // The next change succeeds; five minutes later the alert has cleared.
  EXPECT_TRUE(Delete("cube").ok());
  Scrape(7, [] {});
  ExpectFiring({});
}

TEST_F(Alerts, ClientsThatHitALimitAreReported) {
  Config config = AlertsConfig();
  config.limits.max_hulls = 1;
  Restart(config);
  Create("only");
  const auto create = [this] {
    grpc::ClientContext context;
    v1::CreateHullRequest request;
    request.set_hull_id("another");
    v1::CreateHullResponse response;
    EXPECT_FALSE(hulls_->CreateHull(&context, request, &response).ok());
  };
  Scrape(12, create);
  ExpectFiring({"HulldLimitsHit"});
}

TEST_F(Alerts, CallersWithoutATokenAreReported) {
  Config config = AlertsConfig();
  config.tokens_file = directory_ + "/tokens";
  WriteSecret(config.tokens_file, TokenLine("a", "admin", "*", "secret"));
  Restart(config);
  Scrape(6, [this] {
    for (int i = 0; i < 3; ++i) EXPECT_FALSE(Delete("cube").ok());
  });
  ExpectFiring({"HulldAuthFailures"});
}

TEST_F(Alerts, DescriptorsThatRunOutAreReported) {
  rlimit before = {};
  ASSERT_EQ(getrlimit(RLIMIT_NOFILE, &before), 0);
  Scrape(12, [] {});
  ExpectFiring({});
  const double open = std::stod(series_.at("process_open_fds").back());
  rlimit low = before;
  low.rlim_cur = static_cast<rlim_t>(open * 1.1) + 1;
  ASSERT_EQ(setrlimit(RLIMIT_NOFILE, &low), 0);
  Scrape(12, [] {});
  ASSERT_EQ(setrlimit(RLIMIT_NOFILE, &before), 0);
  ExpectFiring({"HulldDescriptors"});
}

}  // namespace alerts_test
}  // namespace hulld::server
