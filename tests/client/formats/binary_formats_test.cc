// The binary forms of PLY and PCD.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include "tests/client/formats/point_reading.h"

namespace hulld {
namespace binary_formats_test {

using testing::ElementsAre;
using testing::HasSubstr;

// Appends scalars in either byte order.
class Packer {
 public:
  explicit Packer(bool big_endian = false) : big_endian_(big_endian) {}

  template <typename Scalar>
  Packer& Add(Scalar value) {
    char bytes[sizeof(value)];
    std::memcpy(bytes, &value, sizeof(value));
    if (big_endian_) std::reverse(bytes, bytes + sizeof(value));
    data_.append(bytes, sizeof(value));
    return *this;
  }
  const std::string& data() const { return data_; }

 private:
  bool big_endian_;
  std::string data_;
};

std::string PlyHead(const std::string& format, const std::string& rest) {
  return "ply\nformat " + format + " 1.0\n" + rest + "end_header\n";
}

constexpr char kFloatVertices[] =
    "element vertex 2\nproperty float x\nproperty float y\nproperty float z\n";

TEST(PlyFile, BinaryFloatsStayFloats) {
  for (const bool big : {false, true}) {
    Packer body(big);
    body.Add(0.1f).Add(-2.5f).Add(1e-45f).Add(4.0f).Add(5.0f).Add(3e38f);
    const PointsRead read = ReadText(
        PlyHead(big ? "binary_big_endian" : "binary_little_endian", kFloatVertices) + body.data(),
        PointFormat::kPly);
    ASSERT_TRUE(read.status.ok()) << read.status;
    EXPECT_TRUE(read.all_float());
    EXPECT_THAT(read.xyz(), ElementsAre(double{0.1f}, -2.5, double{1e-45f}, 4, 5, double{3e38f}));
  }
}

TEST(PlyFile, BinaryDoublesKeepEveryBit) {
  for (const bool big : {false, true}) {
    Packer body(big);
    body.Add(0.1).Add(1e-310).Add(-1e308);
    const PointsRead read =
        ReadText(PlyHead(big ? "binary_big_endian" : "binary_little_endian",
                         "element vertex 1\nproperty double x\nproperty double y\n"
                         "property float64 z\n") +
                     body.data(),
                 PointFormat::kPly);
    ASSERT_TRUE(read.status.ok()) << read.status;
    EXPECT_THAT(read.xyz(), ElementsAre(0.1, 1e-310, -1e308));
  }
}

TEST(PlyFile, BinaryReadsEveryTypeAndSkipsListsAndOtherElements) {
  for (const bool big : {false, true}) {
    Packer body(big);
    // Two `strip` elements, then a vertex between other properties.
    body.Add(uint16_t{3}).Add(1.0).Add(2.0).Add(3.0).Add(int8_t{-1});
    body.Add(uint16_t{0}).Add(int8_t{5});
    body.Add(uint8_t{9}).Add(int8_t{-7}).Add(uint8_t{2}).Add(int32_t{1}).Add(int32_t{2});
    body.Add(uint16_t{60000}).Add(int32_t{-2000000000});
    const PointsRead read =
        ReadText(PlyHead(big ? "binary_big_endian" : "binary_little_endian",
                         "element strip 2\nproperty list ushort double w\nproperty char c\n"
                         "element vertex 1\nproperty uchar red\nproperty int8 x\n"
                         "property list uint8 int32 bag\nproperty uint16 y\nproperty int z\n") +
                     body.data(),
                 PointFormat::kPly);
    ASSERT_TRUE(read.status.ok()) << read.status;
    EXPECT_THAT(read.xyz(), ElementsAre(-7, 60000, -2000000000.0));
  }
}

// trimesh writes labels as int64.
TEST(PlyFile, BinaryReads64BitIntegers) {
  Packer body(false);
  body.Add(1.0f).Add(2.0f).Add(3.0f).Add(int64_t{-1}).Add(uint64_t{1} << 63);
  const PointsRead read =
      ReadText(PlyHead("binary_little_endian",
                       "element vertex 1\nproperty float x\nproperty float y\nproperty float z\n"
                       "property int64 label\nproperty uint64 id\n") +
                   body.data(),
               PointFormat::kPly);
  ASSERT_TRUE(read.status.ok()) << read.status;
  EXPECT_THAT(read.xyz(), ElementsAre(1, 2, 3));
}

// They were rounded.
TEST(PlyFile, Binary64BitCoordinatesMustBeDoubles) {
  for (const bool big : {false, true}) {
    const std::string head =
        PlyHead(big ? "binary_big_endian" : "binary_little_endian",
                "element vertex 1\nproperty int64 x\nproperty uint64 y\nproperty int64 z\n");
    const auto read = [&](int64_t x, uint64_t y, int64_t z) {
      return ReadText(head + Packer(big).Add(x).Add(y).Add(z).data(), PointFormat::kPly);
    };
    constexpr int64_t kLeast = std::numeric_limits<int64_t>::min();
    EXPECT_THAT(read(-(int64_t{1} << 53), 3u << 30, kLeast).xyz(),
                ElementsAre(-0x1p53, 0x3p30, -0x1p63));
    EXPECT_THAT(read(0, uint64_t{1} << 63, (int64_t{1} << 53) + 2).xyz(),
                ElementsAre(0, 0x1p63, 0x1p53 + 2));
    for (const PointsRead& rounded :
         {read((int64_t{1} << 53) + 1, 0, 0), read(0, std::numeric_limits<uint64_t>::max(), 0),
          read(0, 0, kLeast + 1)}) {
      EXPECT_EQ(rounded.error(), "FILE: byte " + std::to_string(head.size()) +
                                     ": a coordinate is a 64-bit integer that no double "
                                     "represents exactly; store it as a double");
    }
  }
}

// The bytes of the list, 2^61 * 8, overflowed to 0.
TEST(PlyFile, BinaryListsWithTooManyItemsAreErrors) {
  for (const uint64_t count : {uint64_t{1} << 61, std::numeric_limits<uint64_t>::max()}) {
    Packer body;
    body.Add(count).Add(1.0).Add(2.0).Add(3.0);
    EXPECT_THAT(ReadText(PlyHead("binary_little_endian",
                                 "element vertex 1\nproperty list uint64 double tags\n"
                                 "property double x\nproperty double y\nproperty double z\n") +
                             body.data(),
                         PointFormat::kPly)
                    .error(),
                HasSubstr("within the element vertex; is it complete?"));
  }
}

TEST(PlyFile, BinaryAfterACrLfHeader) {
  // The first byte of the body is LF: it must not be parsed as a line end.
  std::string head = PlyHead("binary_little_endian", kFloatVertices);
  for (size_t at = 0; (at = head.find('\n', at)) != std::string::npos; at += 2) {
    head.replace(at, 1, "\r\n");
  }
  Packer body;
  float first;
  std::memcpy(&first, "\n\r\n\x40", 4);
  body.Add(first).Add(2.0f).Add(3.0f).Add(4.0f).Add(5.0f).Add(6.0f);
  const PointsRead read = ReadText(head + body.data(), PointFormat::kPly);
  ASSERT_TRUE(read.status.ok()) << read.status;
  EXPECT_THAT(read.xyz(), ElementsAre(double{first}, 2, 3, 4, 5, 6));
}

TEST(PlyFile, BinaryErrorsNameTheByte) {
  const std::string head = PlyHead("binary_little_endian", kFloatVertices);
  Packer body;
  body.Add(1.0f)
      .Add(2.0f)
      .Add(3.0f)
      .Add(4.0f)
      .Add(std::numeric_limits<float>::quiet_NaN())
      .Add(6.0f);
  EXPECT_EQ(ReadText(head + body.data(), PointFormat::kPly).error(),
            "FILE: byte " + std::to_string(head.size() + 12) +
                ": point 2 has y = NaN; skip such points with --skip-nonfinite");
  EXPECT_THAT(ReadText(head + body.data().substr(0, 20), PointFormat::kPly).error(),
              HasSubstr("FILE: ends at byte " + std::to_string(head.size() + 20)));
  ReadOptions options;
  options.skip_nonfinite = true;
  const PointsRead read = ReadText(head + body.data(), PointFormat::kPly, options);
  EXPECT_THAT(read.xyz(), ElementsAre(1, 2, 3));
  EXPECT_EQ(read.counts.skipped, 1u);
}

TEST(PlyFile, BinaryElementsBeyondTheDeclaredCountAreErrors) {
  Packer body;
  for (const float value : {1.0f, 2.0f, 3.0f, 4.0f, 5.0f, 6.0f}) body.Add(value);
  const std::string text = PlyHead("binary_little_endian", kFloatVertices) + body.data();
  EXPECT_EQ(ReadText(text + body.data(), PointFormat::kPly).error(),
            "FILE: byte " + std::to_string(text.size()) +
                ": 24 bytes follow the last element that the header declares; correct its count, "
                "or cut the file here");
  for (const std::string& padding : {std::string("\n"), std::string(100, '\0')}) {
    EXPECT_EQ(ReadText(text + padding, PointFormat::kPly).counts.points, 2u);
  }
}

TEST(PcdFile, BinaryFloatsStayFloatsWithOtherFieldsBetween) {
  Packer body;
  for (const float base : {0.0f, 10.0f}) {
    body.Add(uint32_t{7})
        .Add(base + 0.1f)
        .Add(base + 2)
        .Add(base + 3)
        .Add(uint16_t{1})
        .Add(uint16_t{2});
  }
  const PointsRead read = ReadText(
      "VERSION .7\nFIELDS rgb x y z ring\nSIZE 4 4 4 4 2\nTYPE U F F F U\nCOUNT 1 1 1 1 2\n"
      "WIDTH 1\nHEIGHT 2\nPOINTS 2\nDATA binary\n" +
          body.data(),
      PointFormat::kPcd);
  ASSERT_TRUE(read.status.ok()) << read.status;
  EXPECT_TRUE(read.all_float());
  EXPECT_THAT(read.xyz(), ElementsAre(double{0.1f}, 2, 3, double{10.1f}, 12, 13));
}

TEST(PcdFile, BinaryMixedScalarsBecomeDoubles) {
  Packer body;
  body.Add(0.1).Add(2.5f).Add(int64_t{-5});
  const PointsRead read = ReadText(
      "FIELDS x y z\nSIZE 8 4 8\nTYPE F F I\nWIDTH 1\nHEIGHT 1\nDATA binary\n" + body.data(),
      PointFormat::kPcd);
  ASSERT_TRUE(read.status.ok()) << read.status;
  EXPECT_FALSE(read.all_float());
  EXPECT_THAT(read.xyz(), ElementsAre(0.1, 2.5, -5));
  Packer rounded;
  rounded.Add(0.1).Add(2.5f).Add((int64_t{1} << 53) + 1);
  EXPECT_THAT(ReadText("FIELDS x y z\nSIZE 8 4 8\nTYPE F F I\nWIDTH 1\nHEIGHT 1\nDATA binary\n" +
                           rounded.data(),
                       PointFormat::kPcd)
                  .error(),
              HasSubstr("a 64-bit integer that no double represents exactly"));
}

TEST(PcdFile, BinaryOrganizedCloudsLoseTheirHolesIfRequested) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  Packer body;
  body.Add(nan).Add(nan).Add(nan).Add(1.0f).Add(2.0f).Add(3.0f);
  const std::string text =
      "FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH 2\nHEIGHT 1\nPOINTS 2\nDATA "
      "binary\n" +
      body.data();
  EXPECT_THAT(ReadText(text, PointFormat::kPcd).error(), HasSubstr("point 1 has x = NaN"));
  ReadOptions options;
  options.skip_nonfinite = true;
  EXPECT_THAT(ReadText(text, PointFormat::kPcd, options).xyz(), ElementsAre(1, 2, 3));
}

}  // namespace binary_formats_test
}  // namespace hulld
