#include "server/network/frame_guard.h"

#include <algorithm>

namespace hulld::server {
namespace {

constexpr std::string_view kPreface = "PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n";

// RFC 9113, section 6.
enum FrameType : uint8_t {
  kData = 0,
  kHeaders = 1,
  kResetStream = 3,
  kWindowUpdate = 8,
  kContinuation = 9,
};
constexpr uint8_t kEndStream = 0x1;
constexpr uint8_t kPadded = 0x8;

}  // namespace

const char* FrameGuard::Name(Verdict verdict) {
  static constexpr std::array<const char*, kVerdictCount> kNames = {
      "allowed",        "not_http2",         "header_block", "large_headers",
      "control_frames", "half_open_streams", "open_streams", "window_updates"};
  return kNames[static_cast<size_t>(verdict)];
}

double BurstShares::Draw(const Network& network, Clock::time_point now) {
  // An account that would be full again is not needed. If none is, forgets all: an attacker with so
  // many networks gains nothing from full bursts.
  if (accounts_.size() >= kMaxNetworks && !accounts_.contains(network)) {
    std::erase_if(accounts_, [now](const auto& account) {
      return now - account.second.drawn > std::chrono::duration<double>(kFull / kFullPerSecond);
    });
    if (accounts_.size() >= kMaxNetworks) accounts_.clear();
  }
  Account& account = accounts_.try_emplace(network, Account{kFull, now}).first->second;
  const double passed = std::chrono::duration<double>(now - account.drawn).count();
  account.drawn = now;
  account.left = std::min(kFull, account.left + passed * kFullPerSecond);
  const double share = std::clamp(account.left, kLeast, 1.0);
  account.left = std::max(0.0, account.left - share);
  return share;
}

FrameGuard::FrameGuard(const FrameLimits& limits, HalfOpenTotals& all_half_open,
                       Clock::time_point now)
    : limits_(limits),
      all_half_open_(all_half_open),
      preface_left_(kPreface.size()),
      refilled_(now),
      control_{limits.control_frames, limits.control_frames.burst * limits.first_share},
      resets_{limits.resets, limits.resets.burst * limits.first_share},
      late_data_{limits.late_data, limits.late_data.burst},
      large_headers_{limits.large_header_bytes,
                     limits.large_header_bytes.burst * limits.first_share},
      window_updates_{limits.window_updates, limits.window_updates.burst * limits.first_share} {}

FrameGuard::~FrameGuard() {
  all_half_open_.streams -= half_open_.size();
  all_half_open_.bytes -= half_open_bytes_;
}

bool FrameGuard::Bucket::Take(double count) {
  tokens -= count;
  return tokens >= 0;
}

void FrameGuard::Bucket::Refill(double seconds) {
  tokens = std::min(rate.burst, tokens + seconds * rate.per_second);
}

uint32_t FrameGuard::Frame::stream() const {
  return uint32_t{header[5] & 0x7fu} << 24 | uint32_t{header[6]} << 16 | uint32_t{header[7]} << 8 |
         header[8];
}

std::string_view FrameGuard::Frame::TakePayload(std::string_view& bytes) {
  const std::string_view payload = bytes.substr(0, payload_left);
  payload_left -= payload.size();
  bytes.remove_prefix(payload.size());
  return payload;
}

bool FrameGuard::Frame::TakeHeader(std::string_view& bytes) {
  const size_t taken = std::min(kHeaderBytes - header_bytes, bytes.size());
  std::copy_n(bytes.begin(), taken, header.begin() + header_bytes);
  bytes.remove_prefix(taken);
  header_bytes += taken;
  if (header_bytes < kHeaderBytes) return false;
  header_bytes = 0;
  payload_left = size_t{header[0]} << 16 | size_t{header[1]} << 8 | header[2];
  return true;
}

FrameGuard::Verdict FrameGuard::Take(std::string_view bytes, Clock::time_point now) {
  const double passed = std::chrono::duration<double>(now - refilled_).count();
  refilled_ = now;
  for (Bucket* bucket : {&control_, &resets_, &late_data_, &large_headers_, &window_updates_}) {
    bucket->Refill(passed);
  }
  while (!bytes.empty()) {
    if (preface_left_ > 0) {
      const size_t taken = std::min(preface_left_, bytes.size());
      const std::string_view expected = kPreface.substr(kPreface.size() - preface_left_, taken);
      if (bytes.substr(0, taken) != expected) return Verdict::kNotHttp2;
      preface_left_ -= taken;
      bytes.remove_prefix(taken);
    } else if (received_.payload_left > 0) {
      const std::string_view payload = received_.TakePayload(bytes);
      if (data_stream_ != 0) TakeData(payload);
    } else if (received_.TakeHeader(bytes)) {
      if (const Verdict verdict = BeginFrame(); verdict != Verdict::kAllowed) return verdict;
    }
  }
  // Checked per read rather than per frame: a client writes headers and message together, so a
  // connection that leaves streams half-open between two reads is unusual.
  const bool too_many =
      !half_open_.empty() && all_half_open_.streams > limits_.all_half_open_streams;
  const bool too_large = half_open_bytes_ > limits_.half_open_bytes &&
                         all_half_open_.bytes > limits_.all_half_open_bytes;
  return too_many || too_large ? Verdict::kHalfOpenStreams : Verdict::kAllowed;
}

void FrameGuard::TakeSent(std::string_view bytes) {
  while (!bytes.empty()) {
    if (sent_.payload_left > 0) {
      sent_.TakePayload(bytes);
    } else if (sent_.TakeHeader(bytes)) {
      const uint8_t type = sent_.type();
      const bool ends = type == kResetStream ||
                        ((type == kData || type == kHeaders) && (sent_.flags() & kEndStream) != 0);
      if (ends) End(sent_.stream());
    }
  }
}

FrameGuard::Verdict FrameGuard::BeginFrame() {
  data_stream_ = 0;
  const uint8_t flags = received_.flags();
  const uint32_t stream = received_.stream();
  switch (received_.type()) {
    case kData:
      return BeginData(stream, flags);
    case kHeaders:
      block_bytes_ = 0;
      return BeginHeaders(stream, (flags & kEndStream) != 0);
    case kContinuation:
      if (const Verdict verdict = AddHeaderBytes(); verdict != Verdict::kAllowed) return verdict;
      return CountControlFrame();
    case kResetStream:
      End(stream);
      return resets_.Take(1) ? Verdict::kAllowed : Verdict::kControlFrames;
    case kWindowUpdate:
      return window_updates_.Take(1) ? Verdict::kAllowed : Verdict::kWindowUpdates;
    default:
      return CountControlFrame();
  }
}

FrameGuard::Verdict FrameGuard::BeginHeaders(uint32_t stream, bool ends) {
  if (const Verdict verdict = AddHeaderBytes(); verdict != Verdict::kAllowed) return verdict;
  if (stream <= last_stream_) {
    // Trailers.
    if (const auto found = Find(stream); ends && found != half_open_.end()) Close(found);
    return CountControlFrame();
  }
  last_stream_ = stream;
  if (open_.size() >= limits_.open_streams) return Verdict::kOpenStreams;
  open_.push_back(stream);
  if (ends) return Verdict::kAllowed;
  if (half_open_.size() >= limits_.half_open_streams) return Verdict::kHalfOpenStreams;
  half_open_.push_back({.stream = stream});
  ++all_half_open_.streams;
  return Verdict::kAllowed;
}

FrameGuard::Verdict FrameGuard::BeginData(uint32_t stream, uint8_t flags) {
  const auto found = Find(stream);
  const bool ends = (flags & kEndStream) != 0;
  const bool is_padded = (flags & kPadded) != 0;
  if (found != half_open_.end()) {
    if (ends) {
      Close(found);
    } else if (!is_padded) {
      data_stream_ = stream;
    }
  }
  if (is_padded || (received_.payload_left == 0 && !ends)) return CountControlFrame();
  const bool is_open = std::find(open_.begin(), open_.end(), stream) != open_.end();
  return is_open || late_data_.Take(1) ? Verdict::kAllowed : Verdict::kControlFrames;
}

void FrameGuard::TakeData(std::string_view bytes) {
  const auto found = Find(data_stream_);
  if (found == half_open_.end()) return;
  HalfOpen& message = *found;
  // The prefix is a compression flag followed by a four-byte length.
  while (message.prefix_left > 0 && !bytes.empty()) {
    if (message.prefix_left < kPrefixBytes) {
      message.length = message.length << 8 | static_cast<uint8_t>(bytes.front());
    }
    bytes.remove_prefix(1);
    if (--message.prefix_left == 0) message.left = message.length;
  }
  if (message.prefix_left > 0) return;
  const size_t received = std::min<uint64_t>(message.left, bytes.size());
  message.left -= received;
  message.received += received;
  half_open_bytes_ += received;
  all_half_open_.bytes += received;
  if (message.left == 0) Close(found);
}

FrameGuard::Verdict FrameGuard::AddHeaderBytes() {
  const auto beyond = [](size_t bytes) {
    return static_cast<double>(bytes - std::min(bytes, FrameLimits::kUsualHeaderBytes));
  };
  const double before = beyond(block_bytes_);
  block_bytes_ += received_.payload_left;
  if (block_bytes_ > limits_.header_block_bytes) return Verdict::kHeaderBlock;
  return large_headers_.Take(beyond(block_bytes_) - before) ? Verdict::kAllowed
                                                            : Verdict::kLargeHeaders;
}

FrameGuard::Verdict FrameGuard::CountControlFrame() {
  return control_.Take(1) ? Verdict::kAllowed : Verdict::kControlFrames;
}

std::vector<FrameGuard::HalfOpen>::iterator FrameGuard::Find(uint32_t stream) {
  return std::find_if(half_open_.begin(), half_open_.end(),
                      [stream](const HalfOpen& open) { return open.stream == stream; });
}

void FrameGuard::Close(std::vector<HalfOpen>::iterator stream) {
  half_open_bytes_ -= stream->received;
  all_half_open_.bytes -= stream->received;
  *stream = half_open_.back();
  half_open_.pop_back();
  --all_half_open_.streams;
}

void FrameGuard::End(uint32_t stream) {
  if (const auto half_open = Find(stream); half_open != half_open_.end()) Close(half_open);
  const auto found = std::find(open_.begin(), open_.end(), stream);
  if (found == open_.end()) return;
  *found = open_.back();
  open_.pop_back();
}

}  // namespace hulld::server
