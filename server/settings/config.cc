#include "server/settings/config.h"

#include <absl/status/status.h>
#include <absl/strings/numbers.h>
#include <absl/strings/str_cat.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cctype>
#include <charconv>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>
#include <memory>
#include <numeric>
#include <sstream>
#include <utility>

#define TOML_EXCEPTIONS 0
#include <toml++/toml.h>

namespace hulld::server {
namespace {

constexpr uint64_t kMaxVertexIndex = std::numeric_limits<uint32_t>::max();
// Answers contain the index of a piece as a signed number.
constexpr uint64_t kMaxPieceIndex = std::numeric_limits<int32_t>::max();
constexpr uint64_t kMaxGrpcMessageBytes = std::numeric_limits<int32_t>::max();

constexpr uint64_t kAnyNumber = std::numeric_limits<uint64_t>::max();
// Minimum --memory-limit: one message of the default maximum size.
constexpr uint64_t kMinMemory = 16 << 20;
constexpr char kVariablePrefix[] = "HULLD_";

std::string EnvironmentName(std::string flag) {
  for (char& c : flag) c = c == '-' ? '_' : static_cast<char>(std::toupper(c));
  return kVariablePrefix + flag;
}

// Returns the number of insertions, deletions, and replacements that turn `a` into `b`.
size_t EditDistance(const std::string& a, const std::string& b) {
  std::vector<size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), 0);
  for (size_t i = 0; i < a.size(); ++i) {
    size_t diagonal = std::exchange(row[0], i + 1);
    for (size_t j = 0; j < b.size(); ++j) {
      const size_t replaced = diagonal + (a[i] == b[j] ? 0 : 1);
      diagonal = row[j + 1];
      row[j + 1] = std::min({replaced, diagonal + 1, row[j] + 1});
    }
  }
  return row.back();
}

// Returns the known word nearest to a misspelled one; empty if none is near.
std::string Nearest(const std::string& word, const std::vector<std::string>& known) {
  std::string nearest;
  size_t min = std::max<size_t>(1, word.size() / 3) + 1;
  for (const std::string& candidate : known) {
    const size_t distance = EditDistance(word, candidate);
    if (distance >= min) continue;
    min = distance;
    nearest = candidate;
  }
  return nearest;
}

std::string Hint(const std::string& word, const std::vector<std::string>& known,
                 const std::string& prefix = "") {
  const std::string nearest = Nearest(word, known);
  return nearest.empty() ? "" : absl::StrCat("; did you mean ", prefix, nearest, "?");
}

// Parses a size such as "512MiB" into bytes.
std::optional<uint64_t> ParseSize(std::string text) {
  uint64_t bytes = 0;
  bool is_size = false;
  try {
    CLI::AsSizeValue(/*kb_is_1000=*/true)(text);
    is_size = absl::SimpleAtoi(text, &bytes);
  } catch (const CLI::ValidationError&) {
    is_size = false;
  }
  return is_size ? std::optional(bytes) : std::nullopt;
}

// Wraps descriptions, so that lines have at most 100 columns.
class HelpFormatter : public CLI::Formatter {
 public:
  std::string make_option_desc(const CLI::Option* option) const override {
    const size_t width = 100 - get_column_width();
    std::istringstream words(option->get_description());
    std::string text;
    size_t column = 0;
    for (std::string word; words >> word; column += word.size()) {
      const bool fits = column + 1 + word.size() <= width;
      if (!text.empty()) text += fits ? ' ' : '\n';
      column = text.empty() || !fits ? 0 : column + 1;
      text += word;
    }
    return text;
  }
};

// A value from a variable or a file, as an argument, and the text before its errors.
struct Setting {
  std::string argument;
  std::string where;
};

std::string ValueText(const toml::node& value) {
  if (const auto text = value.value_exact<std::string>()) return *text;
  if (const auto number = value.value_exact<int64_t>()) return absl::StrCat(*number);
  if (const auto truth = value.value_exact<bool>()) return *truth ? "true" : "false";
  if (const auto number = value.value_exact<double>()) {
    char text[32];
    return std::string(text, std::to_chars(text, std::end(text), *number).ptr);
  }
  return "";
}

std::string LineOf(const std::string& path, size_t number) {
  std::ifstream file(path);
  std::string line;
  for (size_t i = 0; i < number && std::getline(file, line);) ++i;
  return line;
}

// Returns an empty string if `text` is a number of seconds up to a day; NaN is not.
std::string CheckSeconds(const std::string& text) {
  double seconds = -1;
  if (absl::SimpleAtod(text, &seconds) && seconds >= 0 && seconds <= 86400) return "";
  return absl::StrCat("\"", text, "\" is not a number of seconds from 0 to 86400");
}

// The settings of a Config bound to the options of a parser.
class Parser {
 public:
  Parser()
      : app_("hulld stores 3D convex hulls by ID and answers exact collision queries.", "hulld") {
    AddServing();
    AddGuard();
    AddLimits();
    Add("config", config_file_, "TOML file with the same settings, as in: max-hulls = 1000")
        ->configurable(false);
    app_.formatter(std::make_shared<HelpFormatter>());
    app_.set_version_flag("--version", std::string("hulld ") + HULLD_VERSION);
    app_.footer(
        "Precedence: flag, environment variable, file, default.\n"
        "A SIZE is a number of bytes, or has a unit: kB, MB, GB, KiB, MiB, GiB, as in 512MiB.\n"
        "'hulld doctor --help' explains how to audit a store, 'hulld migrate --help' how to move "
        "one.");
  }

  std::vector<Setting> FromEnvironment(const Environment& environment) const {
    std::vector<Setting> settings;
    for (const CLI::Option* option : app_.get_options()) {
      const std::string variable = option->get_envname();
      if (variable.empty()) continue;
      const std::optional<std::string> value = environment(variable);
      if (value.has_value() && !value->empty()) {
        settings.push_back({option->get_name() + "=" + *value, variable + ": "});
      }
    }
    return settings;
  }

  // INVALID_ARGUMENT, naming the file and the line: not TOML, an unknown key, or a value that is
  // not a string, number, or boolean.
  absl::StatusOr<std::vector<Setting>> FromFile(const std::string& path) const {
    std::error_code ignored;
    // Could be opened, but would be read as an empty file.
    if (std::filesystem::is_directory(path, ignored)) {
      return absl::InvalidArgumentError(absl::StrCat("--config: ", path, ": it is a directory"));
    }
    const toml::parse_result table = toml::parse_file(path);
    if (!table) {
      const uint32_t line = table.error().source().begin.line;
      if (line == 0) {
        return absl::InvalidArgumentError(
            absl::StrCat("--config: ", path, ": ", std::string(table.error().description())));
      }
      return absl::InvalidArgumentError(absl::StrCat(
          path, ":", line, ": \"", LineOf(path, line), "\" is not TOML: ",
          std::string(table.error().description()), "; a setting is KEY = VALUE, text in quotes"));
    }
    const std::vector<std::string> known =
        NamesOf([](const CLI::Option& option) { return option.get_configurable(); });
    std::vector<Setting> settings;
    for (const auto& [toml_key, value] : table.table()) {
      const std::string key(toml_key.str());
      const std::string where = absl::StrCat(path, ":", toml_key.source().begin.line, ": ");
      if (std::ranges::find(known, key) == known.end()) {
        return absl::InvalidArgumentError(
            absl::StrCat(where, "unknown key \"", key, "\"", Hint(key, known)));
      }
      if (!value.is_value() || value.is_date() || value.is_time() || value.is_date_time()) {
        return absl::InvalidArgumentError(
            absl::StrCat(where, "the value of ", key, " is not a string, number, or boolean"));
      }
      // An empty string stands for the default, as in an environment variable.
      const std::string text = ValueText(value);
      if (!text.empty()) settings.push_back({absl::StrCat("--", key, "=", text), where});
    }
    return settings;
  }

  // INVALID_ARGUMENT: a variable of this name is likely a misspelled setting.
  absl::Status CheckVariable(const std::string& variable) const {
    std::vector<std::string> known;
    for (const CLI::Option* option : app_.get_options()) {
      if (option->get_envname() == variable) return absl::OkStatus();
      if (!option->get_envname().empty()) {
        known.push_back(option->get_envname().substr(std::size(kVariablePrefix) - 1));
      }
    }
    const std::string hint =
        Hint(variable.substr(std::size(kVariablePrefix) - 1), known, kVariablePrefix);
    if (hint.empty()) return absl::OkStatus();
    return absl::InvalidArgumentError(
        absl::StrCat("the environment variable ", variable, " is not a setting", hint));
  }

  // Restricts Parse to its arguments. CLI11 would also read the variables of all unset options.
  void ForgetEnvironment() {
    for (CLI::Option* option : app_.get_options()) option->envname("");
  }

  // Returns OK, with `print` set for --help and --version. INVALID_ARGUMENT: the parser's error.
  absl::Status Parse(const std::vector<std::string>& arguments, CommandLine* result) {
    // CLI11 would take the argument after "--name=" as its value, and expects the reverse order.
    std::vector<std::string> reversed;
    for (const std::string& word : arguments) {
      const bool is_empty = word.starts_with("--") && word.find('=') + 1 == word.size();
      reversed.push_back(word.substr(0, word.size() - (is_empty ? 1 : 0)));
      if (is_empty) reversed.emplace_back();
    }
    std::reverse(reversed.begin(), reversed.end());
    try {
      app_.parse(std::move(reversed));
    } catch (const CLI::CallForVersion& version) {
      result->print = std::string(version.what()) + "\n";
      return absl::OkStatus();
    } catch (const CLI::CallForHelp&) {
      result->print = app_.help();
      return absl::OkStatus();
    } catch (const CLI::ExtrasError&) {
      return UnknownArgument(app_.remaining().front());
    } catch (const CLI::Error& error) {
      return absl::InvalidArgumentError(error.what());
    }
    result->config = config_;
    result->check = check_;
    result->settings = app_.config_to_str(/*default_also=*/true, /*write_description=*/false);
    return absl::OkStatus();
  }

  // File of --config after Parse; empty for none.
  const std::string& config_file() const { return config_file_; }

 private:
  // Returns the names, without dashes, of the options that satisfy `predicate`.
  template <typename Predicate>
  std::vector<std::string> NamesOf(const Predicate& predicate) const {
    std::vector<std::string> names;
    for (const CLI::Option* option : app_.get_options()) {
      if (predicate(*option)) names.push_back(option->get_single_name());
    }
    return names;
  }

  absl::Status UnknownArgument(const std::string& argument) const {
    if (argument == "doctor" || argument == "migrate") {
      return absl::InvalidArgumentError(
          absl::StrCat("\"", argument, "\" must come first, as in 'hulld ", argument, " --help'"));
    }
    if (!argument.starts_with("-")) {
      return absl::InvalidArgumentError(absl::StrCat("unexpected argument \"", argument, "\"",
                                                     Hint(argument, {"doctor", "migrate"})));
    }
    const std::string flag = argument.substr(0, argument.find('='));
    const size_t dashes = std::min(flag.find_first_not_of('-'), flag.size());
    return absl::InvalidArgumentError(absl::StrCat(
        "unknown flag ", flag,
        Hint(flag.substr(dashes), NamesOf([](const CLI::Option&) { return true; }), "--")));
  }

  // The variable of an option has its name, and its last value wins.
  static CLI::Option* WithVariable(CLI::Option* option) {
    return option->envname(EnvironmentName(option->get_single_name()))
        ->multi_option_policy(CLI::MultiOptionPolicy::TakeLast);
  }

  template <typename T>
  CLI::Option* Add(const std::string& name, T& value, const std::string& description) {
    return WithVariable(app_.add_option("--" + name, value, description))->capture_default_str();
  }

  void AddFlag(const std::string& name, bool& value, const std::string& description) {
    WithVariable(app_.add_flag("--" + name, value, description));
  }

  void AddSeconds(const std::string& name, std::chrono::milliseconds& value,
                  const std::string& description) {
    const std::function<void(const double&)> set = [&value](double seconds) {
      value = std::chrono::milliseconds(static_cast<int64_t>(seconds * 1000));
    };
    WithVariable(app_.add_option_function("--" + name, set, description))
        ->default_str(absl::StrCat(static_cast<double>(value.count()) / 1000))
        ->check(CLI::Validator(CheckSeconds, ""))
        ->type_name("SECONDS");
  }

  void AddServing() {
    Add("listen", config_.listen,
        "Address to listen on: host:port, [v6]:port or unix:path; port 0 picks a free port");
    AddFlag("insecure", config_.insecure,
            "Allow --listen without TLS on addresses that other machines can reach. Anyone on "
            "the path can then read and change all traffic, including tokens");
    Add("threads", config_.threads, "Threads that compute answers; 0: one per usable processor")
        ->check(WholeNumber(0, 1024))
        ->type_name("N");
    AddStore();
    AddSeconds("drain-timeout", config_.drain_timeout,
               "Time for running calls to finish after SIGTERM or SIGINT");
    AddObservation();
    Add("log-level", config_.log_level, "Minimum level of logged messages")
        ->check(CLI::IsMember({"debug", "info", "warn", "error"}));
    Add("log-format", config_.log_format, "Log as text or as one JSON object per line")
        ->check(CLI::IsMember({"text", "json"}));
  }

  void AddStore() {
    Add("store", config_.store,
        "Where to store hulls: on disk, in a PostgreSQL database, or in memory until the server "
        "exits")
        ->check(CLI::IsMember({"rocksdb", "postgres", "memory"}));
    Add("data-dir", config_.data_dir,
        "Directory of --store rocksdb; created if missing. Default: hulld in $XDG_STATE_HOME, or "
        "in "
        "~/.local/state, or else ./hulld-data");
    Add("durability", config_.durability,
        "Acknowledge changes when they are on disk (sync), or when the operating system has them "
        "(relaxed); a machine crash can then lose the most recent ones")
        ->check(CLI::IsMember({"sync", "relaxed"}));
    Add("postgres-conninfo-file", config_.postgres_conninfo_file,
        "File with the connection string for --store postgres, readable only by hulld");
    Add("postgres-servers", config_.postgres_servers,
        "With --store postgres: one active server per database, with the rest on standby, or many "
        "active servers, all with this setting")
        ->check(CLI::IsMember({"one", "many"}));
    app_.add_flag("--take-over", config_.take_over,
                  "With --store postgres: replace the active server, which then exits, instead of "
                  "waiting for it to exit; command line only")
        ->configurable(false);
  }

  void AddObservation() {
    Add("metrics-address", config_.metrics_address,
        "Address that serves Prometheus metrics over HTTP (/metrics): host:port; empty: none");
    AddFlag("metrics-insecure", config_.metrics_insecure,
            "Allow --metrics-address on addresses that other machines can reach; metrics are "
            "neither encrypted nor authenticated");
    AddSeconds("slow-request", config_.limits.slow_request,
               "Log requests that take longer than this; 0: none");
  }

  void AddGuard() {
    Add("tls-cert", config_.tls_cert,
        "PEM file with the server's certificate chain; reloaded when it changes, as are the next "
        "three files");
    Add("tls-key", config_.tls_key,
        "PEM file with the private key of --tls-cert, readable only by hulld");
    Add("tls-client-ca", config_.tls_client_ca,
        "PEM file with the authorities of client certificates, which clients must then present");
    Add("tokens-file", config_.tokens_file,
        "File of accepted tokens, created by 'hullctl token new'; every caller then needs one");
    app_.add_flag(
            "--check-config", check_,
            "Check the settings and the files that they name, print them, and exit with 0 or 2")
        ->configurable(false);
  }

  void AddLimits() {
    Limits& limits = config_.limits;
    AddLimit("max-points-per-chunk", limits.max_points_per_chunk,
             "Points in one message of AppendPoints");
    AddLimit("max-vertices-per-hull", limits.max_vertices_per_hull, "Vertices of one hull",
             kMaxVertexIndex);
    AddLimit("max-hulls", limits.max_hulls, "Hulls and bodies in the store");
    AddLimit("max-pairs-per-batch", limits.max_pairs_per_batch,
             "Pairs in one BatchCheckCollisions");
    AddLimit("max-textbook-axes", limits.max_textbook_axes,
             "Candidate axes of one pair under TEXTBOOK_SAT");
    AddLimit("max-writers-per-hull", limits.max_writers_per_hull,
             "Writers of one hull, for which the server stores sequence numbers");
    AddLimit(
        "max-pieces-per-body", limits.max_pieces_per_body,
        "Pieces of one body; with more than 10000, a reply of GetBody may exceed the default limit "
        "of gRPC clients, 4 MiB",
        kMaxPieceIndex);
    AddSize(
        "memory-limit", limits.memory_limit,
        "Memory for hulls, points in flight, replacements in progress, and the placements, pairs, "
        "and answers of batches, scenes, and streams. Excludes the messages of calls and the "
        "store's own buffers. 0: half of the memory of the machine or the control group",
        kAnyNumber, kMinMemory);
    AddSize("request-memory", limits.request_memory,
            "Memory for requests in flight, and as much again for requests that are being received",
            kAnyNumber, 1);
    AddSize("max-message-bytes", limits.max_message_bytes, "Size of one message from a client",
            kMaxGrpcMessageBytes, 1);
    AddLimit("max-points-per-hull", limits.max_points_per_hull,
             "Points that one hull can receive in total");
    AddLimit("max-placements", limits.max_placements,
             "Placements of one batch, scene, or stream of poses");
    AddCallLimits();
  }

  void AddCallLimits() {
    Limits& limits = config_.limits;
    AddLimit("max-connections", limits.max_connections,
             "Open connections; beyond the limit, the one that has been idle longest is closed");
    AddLimit("max-connections-per-address", limits.max_connections_per_address,
             "Open connections of one address, IPv6 by its first 64 bits; unix sockets are exempt");
    AddLimit(
        "max-anonymous-calls", limits.max_anonymous_calls,
        "Open streams that need no token: reflection, and health watches beyond the first of a "
        "connection");
    AddLimit("max-calls", limits.max_calls, "Concurrent calls, including open streams");
    AddLimit("max-waiting-calls", limits.max_waiting_calls,
             "Calls waiting for a thread; more are refused");
    AddLimit(
        "max-calls-per-client", limits.max_calls_per_client,
        "Concurrent calls of one client (a token or, without tokens, an address), including open "
        "streams");
    AddLimit("max-streams-per-client", limits.max_streams_per_client,
             "Open streams of points or poses of one client");
    AddLimit("max-concurrent-batches", limits.max_concurrent_batches,
             "Concurrent batches and scenes");
    AddLimit("max-batches-per-client", limits.max_batches_per_client,
             "Concurrent batches and scenes of one client");
    AddSeconds("max-request-time", limits.max_request_time,
               "Maximum time for one request; for streams of poses, per message; streams of points "
               "are exempt; 0: unlimited");
  }

  // CLI::Range alone would take -1 for the largest number.
  static CLI::Validator WholeNumber(uint64_t min, uint64_t max) {
    const auto check = [=](const std::string& text) -> std::string {
      uint64_t number = 0;
      if (absl::SimpleAtoi(text, &number) && number >= min && number <= max) return "";
      return absl::StrCat("\"", text, "\" is not a whole number from ", min, " to ", max);
    };
    return CLI::Validator(check, "");
  }

  void AddLimit(const std::string& name, uint64_t& value, const std::string& description,
                uint64_t max = kAnyNumber) {
    Add(name, value, description)->check(WholeNumber(1, max))->type_name("N");
  }

  // Adds a size in bytes. A default of 0 is also accepted as a value.
  void AddSize(const std::string& name, uint64_t& value, const std::string& description,
               uint64_t max, uint64_t min) {
    const bool takes_zero = value == 0;
    const auto read = [=](std::string& text) -> std::string {
      const std::optional<uint64_t> size = ParseSize(text);
      if (size.has_value() && ((*size >= min && *size <= max) || (takes_zero && *size == 0))) {
        text = absl::StrCat(*size);
        return "";
      }
      return absl::StrCat("\"", text, "\" is not a size from ", min, " to ", max, " bytes",
                          takes_zero ? ", or 0" : "",
                          "; give a number of bytes, or a unit: kB, MB, GB, KiB, MiB, GiB");
    };
    Add(name, value, description)->transform(CLI::Validator(read, ""))->type_name("SIZE");
  }

  CLI::App app_;
  Config config_;
  std::string config_file_;
  bool check_ = false;
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
  const bool is_many = config.postgres_servers == "many";
  const std::pair<bool, const char*> errors[] = {
      {is_postgres && config.postgres_conninfo_file.empty(),
       "--store postgres requires --postgres-conninfo-file, a file with the connection string"},
      {is_postgres && config.durability != "sync",
       "--durability relaxed requires --store rocksdb; with --store postgres, configure the "
       "database: ALTER ROLE ... SET synchronous_commit = off"},
      {config.take_over && !is_postgres, "--take-over requires --store postgres"},
      {is_many && !is_postgres, "--postgres-servers many requires --store postgres"},
      {is_many && config.take_over,
       "--take-over requires --postgres-servers one; with many, no server is replaced"},
  };
  for (const auto& [is_wrong, message] : errors) {
    if (is_wrong) return absl::InvalidArgumentError(message);
  }
  return absl::OkStatus();
}

absl::Status WithAdvice(const absl::Status& status, const std::string& where) {
  return absl::InvalidArgumentError(
      absl::StrCat(where, status.message(), " (hulld --help lists the settings)"));
}

}  // namespace

std::optional<std::string> ProcessEnvironment(const std::string& name) {
  const char* value = std::getenv(name.c_str());
  if (value == nullptr) return std::nullopt;
  return value;
}

std::vector<std::string> ProcessVariables() {
  std::vector<std::string> names;
  for (char** variable = environ; *variable != nullptr; ++variable) {
    const std::string entry = *variable;
    if (entry.starts_with(kVariablePrefix)) names.push_back(entry.substr(0, entry.find('=')));
  }
  return names;
}

absl::Status CheckVariables(const std::vector<std::string>& names) {
  for (const std::string& name : names) {
    if (absl::Status s = Parser().CheckVariable(name); !s.ok()) return WithAdvice(s, "");
  }
  return absl::OkStatus();
}

absl::StatusOr<CommandLine> ParseCommandLine(const std::vector<std::string>& arguments,
                                             const Environment& environment) {
  CommandLine result;
  // Parses each setting alone first, so that an error can name its source; then adds it to `all`.
  std::vector<std::string> all;
  const auto take = [&](const std::vector<Setting>& settings) -> absl::Status {
    for (const Setting& setting : settings) {
      Parser parser;
      parser.ForgetEnvironment();
      const absl::Status status = parser.Parse({setting.argument}, &result);
      if (!status.ok()) return WithAdvice(status, setting.where);
      all.push_back(setting.argument);
    }
    return absl::OkStatus();
  };
  const std::vector<Setting> from_environment = Parser().FromEnvironment(environment);
  if (absl::Status s = take(from_environment); !s.ok()) return s;
  all.insert(all.end(), arguments.begin(), arguments.end());
  result = CommandLine();
  Parser parser;
  if (absl::Status s = parser.Parse(all, &result); !s.ok()) return WithAdvice(s, "");
  if (result.print.empty() && !parser.config_file().empty()) {
    const auto from_file = parser.FromFile(parser.config_file());
    if (!from_file.ok()) return WithAdvice(from_file.status(), "");
    // The last value of an option wins.
    const std::vector<std::string> stronger = std::exchange(all, {});
    if (absl::Status s = take(*from_file); !s.ok()) return s;
    all.insert(all.end(), stronger.begin(), stronger.end());
    result = CommandLine();
    if (absl::Status s = Parser().Parse(all, &result); !s.ok()) return WithAdvice(s, "");
  }
  if (absl::Status s = CheckStore(result.config); !s.ok()) return WithAdvice(s, "");
  if (result.config.data_dir.empty()) {
    all.push_back("--data-dir=" + DefaultDataDir(environment));
    result = CommandLine();
    if (absl::Status s = Parser().Parse(all, &result); !s.ok()) return WithAdvice(s, "");
  }
  return result;
}

}  // namespace hulld::server
