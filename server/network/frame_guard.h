#ifndef HULLD_SERVER_NETWORK_FRAME_GUARD_H_
#define HULLD_SERVER_NETWORK_FRAME_GUARD_H_

#include <array>
#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <map>
#include <string_view>
#include <vector>

namespace hulld::server {

// Limits on the HTTP/2 frames of a client. No gRPC client comes near them.
struct FrameLimits {
  // A token bucket: its capacity, and the tokens added per second.
  struct Rate {
    double burst;
    double per_second;
  };

  // Bytes of a header block: HEADERS with its CONTINUATION frames. gRPC refuses headers above 8
  // KiB, but parses any number of bytes first.
  size_t header_block_bytes = 16 << 10;
  // RST_STREAM frames. Each costs gRPC 100 to 200 us (**observed**). The burst covers a client that
  // cancels all of its calls; the rate, a client with short deadlines.
  Rate resets = {256, 500};
  // Other frames without a request that gRPC answers or allocates memory for: PING, SETTINGS,
  // PRIORITY, GOAWAY, CONTINUATION, trailers, empty or padded DATA, unknown types.
  Rate control_frames = {1000, 200};
  // DATA of streams that are not open: gRPC reads it faster than it returns to other connections.
  // The burst, which first_share does not reduce, covers the data in flight when the server ends an
  // upload.
  Rate late_data = {1000, 1000};
  // Bytes of header blocks beyond kUsualHeaderBytes each.
  Rate large_header_bytes = {256 << 10, 64 << 10};
  static constexpr size_t kUsualHeaderBytes = 1024;
  // Half-open streams of a single connection, and of all connections: streams with an incomplete
  // first message. Each costs gRPC 12 KB (**observed**) and is not counted by any call of the
  // server.
  size_t half_open_streams = 100;
  size_t all_half_open_streams = 4096;
  // Bytes received of incomplete first messages of all connections. Above this, a connection with
  // more than half_open_bytes of them is closed. gRPC has a quota of its own, but crashed twice
  // when it was exhausted, in its reclaimer, on a thread without gRPC's context (**observed**).
  size_t all_half_open_bytes = 96 << 20;
  size_t half_open_bytes = 1 << 20;
  // Streams of a connection that the server has not ended. gRPC announces a limit of 100
  // concurrent streams, but does not enforce it before the client acknowledges it, and then too
  // late: it creates any number of streams first, each of 12 KB, and other connections wait for all
  // of them. Above 200, because the streams that end in a write are noted after the write.
  size_t open_streams = 256;
  // Share of each burst, except late_data, that is available when the connection begins.
  double first_share = 1;
  // WINDOW_UPDATE frames. gRPC clients send two for every 16 KiB or more that they read.
  Rate window_updates = {50'000, 50'000};
};

// Totals of all guards.
struct HalfOpenTotals {
  std::atomic<size_t> streams = 0;
  std::atomic<size_t> bytes = 0;
};

// Limits the bursts of clients that reconnect. A network's first connections begin with full
// bursts, later ones with small bursts, which grow at the usual rates. Not thread-safe.
class BurstShares {
 public:
  using Clock = std::chrono::steady_clock;
  using Network = std::array<uint8_t, 16>;

  // Returns the first_share of a new connection. Cost: O(log n) in the number of networks,
  // amortized.
  double Draw(const Network& network, Clock::time_point now);

 private:
  // Number of full bursts available immediately, and per second.
  static constexpr double kFull = 8;
  static constexpr double kFullPerSecond = 1;
  // Covers the first frames of any client: 50 control frames.
  static constexpr double kLeast = 0.05;
  static constexpr size_t kMaxNetworks = 4096;
  struct Account {
    double left = kFull;
    Clock::time_point drawn;
  };

  std::map<Network, Account> accounts_;
};

// Parses the frame headers in the bytes that a client sends on one connection, and in the server's
// replies, and detects violations of the limits. Reads and writes may have any size. Not
// thread-safe. Cost: ~10 ns per frame; allocates only for open streams.
class FrameGuard {
 public:
  using Clock = std::chrono::steady_clock;

  enum class Verdict {
    kAllowed,
    kNotHttp2,
    kHeaderBlock,
    kLargeHeaders,
    kControlFrames,
    kHalfOpenStreams,
    kOpenStreams,
    kWindowUpdates,
  };
  static constexpr size_t kVerdictCount = static_cast<size_t>(Verdict::kWindowUpdates) + 1;
  // Name in the metric: "header_block".
  static const char* Name(Verdict verdict);

  // all_half_open: must outlive this.
  FrameGuard(const FrameLimits& limits, HalfOpenTotals& all_half_open, Clock::time_point now);
  FrameGuard(const FrameGuard&) = delete;
  FrameGuard& operator=(const FrameGuard&) = delete;
  ~FrameGuard();

  // Processes the client's next bytes. If the result is not kAllowed, the connection must be
  // closed.
  Verdict Take(std::string_view bytes, Clock::time_point now);

  // Processes the next bytes that the server has sent.
  void TakeSent(std::string_view bytes);

  size_t half_open_streams() const { return half_open_.size(); }
  size_t open_streams() const { return open_.size(); }

 private:
  // A token bucket.
  struct Bucket {
    FrameLimits::Rate rate;
    double tokens;
    void Refill(double seconds);
    bool Take(double count);
  };
  struct HalfOpen {
    uint32_t stream;
    // Bytes until the message is complete, including missing bytes of its 5-byte prefix.
    uint64_t left = kPrefixBytes;
    uint32_t length = 0;
    size_t received = 0;
    int prefix_left = kPrefixBytes;
  };
  static constexpr int kPrefixBytes = 5;
  // The current frame in one direction: its header, and the number of payload bytes left.
  struct Frame {
    static constexpr size_t kHeaderBytes = 9;
    std::array<uint8_t, kHeaderBytes> header{};
    size_t header_bytes = 0;
    size_t payload_left = 0;

    uint8_t type() const { return header[3]; }
    uint8_t flags() const { return header[4]; }
    uint32_t stream() const;
    // Removes the rest of the payload, as far as it is there, from `bytes`, and returns it.
    std::string_view TakePayload(std::string_view& bytes);
    // Removes the bytes of the next header from `bytes`. Returns true once the header is complete.
    // Requires: the payload before it has been removed.
    bool TakeHeader(std::string_view& bytes);
  };

  Verdict BeginFrame();
  Verdict BeginHeaders(uint32_t stream, bool ends);
  Verdict BeginData(uint32_t stream, uint8_t flags);
  Verdict AddHeaderBytes();
  Verdict CountControlFrame();
  // Adds DATA payload to the message of its stream.
  void TakeData(std::string_view bytes);
  std::vector<HalfOpen>::iterator Find(uint32_t stream);
  void Close(std::vector<HalfOpen>::iterator stream);
  // Removes a stream from the open and the half-open ones, if it is among them.
  void End(uint32_t stream);

  const FrameLimits limits_;
  HalfOpenTotals& all_half_open_;
  // Bytes of half_open_.
  size_t half_open_bytes_ = 0;
  size_t preface_left_;
  Frame received_;
  // Stream of the DATA payload; 0: other payload.
  uint32_t data_stream_ = 0;
  size_t block_bytes_ = 0;
  uint32_t last_stream_ = 0;
  std::vector<HalfOpen> half_open_;
  std::vector<uint32_t> open_;
  Frame sent_;
  Clock::time_point refilled_;
  Bucket control_;
  Bucket resets_;
  Bucket late_data_;
  Bucket large_headers_;
  Bucket window_updates_;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_NETWORK_FRAME_GUARD_H_
