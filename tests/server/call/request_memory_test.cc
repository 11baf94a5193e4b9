// Memory of requests: counted before parsing, and limited.

#include <gmock/gmock.h>
#include <google/protobuf/stubs/logging.h>
#include <google/protobuf/unknown_field_set.h>
#include <gtest/gtest.h>

#include <cstdint>
#include <limits>
#include <memory>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "hulld/v1/collision.pb.h"
#include "hulld/v1/hull.pb.h"
#include "server/call/message_bytes.h"
#include "server/call/message_layout.h"
#include "server/contract/errors.h"

namespace hulld::server {
namespace request_memory_test {

using google::protobuf::Message;
using ::testing::HasSubstr;

constexpr uint64_t kAny = std::numeric_limits<uint64_t>::max();

uint64_t ParsedBytes(const Message& type, const std::string& bytes, uint64_t limit = kAny) {
  return MessageLayout::Of(*type.GetDescriptor()).ParsedBytes(bytes, limit);
}

// Returns `text` in slices of this many bytes.
grpc::ByteBuffer BytesOf(const std::string& text, size_t slice_bytes = kAny) {
  std::vector<grpc::Slice> slices;
  for (size_t i = 0; i < text.size(); i += slices.back().size()) {
    slices.emplace_back(text.substr(i, slice_bytes));
  }
  return grpc::ByteBuffer(slices.data(), slices.size());
}

// Returns `bytes` repeated, which parses as one message.
std::string Times(int count, const std::string& bytes) {
  std::string all;
  for (int i = 0; i < count; ++i) all += bytes;
  return all;
}

struct Sample {
  const char* name;
  std::shared_ptr<Message> type;
  std::string bytes;
  // Maximum ratio of the bound to the message's memory.
  double slack;
};

std::vector<Sample> Samples() {
  using Batch = v1::BatchCheckCollisionsRequest;
  const auto batch = std::make_shared<Batch>();
  Batch placements;
  Batch packed;
  for (uint32_t i = 0; i < 3000; ++i) {
    v1::Placement& placement = *placements.add_placements();
    placement.set_hull_id("a/part/of/a/longer/name");
    placement.mutable_pose()->mutable_rotation()->set_w(1);
    placement.mutable_pose()->mutable_translation()->set_x(i);
    placements.add_pairs(i);
    placements.add_pairs(7);
    packed.mutable_packed_placements()->add_hulls(i % 5);
    for (int k = 0; k < 7; ++k) packed.mutable_packed_placements()->add_poses(k);
  }
  Batch ids;
  for (int i = 0; i < 3000; ++i) ids.mutable_packed_placements()->add_hull_ids("");
  v1::AppendPointsRequest chunk;
  for (int i = 0; i < 30'000; ++i) chunk.mutable_chunk()->mutable_points()->add_xyz(i);
  v1::StreamCollisionsRequest open;
  for (int i = 0; i < 1000; ++i) open.mutable_open()->add_placements()->set_hull_id("x");
  return {
      {"empty", batch, "", 3},
      {"placements", batch, placements.SerializeAsString(), 3},
      {"packed placements", batch, packed.SerializeAsString(), 3},
      {"points", std::make_shared<v1::AppendPointsRequest>(), chunk.SerializeAsString(), 3},
      {"open", std::make_shared<v1::StreamCollisionsRequest>(), open.SerializeAsString(), 3},
      {"empty placements", batch, Times(10'000, std::string("\x0a\x00", 2)), 3},
      {"pairs one by one", batch, Times(10'000, std::string("\x10\x01", 2)), 3},
      {"hull IDs of packed placements", batch, ids.SerializeAsString(), 3},
      // An entry of protobuf's set of unknown fields takes less than the amount counted for any.
      {"unknown numbers", batch, Times(10'000, std::string("\x70\x01", 2)), 8},
      {"unknown texts", batch, Times(10'000, std::string("\x72\x00", 2)), 4},
      {"unknown numbers in placements", batch, Times(3000, std::string("\x0a\x02\x78\x01", 4)), 4},
      {"numbers where texts belong", batch, Times(3000, std::string("\x0a\x02\x08\x01", 4)), 4},
      {"groups", batch, Times(10'000, "\x73\x74"), 4},
      {"numbers in groups", batch, "\x73" + Times(10'000, std::string("\x08\x01", 2)) + "\x74", 8},
  };
}

TEST(MessageLayout, BoundsTheMemoryOfParsing) {
  for (const Sample& sample : Samples()) {
    const std::unique_ptr<Message> message(sample.type->New());
    ASSERT_TRUE(message->ParseFromString(sample.bytes)) << sample.name;
    const auto bound = static_cast<double>(ParsedBytes(*sample.type, sample.bytes));
    const auto taken = static_cast<double>(message->SpaceUsedLong());
    EXPECT_GE(bound, taken) << sample.name;
    EXPECT_LE(bound, sample.slack * taken) << sample.name;
  }
}

// A damaged message is parsed at most up to the damage.
TEST(MessageLayout, BoundsTheMemoryOfParsingDamagedMessages) {
  // Protobuf logs strings that are not UTF-8 to standard error.
  const google::protobuf::LogSilencer silencer;
  constexpr uint64_t kSeed = 71;
  std::mt19937_64 random(kSeed);
  const auto below = [&random](size_t limit) { return random() % limit; };
  int parsed = 0;
  for (const Sample& sample : Samples()) {
    for (int round = 0; round < 200 && !sample.bytes.empty(); ++round) {
      std::string bytes = sample.bytes.substr(0, 400);
      for (uint64_t change = below(4); change > 0; --change) {
        bytes[below(bytes.size())] = static_cast<char>(below(256));
      }
      bytes.resize(below(bytes.size() + 1));
      const std::unique_ptr<Message> message(sample.type->New());
      if (message->ParseFromString(bytes)) ++parsed;
      EXPECT_GE(ParsedBytes(*sample.type, bytes), message->SpaceUsedLong())
          << sample.name << ", seed " << kSeed << ", round " << round;
    }
  }
  EXPECT_GT(parsed, 300);
}

TEST(MessageLayout, StopsCountingSoonAfterTheLimit) {
  const v1::BatchCheckCollisionsRequest batch;
  const std::string bytes = Times(1'000'000, std::string("\x0a\x00", 2));
  const uint64_t counted = ParsedBytes(batch, bytes, 10'000);
  EXPECT_GT(counted, 10'000u);
  EXPECT_LT(counted, 11'000u);
}

TEST(RequestMemory, IsReservedAndReleased) {
  RequestMemory memory(1000);
  {
    RequestMemory::Share share;
    ASSERT_TRUE(memory.Take(600, share).ok());
    EXPECT_EQ(memory.taken_bytes(), 600u);
    RequestMemory::Share moved = std::move(share);
    EXPECT_EQ(share.bytes(), 0u);  // NOLINT(bugprone-use-after-move): moving empties it
    EXPECT_EQ(moved.bytes(), 600u);
    ASSERT_TRUE(memory.Take(900, moved).ok()) << "in place of its previous amount";
    EXPECT_EQ(memory.taken_bytes(), 900u);
  }
  EXPECT_EQ(memory.taken_bytes(), 0u);
}

TEST(RequestMemory, DistinguishesTooLargeFromWaiting) {
  RequestMemory memory(1000);
  RequestMemory::Share first;
  RequestMemory::Share second;
  const absl::Status alone = memory.Take(1001, first);
  EXPECT_TRUE(absl::IsResourceExhausted(alone));
  EXPECT_THAT(std::string(alone.message()), HasSubstr("(--request-memory)"));
  EXPECT_EQ(ReasonOf(alone), v1::ERROR_REASON_LIMIT_EXCEEDED);
  EXPECT_FALSE(RetryAfter(alone).has_value());
  ASSERT_TRUE(memory.Take(600, first).ok());
  const absl::Status waiting = memory.Take(600, second);
  EXPECT_TRUE(absl::IsResourceExhausted(waiting));
  EXPECT_EQ(ReasonOf(waiting), v1::ERROR_REASON_OVERLOADED);
  EXPECT_TRUE(RetryAfter(waiting).has_value());
  EXPECT_EQ(memory.taken_bytes(), 600u);
  first.Release();
  EXPECT_TRUE(memory.Take(600, second).ok());
}

TEST(ParseRequest, FreesTheBytesAndCoversTheMessage) {
  RequestMemory memory(100'000);
  RequestMemory::Share share;
  v1::GetHullRequest request;
  request.set_hull_id("cube");
  for (const size_t slice_bytes : {1, 4, 100}) {
    grpc::ByteBuffer bytes = BytesOf(request.SerializeAsString(), slice_bytes);
    v1::GetHullRequest parsed;
    ASSERT_TRUE(ParseRequest(bytes, memory, &parsed, share).ok());
    EXPECT_EQ(parsed.hull_id(), "cube");
    EXPECT_FALSE(bytes.Valid());
    EXPECT_GE(memory.taken_bytes(), parsed.SpaceUsedLong());
  }
}

TEST(ParseRequest, RefusesMalformedAndTooLargeRequestsWithoutParsing) {
  RequestMemory memory(100'000);
  RequestMemory::Share share;
  v1::BatchCheckCollisionsRequest parsed;
  grpc::ByteBuffer cut = BytesOf("\x0a\x7f");
  const absl::Status malformed = ParseRequest(cut, memory, &parsed, share);
  EXPECT_TRUE(absl::IsInvalidArgument(malformed));
  EXPECT_THAT(std::string(malformed.message()), HasSubstr("BatchCheckCollisionsRequest"));
  grpc::ByteBuffer many = BytesOf(Times(10'000, std::string("\x0a\x00", 2)));
  v1::BatchCheckCollisionsRequest untouched;
  EXPECT_TRUE(absl::IsResourceExhausted(ParseRequest(many, memory, &untouched, share)));
  EXPECT_EQ(untouched.placements_size(), 0);
}

}  // namespace request_memory_test
}  // namespace hulld::server
