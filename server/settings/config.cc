#include "server/settings/config.h"

#include <absl/status/status.h>
#include <absl/strings/str_cat.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cctype>
#include <charconv>
#include <cstdlib>
#include <limits>
#include <memory>

namespace hulld::server {
namespace {

constexpr uint64_t kMaxVertexIndex = std::numeric_limits<uint32_t>::max();
// Answers hold the index of a piece as a signed number.
constexpr uint64_t kMaxPieceIndex = std::numeric_limits<int32_t>::max();
constexpr uint64_t kMaxGrpcMessageBytes = std::numeric_limits<int32_t>::max();

std::string EnvironmentName(std::string flag) {
  for (char& c : flag) c = c == '-' ? '_' : static_cast<char>(std::toupper(c));
  return "HULLD_" + flag;
}

// Returns an empty string if `text` is a number of seconds up to a day; NaN is not.
std::string CheckSeconds(const std::string& text) {
  double seconds = -1;
  const char* end = text.data() + text.size();
  const auto [parsed, error] = std::from_chars(text.data(), end, seconds);
  if (error == std::errc() && parsed == end && seconds >= 0 && seconds <= 86400) return "";
  return absl::StrCat("\"", text, "\" is not a number of seconds from 0 to 86400");
}

// The settings of a Config bound to the options of one parser.
class Parser {
 public:
  Parser()
      : app_("hulld stores 3D convex hulls by ID and answers exact collision queries.", "hulld") {
    AddServing();
    AddGuard();
    AddLimits();
    app_.set_config("--config", "", "TOML file with the same settings, as in: max-hulls = 1000")
        ->envname(EnvironmentName("config"))
        ->multi_option_policy(CLI::MultiOptionPolicy::TakeLast);
    app_.allow_config_extras(CLI::config_extras_mode::error);
    app_.set_version_flag("--version", std::string("hulld ") + HULLD_VERSION);
    app_.footer(
        "Precedence: flag, environment variable, file, default.\n"
        "See 'hulld doctor --help' to audit a store and 'hulld migrate --help' to copy one.");
  }

  // Returns the environment variables as arguments.
  std::vector<std::string> FromEnvironment(const Environment& environment) const {
    std::vector<std::string> arguments;
    for (const CLI::Option* option : app_.get_options()) {
      const std::string variable = option->get_envname();
      if (variable.empty()) continue;
      const std::optional<std::string> value = environment(variable);
      if (value.has_value() && !value->empty()) {
        arguments.push_back(option->get_name() + "=" + *value);
      }
    }
    return arguments;
  }

  // Restricts Parse to its arguments. CLI11 would also read the variables of all unset options.
  void ForgetEnvironment() {
    for (CLI::Option* option : app_.get_options()) option->envname("");
  }

  // Returns OK, with `print` set for --help and --version. INVALID_ARGUMENT: the parser's error.
  absl::Status Parse(std::vector<std::string> arguments, CommandLine* result) {
    std::reverse(arguments.begin(), arguments.end());  // CLI11 consumes arguments from the back.
    try {
      app_.parse(std::move(arguments));
    } catch (const CLI::CallForVersion& version) {
      result->print = std::string(version.what()) + "\n";
      return absl::OkStatus();
    } catch (const CLI::CallForHelp&) {
      result->print = app_.help();
      return absl::OkStatus();
    } catch (const CLI::ConfigError& error) {
      return absl::InvalidArgumentError(
          absl::StrCat("--config: the file has an unknown key: ", error.what()));
    } catch (const CLI::FileError& error) {
      return absl::InvalidArgumentError(absl::StrCat("--config: ", error.what()));
    } catch (const CLI::Error& error) {
      return absl::InvalidArgumentError(error.what());
    }
    config_.drain_timeout = ToMilliseconds(drain_timeout_seconds_);
    config_.limits.max_request_time = ToMilliseconds(max_request_seconds_);
    config_.limits.slow_request = ToMilliseconds(slow_request_seconds_);
    result->config = config_;
    result->check = check_;
    result->settings = app_.config_to_str(/*default_also=*/true, /*write_description=*/false);
    return absl::OkStatus();
  }

 private:
  template <typename T>
  CLI::Option* Add(const std::string& name, T& value, const std::string& description) {
    return app_.add_option("--" + name, value, description)
        ->envname(EnvironmentName(name))
        ->multi_option_policy(CLI::MultiOptionPolicy::TakeLast)
        ->capture_default_str();
  }

  static std::chrono::milliseconds ToMilliseconds(double seconds) {
    return std::chrono::milliseconds(static_cast<int64_t>(seconds * 1000));
  }

  static double ToSeconds(std::chrono::milliseconds time) {
    return static_cast<double>(time.count()) / 1000;
  }

  void AddServing() {
    Add("listen", config_.listen,
        "Address to listen on: host:port, [v6]:port, or unix:path; port 0 picks a free port");
    app_.add_flag("--insecure", config_.insecure,
                  "Allow --listen without TLS on addresses reachable from other machines; the "
                  "network can then read and change all traffic, including tokens")
        ->envname(EnvironmentName("insecure"))
        ->multi_option_policy(CLI::MultiOptionPolicy::TakeLast);
    Add("threads", config_.threads, "Query threads; 0: one per available processor")
        ->check(CLI::Range(0, 1024));
    AddStore();
    Add("drain-timeout", drain_timeout_seconds_,
        "Seconds that running calls may take after SIGTERM or SIGINT")
        ->check(CLI::Validator(CheckSeconds, ""));
    AddObservation();
    Add("log-level", config_.log_level, "Minimum level of logged messages")
        ->check(CLI::IsMember({"debug", "info", "warn", "error"}));
    Add("log-format", config_.log_format, "Log as text or as one JSON object per line")
        ->check(CLI::IsMember({"text", "json"}));
  }

  void AddStore() {
    Add("store", config_.store,
        "Where hulls are stored: on disk, in a PostgreSQL database, or in memory until the server "
        "exits")
        ->check(CLI::IsMember({"rocksdb", "postgres", "memory"}));
    Add("data-dir", config_.data_dir,
        "Directory of --store rocksdb; created if missing. Default: hulld in $XDG_STATE_HOME, or "
        "in "
        "~/.local/state, or else ./hulld-data");
    Add("durability", config_.durability,
        "Acknowledge changes when they are on disk (sync), or when the operating system has them "
        "(relaxed); a crash of the machine can lose relaxed changes")
        ->check(CLI::IsMember({"sync", "relaxed"}));
    Add("postgres-conninfo-file", config_.postgres_conninfo_file,
        "File with the connection string of --store postgres; only hulld may be able to read it");
    Add("postgres-servers", config_.postgres_servers,
        "With --store postgres: one server is active on a database while further ones wait, or "
        "many are active, all with this setting")
        ->check(CLI::IsMember({"one", "many"}));
    app_.add_flag("--take-over", config_.take_over,
                  "With --store postgres: replace the active server, which then exits, instead of "
                  "waiting for it; command line only")
        ->configurable(false);
  }

  void AddObservation() {
    Add("metrics-address", config_.metrics_address,
        "Address of the Prometheus endpoint (/metrics): host:port; empty: disabled");
    app_.add_flag("--metrics-insecure", config_.metrics_insecure,
                  "Allow --metrics-address on addresses reachable from other machines; metrics are "
                  "neither encrypted nor authenticated")
        ->envname(EnvironmentName("metrics-insecure"))
        ->multi_option_policy(CLI::MultiOptionPolicy::TakeLast);
    Add("slow-request", slow_request_seconds_,
        "Log requests that take longer than this many seconds; 0: none")
        ->check(CLI::Validator(CheckSeconds, ""));
  }

  void AddGuard() {
    Add("tls-cert", config_.tls_cert,
        "PEM file of the server's certificate chain; reloaded when it changes, like the next "
        "three");
    Add("tls-key", config_.tls_key,
        "PEM file of its private key; only hulld may be able to read it");
    Add("tls-client-ca", config_.tls_client_ca,
        "PEM file of the client CAs; clients must then present a certificate");
    Add("tokens-file", config_.tokens_file,
        "File of accepted tokens, written by 'hullctl token new'; calls must then carry a token");
    app_.add_flag("--check-config", check_,
                  "Check the settings and their files, print them, and exit with 0 or 2")
        ->configurable(false);
  }

  void AddLimits() {
    Limits& limits = config_.limits;
    constexpr uint64_t kAny = std::numeric_limits<uint64_t>::max();
    AddLimit("max-points-per-chunk", limits.max_points_per_chunk,
             "Points in one message of AppendPoints", kAny);
    AddLimit("max-vertices-per-hull", limits.max_vertices_per_hull, "Vertices of one hull",
             kMaxVertexIndex);
    AddLimit("max-hulls", limits.max_hulls, "Hulls and bodies in the store", kAny);
    AddLimit("max-pairs-per-batch", limits.max_pairs_per_batch, "Pairs in one BatchCheckCollisions",
             kAny);
    AddLimit("max-textbook-axes", limits.max_textbook_axes,
             "Candidate axes of one pair under TEXTBOOK_SAT", kAny);
    AddLimit("max-writers-per-hull", limits.max_writers_per_hull,
             "Writers of one hull with a stored sequence", kAny);
    AddLimit("max-pieces-per-body", limits.max_pieces_per_body,
             "Pieces of one body; answers for more than 10000 may exceed gRPC's default limit of 4 "
             "MiB for received messages",
             kMaxPieceIndex);
    AddLimit("memory-limit", limits.memory_limit,
             "Bytes of memory for hulls, points and replacements in flight, and the placements, "
             "pairs, and answers of batches, scenes, and streams; excludes messages of calls and "
             "the store's buffers; 0: half of the memory of the machine or control group",
             kAny, 0);
    AddLimit("request-memory", limits.request_memory,
             "Bytes for requests in flight, and as many again for arriving requests", kAny);
    AddLimit("max-message-bytes", limits.max_message_bytes, "Bytes of one message from a client",
             kMaxGrpcMessageBytes);
    AddLimit("max-points-per-hull", limits.max_points_per_hull,
             "Points that one hull can receive in total", kAny);
    AddLimit("max-placements", limits.max_placements,
             "Placements of one batch, scene, or stream of poses", kAny);
    AddCallLimits();
  }

  void AddCallLimits() {
    Limits& limits = config_.limits;
    constexpr uint64_t kAny = std::numeric_limits<uint64_t>::max();
    AddLimit("max-connections", limits.max_connections,
             "Open connections; above the limit, the longest idle one is closed", kAny);
    AddLimit("max-connections-per-address", limits.max_connections_per_address,
             "Open connections of one address, IPv6 by its first 64 bits; unix sockets are exempt",
             kAny);
    AddLimit("max-anonymous-calls", limits.max_anonymous_calls,
             "Open reflection streams, which require no token", kAny);
    AddLimit("max-calls", limits.max_calls, "Concurrent calls, including open streams", kAny);
    AddLimit("max-waiting-calls", limits.max_waiting_calls,
             "Calls waiting for a thread; further ones are refused", kAny);
    AddLimit("max-calls-per-client", limits.max_calls_per_client,
             "Concurrent calls of one client (a token or, without tokens, an address), including "
             "open streams",
             kAny);
    AddLimit("max-streams-per-client", limits.max_streams_per_client,
             "Open streams of points or poses of one client", kAny);
    AddLimit("max-concurrent-batches", limits.max_concurrent_batches,
             "Concurrent batches and scenes", kAny);
    AddLimit("max-batches-per-client", limits.max_batches_per_client,
             "Concurrent batches and scenes of one client", kAny);
    Add("max-request-time", max_request_seconds_,
        "Seconds per request; streams of points are exempt; for streams of poses, seconds per "
        "message; 0: unlimited")
        ->check(CLI::Validator(CheckSeconds, ""));
  }

  // CLI::Range alone would take -1 for the largest number.
  void AddLimit(const std::string& name, uint64_t& value, const std::string& description,
                uint64_t most, uint64_t least = 1) {
    const auto check = [most, least](const std::string& text) -> std::string {
      uint64_t number = 0;
      const char* end = text.data() + text.size();
      const auto [parsed, error] = std::from_chars(text.data(), end, number);
      if (error == std::errc() && parsed == end && number >= least && number <= most) return "";
      return absl::StrCat("\"", text, "\" is not a whole number from ", least, " to ", most);
    };
    Add(name, value, description)->check(CLI::Validator(check, ""));
  }

  CLI::App app_;
  Config config_;
  bool check_ = false;
  double drain_timeout_seconds_ = ToSeconds(Config().drain_timeout);
  double max_request_seconds_ = ToSeconds(Limits().max_request_time);
  double slow_request_seconds_ = ToSeconds(Limits().slow_request);
};

std::string DefaultDataDir(const Environment& environment) {
  const std::optional<std::string> state = environment("XDG_STATE_HOME");
  if (state.has_value() && !state->empty()) return *state + "/hulld";
  const std::optional<std::string> home = environment("HOME");
  if (home.has_value() && !home->empty()) return *home + "/.local/state/hulld";
  return "hulld-data";
}

// Checks combinations of settings of the store.
absl::Status CheckStore(const Config& config) {
  const bool is_postgres = config.store == "postgres";
  if (is_postgres && config.postgres_conninfo_file.empty()) {
    return absl::InvalidArgumentError(
        "--store postgres requires --postgres-conninfo-file, a file with the connection string");
  }
  if (is_postgres && config.durability != "sync") {
    return absl::InvalidArgumentError(
        "--durability relaxed requires --store rocksdb; with --store postgres, configure the "
        "database: ALTER ROLE ... SET synchronous_commit = off");
  }
  if (config.take_over && !is_postgres) {
    return absl::InvalidArgumentError("--take-over requires --store postgres");
  }
  const bool is_many = config.postgres_servers == "many";
  if (is_many && !is_postgres) {
    return absl::InvalidArgumentError("--postgres-servers many requires --store postgres");
  }
  if (is_many && config.take_over) {
    return absl::InvalidArgumentError(
        "--take-over requires --postgres-servers one; with many, no server is replaced");
  }
  return absl::OkStatus();
}

absl::Status WithAdvice(const absl::Status& status, const char* where) {
  return absl::InvalidArgumentError(
      absl::StrCat(where, status.message(), " (hulld --help lists the settings)"));
}

}  // namespace

std::optional<std::string> ProcessEnvironment(const std::string& name) {
  const char* value = std::getenv(name.c_str());
  if (value == nullptr) return std::nullopt;
  return value;
}

absl::StatusOr<CommandLine> ParseCommandLine(const std::vector<std::string>& arguments,
                                             const Environment& environment) {
  CommandLine result;
  const std::vector<std::string> variables = Parser().FromEnvironment(environment);
  // Each variable is parsed alone first, so that an error can name it.
  for (const std::string& variable : variables) {
    if (variable.starts_with("--config=")) continue;
    Parser parser;
    parser.ForgetEnvironment();
    const absl::Status status = parser.Parse({variable}, &result);
    if (!status.ok()) {
      const std::string flag = variable.substr(2, variable.find('=') - 2);
      return WithAdvice(status, absl::StrCat(EnvironmentName(flag), ": ").c_str());
    }
  }
  // The last value of an option wins, and a file only sets unset options; hence this order.
  std::vector<std::string> all = variables;
  all.insert(all.end(), arguments.begin(), arguments.end());
  result = CommandLine();
  const absl::Status status = Parser().Parse(std::move(all), &result);
  if (!status.ok()) return WithAdvice(status, "");
  if (absl::Status s = CheckStore(result.config); !s.ok()) return WithAdvice(s, "");
  if (result.config.data_dir.empty()) result.config.data_dir = DefaultDataDir(environment);
  return result;
}

}  // namespace hulld::server
