#include "client/formats/byte_source.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <string>
#include <thread>
#include <vector>

#include "tests/client/formats/point_reading.h"

namespace hulld {
namespace byte_source_test {

std::vector<std::string> Lines(const std::string& content) {
  const TempFile file("lines", content);
  auto source = ByteSource::Open(file.path());
  std::vector<std::string> lines;
  std::string_view line;
  while ((*source)->ReadLine(&line)) lines.emplace_back(line);
  EXPECT_TRUE((*source)->status().ok()) << (*source)->status();
  EXPECT_EQ((*source)->line(), lines.size());
  return lines;
}

using Strings = std::vector<std::string>;

TEST(ByteSource, SupportsThreeKindsOfLineEnds) {
  EXPECT_EQ(Lines("a\nb\n"), (Strings{"a", "b"}));
  EXPECT_EQ(Lines("a\r\nb\r\n"), (Strings{"a", "b"}));
  EXPECT_EQ(Lines("a\rb\r"), (Strings{"a", "b"}));
  EXPECT_EQ(Lines("a\n\n\nb"), (Strings{"a", "", "", "b"}));
  EXPECT_EQ(Lines("a\r\n\r\nb"), (Strings{"a", "", "b"}));
  EXPECT_EQ(Lines("a\r\rb"), (Strings{"a", "", "b"}));
  EXPECT_EQ(Lines("a\r"), (Strings{"a"}));
  EXPECT_EQ(Lines("\r"), (Strings{""}));
  EXPECT_EQ(Lines("\n"), (Strings{""}));
  EXPECT_EQ(Lines(""), Strings{});
}

TEST(ByteSource, LinesOfOneFileMayEndDifferently) {
  EXPECT_EQ(Lines("a\nb\rc\r\nd\re"), (Strings{"a", "b", "c", "d", "e"}));
  EXPECT_EQ(Lines("a\r\nb\rc\nd"), (Strings{"a", "b", "c", "d"}));
  EXPECT_EQ(Lines("a\rb\nc\rd\n"), (Strings{"a", "b", "c", "d"}));
  // An LF after the CR of a file of Mac OS may be the first byte of binary data.
  EXPECT_EQ(Lines("a\rb\r\nc"), (Strings{"a", "b", "", "c"}));
}

TEST(ByteSource, SkipsAUtf8ByteOrderMark) {
  EXPECT_EQ(Lines("\xEF\xBB\xBFx\ny"), (Strings{"x", "y"}));
  EXPECT_EQ(Lines("\xEF\xBB"), (Strings{"\xEF\xBB"}));
}

TEST(ByteSource, SkipsTheEndMarkOfDos) {
  EXPECT_EQ(Lines("x\ny\x1A"), (Strings{"x", "y"}));
  EXPECT_EQ(Lines("x\r\n\x1A"), (Strings{"x", ""}));
}

TEST(ByteSource, RefusesBytesThatNoTextContains) {
  for (const auto& [text, message] :
       {std::pair(std::string("x\ny\0z\n", 6), "2: the line contains the byte 0 (NUL); is"),
        std::pair(std::string("x\n\0\0\0", 5), "2: the line contains the byte 0 (NUL); is"),
        std::pair(std::string("\x1A\nx"), "1: the line contains the byte 26 (^Z); is"),
        std::pair(std::string("x\ny\x1A\n"), "2: the line contains the byte 26 (^Z); is")}) {
    const TempFile file("lines", text);
    auto source = ByteSource::Open(file.path());
    std::string_view line;
    while ((*source)->ReadLine(&line)) continue;
    EXPECT_NE((*source)->status().message().find(message), absl::string_view::npos)
        << (*source)->status();
  }
}

TEST(ByteSource, ReadsTheRest) {
  const std::string content(1000000, 'a');
  const TempFile file("bytes", "xy\n" + content);
  auto source = ByteSource::Open(file.path());
  std::string_view line;
  EXPECT_TRUE((*source)->ReadLine(&line));
  EXPECT_EQ((*source)->ReadRest(), content);
  EXPECT_EQ((*source)->ReadRest(), "");
  EXPECT_TRUE((*source)->status().ok());
}

TEST(ByteSource, RefusesUtf16WithAdvice) {
  const TempFile file("utf16", std::string("\xFF\xFEv\0 \0", 6));
  auto source = ByteSource::Open(file.path());
  std::string_view line;
  EXPECT_FALSE((*source)->ReadLine(&line));
  EXPECT_NE((*source)->status().message().find("iconv -f UTF-16"), absl::string_view::npos);
}

TEST(ByteSource, LinesMayCrossTheBuffer) {
  // Sizes around the buffer's cover every split of CR LF between two reads.
  for (size_t length = (256 << 10) - 4; length < (256 << 10) + 4; ++length) {
    const std::string first(length, 'a');
    EXPECT_EQ(Lines(first + "\r\nb\r\nc"), (Strings{first, "b", "c"})) << length;
    EXPECT_EQ(Lines("x\r\n" + first + "\r\nb"), (Strings{"x", first, "b"})) << length;
    EXPECT_EQ(Lines(first + "\rb\rc"), (Strings{first, "b", "c"})) << length;
  }
}

TEST(ByteSource, ASlowPipeReadsTheSame) {
  int ends[2];
  ASSERT_EQ(pipe(ends), 0);
  const std::string content = "ab\r\n\r\ncd\r\nlast";
  std::thread writer([&] {
    for (const char c : content) EXPECT_EQ(write(ends[1], &c, 1), 1);
    close(ends[1]);
  });
  ByteSource source(ends[0], "pipe");
  Strings lines;
  std::string_view line;
  while (source.ReadLine(&line)) lines.emplace_back(line);
  writer.join();
  EXPECT_EQ(lines, (Strings{"ab", "", "cd", "last"}));
}

TEST(ByteSource, AnEndlessLineIsRefusedWithoutBufferingIt) {
  const TempFile file("endless", std::string((16 << 20) + (1 << 20), 'x'));
  auto source = ByteSource::Open(file.path());
  std::string_view line;
  EXPECT_FALSE((*source)->ReadLine(&line));
  EXPECT_EQ((*source)->ErrorAtLine("").code(), absl::StatusCode::kInvalidArgument);
  EXPECT_NE((*source)->status().message().find(":1: the line is longer than 16 MiB"),
            absl::string_view::npos);
}

TEST(ByteSource, ReadsBytesAfterLinesAndCountsThem) {
  const TempFile file("mixed", "head\n\r\n\0\x01z");
  auto source = ByteSource::Open(file.path());
  std::string_view line;
  ASSERT_TRUE((*source)->ReadLine(&line));
  EXPECT_EQ((*source)->offset(), 5u);
  char bytes[2];
  ASSERT_TRUE((*source)->Read(bytes, 2));
  EXPECT_EQ(bytes[0], '\r');
  EXPECT_FALSE((*source)->Read(bytes, 2));
}

TEST(ByteSource, SkippingPastTheEndFails) {
  const TempFile file("short", std::string(1000, 'x'));
  auto source = ByteSource::Open(file.path());
  EXPECT_TRUE((*source)->Skip(1000));
  EXPECT_FALSE((*source)->Skip(1));
  auto again = ByteSource::Open(file.path());
  EXPECT_FALSE((*again)->Skip(~uint64_t{0}));
}

TEST(ByteSource, OpeningFailsWithAClearError) {
  const std::string missing = testing::TempDir() + "hulld_client_no_such_file";
  EXPECT_EQ(ByteSource::Open(missing).status().code(), absl::StatusCode::kNotFound);
  EXPECT_EQ(ByteSource::Open(testing::TempDir()).status().code(),
            absl::StatusCode::kInvalidArgument);
}

}  // namespace byte_source_test
}  // namespace hulld
