#include "server/network/frame_guard.h"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <string>

#include "tests/server/network/frame_bytes.h"

namespace hulld::server {
namespace frame_guard_test {

using Verdict = FrameGuard::Verdict;

class FrameGuardTest : public testing::Test {
 protected:
  Verdict Send(const std::string& bytes) { return guard_.Take(bytes, now_); }
  static std::string Open(uint32_t stream) {
    return FrameBytes(Frame::kHeaders, kEndHeadersFlag, stream, HeaderBlock("/a/b"));
  }
  static std::string Reset(uint32_t stream) {
    return FrameBytes(Frame::kResetStream, 0, stream, BigEndian(8));
  }

  FrameGuard::Clock::time_point now_{};
  HalfOpenTotals all_half_open_;
  FrameGuard guard_{FrameLimits{}, all_half_open_, now_};
};

TEST_F(FrameGuardTest, OrdinaryCallsPassInPiecesOfAnySize) {
  std::string bytes = kOpening;
  for (uint32_t stream = 1; stream < 400; stream += 2) {
    bytes += Open(stream) + FrameBytes(Frame::kData, stream % 4 == 1 ? kEndStreamFlag : 0, stream,
                                       MessageBytes("a message"));
  }
  for (const size_t piece : {size_t{1}, size_t{7}, size_t{100}, bytes.size()}) {
    FrameGuard guard(FrameLimits{}, all_half_open_, now_);
    for (size_t at = 0; at < bytes.size(); at += piece) {
      ASSERT_EQ(guard.Take(bytes.substr(at, piece), now_), Verdict::kAllowed);
    }
    EXPECT_EQ(guard.half_open_streams(), 0);
  }
  EXPECT_EQ(all_half_open_.streams, 0);
}

TEST_F(FrameGuardTest, RefusesConnectionsThatAreNotHttp2) {
  EXPECT_EQ(Send("PRI * HTTP/2.0\r\n\r\nS"), Verdict::kAllowed);
  EXPECT_EQ(Send("X"), Verdict::kNotHttp2);
}

TEST_F(FrameGuardTest, AStreamIsHalfOpenUntilItsFirstMessageIsComplete) {
  const std::string message = MessageBytes("0123456789");
  ASSERT_EQ(Send(kOpening + Open(1)), Verdict::kAllowed);
  for (const char byte : message) {
    EXPECT_EQ(guard_.half_open_streams(), 1);
    ASSERT_EQ(Send(FrameBytes(Frame::kData, 0, 1, std::string(1, byte))), Verdict::kAllowed);
  }
  EXPECT_EQ(guard_.half_open_streams(), 0);
  ASSERT_EQ(Send(Open(3) + Open(5) + Reset(3) + FrameBytes(Frame::kData, kEndStreamFlag, 5, "")),
            Verdict::kAllowed);
  EXPECT_EQ(guard_.half_open_streams(), 0);
  ASSERT_EQ(Send(Open(7) + FrameBytes(Frame::kData, 0, 7, MessageBytes(""))), Verdict::kAllowed);
  EXPECT_EQ(all_half_open_.streams, 0);
  // The server may refuse a call before its message is complete.
  ASSERT_EQ(Send(Open(9) + FrameBytes(Frame::kData, 0, 9, message.substr(0, 7))),
            Verdict::kAllowed);
  EXPECT_EQ(all_half_open_.bytes, 2);
  guard_.TakeSent(FrameBytes(Frame::kHeaders, kEndHeadersFlag | kEndStreamFlag, 9, "trailers"));
  EXPECT_EQ(all_half_open_.streams, 0);
  EXPECT_EQ(all_half_open_.bytes, 0);
}

TEST_F(FrameGuardTest, HalfOpenStreamsAreBoundedByConnectionAndInTotal) {
  ASSERT_EQ(Send(kOpening), Verdict::kAllowed);
  for (uint32_t i = 0; i < 100; ++i) ASSERT_EQ(Send(Open(2 * i + 1)), Verdict::kAllowed);
  EXPECT_EQ(Send(Open(201)), Verdict::kHalfOpenStreams);
  all_half_open_.streams = 4096;
  FrameGuard other(FrameLimits{}, all_half_open_, now_);
  // Headers and message together leave nothing half-open.
  EXPECT_EQ(
      other.Take(kOpening + Open(1) + FrameBytes(Frame::kData, 0, 1, MessageBytes("m")), now_),
      Verdict::kAllowed);
  EXPECT_EQ(other.Take(Open(3), now_), Verdict::kHalfOpenStreams);
}

// gRPC creates any number of streams that end with their headers, although it has announced a
// limit.
TEST_F(FrameGuardTest, StreamsAreOpenUntilTheServerEndsThem) {
  const auto call = [](uint32_t stream) {
    return FrameBytes(Frame::kHeaders, kEndHeadersFlag | kEndStreamFlag, stream,
                      HeaderBlock("/a/b"));
  };
  const auto message = [](uint32_t stream) {
    return FrameBytes(Frame::kHeaders, kEndHeadersFlag, stream, "headers") +
           FrameBytes(Frame::kData, 0, stream, MessageBytes(std::string(1000, 'm')));
  };
  const auto end = [](uint32_t stream) {
    return FrameBytes(Frame::kHeaders, kEndHeadersFlag | kEndStreamFlag, stream, "trailers");
  };
  ASSERT_EQ(Send(kOpening), Verdict::kAllowed);
  guard_.TakeSent(FrameBytes(Frame::kSettings, 0, 0, std::string(6, '\0')));
  uint32_t stream = 1;
  for (int i = 0; i < 256; ++i, stream += 2) ASSERT_EQ(Send(call(stream)), Verdict::kAllowed);
  EXPECT_EQ(guard_.open_streams(), 256);
  // Replies written in pieces of any size end their streams.
  for (const size_t piece : {size_t{1}, size_t{7}, size_t{5000}}) {
    const uint32_t first = stream - 2 * 256;
    const std::string replies = message(first) + end(first) + message(first + 2) +
                                FrameBytes(Frame::kResetStream, 0, first + 2, BigEndian(0)) +
                                message(first + 4);
    for (size_t at = 0; at < replies.size(); at += piece) {
      guard_.TakeSent(replies.substr(at, piece));
    }
    EXPECT_EQ(guard_.open_streams(), 254);
    // A stream ends once.
    guard_.TakeSent(end(first) + FrameBytes(Frame::kResetStream, 0, first, BigEndian(0)));
    EXPECT_EQ(guard_.open_streams(), 254);
    for (int i = 0; i < 2; ++i, stream += 2) ASSERT_EQ(Send(call(stream)), Verdict::kAllowed);
  }
  ASSERT_EQ(Send(Reset(stream - 2) + call(stream)), Verdict::kAllowed);
  EXPECT_EQ(guard_.open_streams(), 256);
  EXPECT_EQ(Send(call(stream + 2)), Verdict::kOpenStreams);
}

TEST_F(FrameGuardTest, TheRateOfWindowUpdatesIsBounded) {
  ASSERT_EQ(Send(kOpening), Verdict::kAllowed);
  const std::string update = FrameBytes(Frame::kWindowUpdate, 0, 0, BigEndian(1));
  for (int i = 0; i < 50'000; ++i) ASSERT_EQ(Send(update), Verdict::kAllowed);
  now_ += std::chrono::milliseconds(100);
  for (int i = 0; i < 5'000; ++i) ASSERT_EQ(Send(update), Verdict::kAllowed);
  EXPECT_EQ(Send(update), Verdict::kWindowUpdates);
}

TEST_F(FrameGuardTest, AShareOfTheBurstsGrowsToAllOfThem) {
  FrameLimits limits;
  limits.first_share = 0.05;
  FrameGuard guard(limits, all_half_open_, now_);
  ASSERT_EQ(guard.Take(kOpening, now_), Verdict::kAllowed);
  const std::string ping = FrameBytes(Frame::kPing, 0, 0, "12345678");
  for (int i = 0; i < 49; ++i) ASSERT_EQ(guard.Take(ping, now_), Verdict::kAllowed);
  now_ += std::chrono::seconds(60);
  for (int i = 0; i < 1000; ++i) ASSERT_EQ(guard.Take(ping, now_), Verdict::kAllowed);
  EXPECT_EQ(guard.Take(ping, now_), Verdict::kControlFrames);
}

TEST_F(FrameGuardTest, TheRateOfResetsIsBounded) {
  ASSERT_EQ(Send(kOpening), Verdict::kAllowed);
  uint32_t stream = 1;
  const auto open_and_reset = [&] {
    stream += 2;
    return Send(Open(stream) + Reset(stream));
  };
  for (int i = 0; i < 256; ++i) ASSERT_EQ(open_and_reset(), Verdict::kAllowed);
  now_ += std::chrono::seconds(1);
  for (int i = 0; i < 256; ++i) ASSERT_EQ(open_and_reset(), Verdict::kAllowed);
  now_ += std::chrono::milliseconds(100);
  for (int i = 0; i < 50; ++i) ASSERT_EQ(open_and_reset(), Verdict::kAllowed);
  EXPECT_EQ(open_and_reset(), Verdict::kControlFrames);
}

// Rapid reset on one connection after another.
TEST(BurstShares, ANetworkThatReconnectsBeginsWithSmallBursts) {
  const BurstShares::Network network = {1};
  FrameGuard::Clock::time_point now{};
  BurstShares shares;
  for (int i = 0; i < 8; ++i) EXPECT_EQ(shares.Draw(network, now), 1);
  for (int i = 0; i < 100; ++i) EXPECT_EQ(shares.Draw(network, now), 0.05);
  EXPECT_EQ(shares.Draw({2}, now), 1);
  now += std::chrono::seconds(2);
  for (int i = 0; i < 2; ++i) EXPECT_EQ(shares.Draw(network, now), 1);
  EXPECT_EQ(shares.Draw(network, now), 0.05);
  // Many other networks neither use up memory nor the bursts of new ones.
  for (uint32_t i = 0; i < 10'000; ++i) {
    const auto byte = [i](int shift) { return static_cast<uint8_t>(i >> shift); };
    EXPECT_EQ(shares.Draw({3, byte(0), byte(8), byte(16)}, now), 1);
  }
}

// gRPC keeps incomplete messages in memory.
TEST_F(FrameGuardTest, BytesOfIncompleteMessagesAreBounded) {
  const auto part = [](uint32_t stream, size_t bytes) {
    return FrameBytes(Frame::kData, 0, stream, std::string(bytes, 'm'));
  };
  const std::string prefix = std::string(1, '\0') + BigEndian(3 << 20);
  ASSERT_EQ(Send(kOpening + Open(1) + FrameBytes(Frame::kData, 0, 1, prefix)), Verdict::kAllowed);
  ASSERT_EQ(Send(part(1, 2 << 20)), Verdict::kAllowed);
  EXPECT_EQ(all_half_open_.bytes, 2 << 20);
  all_half_open_.bytes += 96 << 20;
  FrameGuard other(FrameLimits{}, all_half_open_, now_);
  EXPECT_EQ(
      other.Take(kOpening + Open(1) + FrameBytes(Frame::kData, 0, 1, prefix) + part(1, 1000), now_),
      Verdict::kAllowed);
  EXPECT_EQ(Send(part(1, 1)), Verdict::kHalfOpenStreams);
  // A complete message no longer counts.
  all_half_open_.bytes -= 96 << 20;
  ASSERT_EQ(Send(part(1, (1 << 20) - 1)), Verdict::kAllowed);
  EXPECT_EQ(all_half_open_.bytes, 1000);
}

TEST_F(FrameGuardTest, ADestroyedGuardReleasesItsHalfOpenStreams) {
  {
    FrameGuard other(FrameLimits{}, all_half_open_, now_);
    ASSERT_EQ(other.Take(kOpening + Open(1), now_), Verdict::kAllowed);
    EXPECT_EQ(all_half_open_.streams, 1);
  }
  EXPECT_EQ(all_half_open_.streams, 0);
}

TEST_F(FrameGuardTest, AHeaderBlockIsBoundedIncludingContinuations) {
  ASSERT_EQ(Send(kOpening + FrameBytes(Frame::kHeaders, 0, 1, std::string(10'000, 'a'))),
            Verdict::kAllowed);
  ASSERT_EQ(Send(FrameBytes(Frame::kContinuation, 0, 1, std::string(6'384, 'a'))),
            Verdict::kAllowed);
  EXPECT_EQ(Send(FrameBytes(Frame::kContinuation, 0, 1, "a")), Verdict::kHeaderBlock);
}

TEST_F(FrameGuardTest, TheRateOfLargeHeaderBlocksIsBounded) {
  ASSERT_EQ(Send(kOpening), Verdict::kAllowed);
  const auto send_large = [this](uint32_t stream) {
    return Send(FrameBytes(Frame::kHeaders, kEndHeadersFlag | kEndStreamFlag, stream,
                           std::string(FrameLimits::kUsualHeaderBytes + 8192, 'a')));
  };
  uint32_t stream = 1;
  for (int i = 0; i < 32; ++i, stream += 2) ASSERT_EQ(send_large(stream), Verdict::kAllowed);
  now_ += std::chrono::seconds(1);
  for (int i = 0; i < 8; ++i, stream += 2) ASSERT_EQ(send_large(stream), Verdict::kAllowed);
  EXPECT_EQ(send_large(stream), Verdict::kLargeHeaders);
}

// An upload that the server ended may be ahead by a window of frames, also on a new connection of a
// client that reconnects often.
TEST_F(FrameGuardTest, TheRateOfDataAfterTheEndOfAStreamIsBounded) {
  FrameLimits limits;
  limits.first_share = 0.05;
  FrameGuard guard(limits, all_half_open_, now_);
  ASSERT_EQ(guard.Take(kOpening + Open(1), now_), Verdict::kAllowed);
  guard.TakeSent(FrameBytes(Frame::kHeaders, kEndHeadersFlag | kEndStreamFlag, 1, "trailers"));
  const std::string late = FrameBytes(Frame::kData, 0, 1, std::string(100, 'x'));
  for (int i = 0; i < 1000; ++i) ASSERT_EQ(guard.Take(late, now_), Verdict::kAllowed);
  now_ += std::chrono::seconds(1);
  for (int i = 0; i < 1000; ++i) ASSERT_EQ(guard.Take(late, now_), Verdict::kAllowed);
  EXPECT_EQ(guard.Take(late, now_), Verdict::kControlFrames);
}

TEST_F(FrameGuardTest, TheRateOfControlFramesIsBounded) {
  for (const std::string& frame :
       {FrameBytes(Frame::kPing, 0, 0, "12345678"), FrameBytes(Frame::kSettings, 0, 0, ""),
        FrameBytes(Frame::kContinuation, 0, 1, ""), FrameBytes(Frame::kData, 0, 1, ""),
        FrameBytes(Frame{200}, 0, 0, "x"),
        // Trailers.
        FrameBytes(Frame::kHeaders, kEndHeadersFlag, 1, "")}) {
    auto now = now_;
    FrameGuard guard(FrameLimits{}, all_half_open_, now);
    // The settings of the opening count.
    ASSERT_EQ(guard.Take(kOpening + Open(1), now), Verdict::kAllowed);
    for (int i = 0; i < 999; ++i) ASSERT_EQ(guard.Take(frame, now), Verdict::kAllowed);
    now += std::chrono::seconds(1);
    for (int i = 0; i < 200; ++i) ASSERT_EQ(guard.Take(frame, now), Verdict::kAllowed);
    EXPECT_EQ(guard.Take(frame, now), Verdict::kControlFrames);
  }
}

}  // namespace frame_guard_test
}  // namespace hulld::server
