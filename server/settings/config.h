#ifndef HULLD_SERVER_SETTINGS_CONFIG_H_
#define HULLD_SERVER_SETTINGS_CONFIG_H_

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace rocksdb {
class Env;
}

namespace hulld::server {

// Limits of calls and of the store. The error of a limit names its flag.
struct Limits {
  // Largest message accepted from a client. Fits max_points_per_chunk points and
  // max_pairs_per_batch pairs at their defaults.
  uint64_t max_message_bytes = 16 << 20;
  uint64_t max_points_per_chunk = 200'000;
  // Points that one hull can receive in total. The default is the largest count that a double
  // represents exactly; no hull reaches it.
  uint64_t max_points_per_hull = uint64_t{1} << 53;
  uint64_t max_vertices_per_hull = 1'000'000;
  uint64_t max_hulls = 100'000;
  uint64_t max_pairs_per_batch = 1'000'000;
  // Placements of one batch, scene or stream; each takes about 500 bytes while it runs.
  uint64_t max_placements = 200'000;
  uint64_t max_textbook_axes = 10'000'000;
  uint64_t max_writers_per_hull = 100'000;
  // GetBody's answer, at the longest IDs, stays under the 4 MiB that every gRPC client accepts.
  uint64_t max_pieces_per_body = 10'000;
  // Memory limit, in bytes, for hulls in memory, replacements in flight, points waiting to be built
  // or stored, and the placements, pairs, and answers of batches, scenes, and streams. Messages of
  // calls and the store's buffers are not included. 0: half of the memory of the machine or of the
  // process's control group.
  uint64_t memory_limit = 0;
  // Bytes of requests from parsing to reply, and the same number again for arriving requests.
  uint64_t request_memory = 128 << 20;
  // Open connections: total, and per address, IPv6 by its first 64 bits. Each takes a descriptor
  // and about 50 KB. Unix sockets have no limit per address.
  uint64_t max_connections = 4096;
  uint64_t max_connections_per_address = 512;
  // Running calls that need no token: reflection, and health watches beyond the first of a
  // connection. A client may use one in kAnonymousShare of them.
  uint64_t max_anonymous_calls = 64;
  static constexpr uint64_t kAnonymousShare = 8;
  // Running calls, including open streams; and running calls that wait for a thread.
  uint64_t max_calls = 4096;
  uint64_t max_waiting_calls = 1024;
  // One slot in this many of max_calls and of max_calls_per_client is reserved for single calls,
  // so that long calls cannot fill either.
  static constexpr uint64_t kKeptForSingleCalls = 4;
  // Running calls of one client, including open streams. Fewer than max_waiting_calls, so that no
  // single client can cause refusals of other clients. A client is a token or, without tokens, a
  // peer address.
  uint64_t max_calls_per_client = 512;
  // Maximum open calls of one client to AppendPoints, ReplaceHull, StreamCollisions, SaveBackup,
  // reflection, and watches.
  uint64_t max_streams_per_client = 256;
  // Running calls of BatchCheckCollisions and FindCollisions, which take turns: in total, and of
  // one client.
  uint64_t max_concurrent_batches = 32;
  uint64_t max_batches_per_client = 16;
  // Maximum time per request, or per message of StreamCollisions and WatchCollisions; zero:
  // unlimited.
  std::chrono::milliseconds max_request_time{300'000};
  // Requests that take longer are logged; zero: none.
  std::chrono::milliseconds slow_request{1000};
};

// Every setting and default of the server.
struct Config {
  // "host:port", "[v6]:port" or "unix:path"; port 0 picks a free one.
  std::string listen = "127.0.0.1:50551";
  // Allows addresses that other machines can reach without TLS.
  bool insecure = false;
  // PEM files: the server's certificate with the chain to its authority, its private key, and the
  // authorities of clients. If the last is set, every client must present a certificate.
  std::string tls_cert;
  std::string tls_key;
  std::string tls_client_ca;
  // File of accepted tokens (server/access/token_table.h); empty: anyone who can connect may call.
  std::string tokens_file;
  // Threads that compute answers; 0: DefaultThreads() of resource_limits.h.
  int threads = 0;
  // Kind of store: "rocksdb", "postgres", or "memory".
  std::string store = "rocksdb";
  // The directory of "rocksdb". If empty, ParseCommandLine sets it to hulld in $XDG_STATE_HOME, or
  // in ~/.local/state, or, without a home, to ./hulld-data.
  std::string data_dir;
  // The file that contains the connection string of "postgres".
  std::string postgres_conninfo_file;
  // True to replace the active server of a "postgres" store instead of waiting for it. Command line
  // only: servers that always did this would replace each other in turn.
  bool take_over = false;
  // Number of active servers over one "postgres" database: "one" or "many".
  std::string postgres_servers = "one";
  // Durability of an acknowledged change: "sync" (on disk) or "relaxed" (written, and synced within
  // kRelaxedSyncInterval).
  std::string durability = "sync";
  // The file system of a durable store; null: the operating system's. For tests.
  rocksdb::Env* store_env = nullptr;
  // Time that running calls may take after SIGTERM before they are cancelled.
  std::chrono::milliseconds drain_timeout{10'000};
  // debug, info, warn or error.
  std::string log_level = "info";
  // text or json (one object per line).
  std::string log_format = "text";
  // "host:port" where Prometheus reads metrics over HTTP; empty: nowhere.
  std::string metrics_address;
  // Allows a metrics address that other machines can reach.
  bool metrics_insecure = false;
  Limits limits;

  bool has_tls() const { return !tls_cert.empty() || !tls_key.empty() || !tls_client_ca.empty(); }

  // Interval of checks of the files of certificates and tokens.
  static constexpr std::chrono::milliseconds kReloadInterval{1000};
  static constexpr std::chrono::milliseconds kRelaxedSyncInterval{500};
  // Interval of progress messages of a watch without changes.
  static constexpr std::chrono::milliseconds kWatchMarkInterval{1000};
  // Hulls per page of a list: the default, and the maximum.
  static constexpr uint32_t kDefaultPageSize = 100;
  static constexpr uint32_t kMaxPageSize = 1000;
  // Maximum open calls per connection; the client delays further calls. RFC 9113 (6.5.2) recommends
  // at least 100, and each call uses memory from its first header on.
  static constexpr int kCallsPerConnection = 100;
  // Time limit for the TLS handshake and the HTTP/2 settings.
  static constexpr std::chrono::milliseconds kHandshakeTimeout{10'000};
  // Long replies are split into messages of about this size.
  static constexpr size_t kReplyMessageBytes = 1 << 20;
  // Vertices of one feature of an axis, so that an answer stays under the 4 MiB that every gRPC
  // client accepts: 2 features x 65536 x (24 bytes of coordinates + at most 5 of index) = 3.6 MiB.
  static constexpr size_t kMaxFeatureVertices = 1 << 16;
  // Limits of one answer about bodies: certificates of pairs of pieces, and bytes, for the same
  // clients. A certificate of SEPARATED takes about 50 bytes, one of TOUCHING about 350.
  static constexpr uint64_t kMaxPieceCertificates = 1 << 13;
  static constexpr size_t kMaxProofBytes = (size_t{4} << 20) - (1 << 14);
  // The limit of a single row, which may be the last row of a nearly full message.
  static constexpr size_t kMaxRowProofBytes = kMaxProofBytes - kReplyMessageBytes;
  // Length of hull IDs and writer IDs.
  static constexpr size_t kMaxIdCharacters = 256;
  // Maximum points of an inline shape, whose hull is built within a call: takes a few
  // milliseconds.
  static constexpr size_t kMaxShapePoints = 4096;
};

// A parsed command line: run with `config`, or print `print` and exit if it is not empty (--help,
// --version).
struct CommandLine {
  Config config;
  std::string print;
  // --check-config: check the settings, print them, and exit.
  bool check = false;
  // Every setting in force, as lines of the TOML file.
  std::string settings;
};

// Looks up an environment variable; nullopt if it is not set.
using Environment = std::function<std::optional<std::string>(const std::string&)>;

// The variables of this process.
std::optional<std::string> ProcessEnvironment(const std::string& name);

// Returns the names of this process's environment variables that start with "HULLD_".
std::vector<std::string> ProcessVariables();

// INVALID_ARGUMENT: one of the variables is likely a misspelled setting. Other unknown names are
// accepted, such as those that Kubernetes sets for a service named hulld.
absl::Status CheckVariables(const std::vector<std::string>& names);

// Reads the settings: a flag beats its environment variable (HULLD_MAX_HULLS for --max-hulls),
// which beats the TOML file named by --config, which beats the default. arguments: without the
// program's name. INVALID_ARGUMENT: names the flag, variable or file key that is wrong.
absl::StatusOr<CommandLine> ParseCommandLine(const std::vector<std::string>& arguments,
                                             const Environment& environment);

}  // namespace hulld::server

#endif  // HULLD_SERVER_SETTINGS_CONFIG_H_
