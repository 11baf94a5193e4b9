// Compressed PCD files, and headers that contradict their data.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <liblzf/lzf.h>

#include <cmath>
#include <cstring>
#include <limits>
#include <random>

#include "tests/client/formats/point_reading.h"

namespace hulld {
namespace pcd_file_test {

using testing::ElementsAre;
using testing::HasSubstr;

template <typename Scalar>
std::string Packed(const std::vector<Scalar>& values) {
  return std::string(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(Scalar));
}

std::string Compressed(const std::string& values) {
  std::string data(2 * values.size() + 64, '\0');
  data.resize(lzf_compress(values.data(), static_cast<unsigned>(values.size()), data.data(),
                           static_cast<unsigned>(data.size())));
  EXPECT_FALSE(data.empty());
  return Packed<uint32_t>(
             {static_cast<uint32_t>(data.size()), static_cast<uint32_t>(values.size())}) +
         data;
}

std::string Head(const std::string& fields, size_t points) {
  return fields + "WIDTH " + std::to_string(points) + "\nHEIGHT 1\nPOINTS " +
         std::to_string(points) + "\nDATA binary_compressed\n";
}

constexpr char kFloats[] = "VERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\n";

TEST(CompressedPcd, FieldsAreStoredOneAfterAnother) {
  const PointsRead read =
      ReadText(Head(kFloats, 3) + Compressed(Packed<float>({1, 2, 3, 10, 20, 30, 0.1f, 200, 300})),
               PointFormat::kPcd);
  ASSERT_TRUE(read.status.ok()) << read.status;
  EXPECT_TRUE(read.all_float());
  EXPECT_THAT(read.xyz(), ElementsAre(1, 10, double{0.1f}, 2, 20, 200, 3, 30, 300));
}

// Several types and counts, padding, and x behind other fields. PCL omits padding, other writers do
// not.
TEST(CompressedPcd, EveryTypeCountAndPadding) {
  const std::string fields =
      "FIELDS intensity z _ x fpfh y\nSIZE 1 8 1 2 4 4\nTYPE U F U I F F\nCOUNT 1 1 3 1 2 1\n";
  const std::string before = Packed<uint8_t>({7, 8}) + Packed<double>({0.1, 1e-310});
  const std::string padding(6, '\0');
  const std::string after =
      Packed<int16_t>({-5, 6}) + Packed<float>({9, 9, 9, 9}) + Packed<float>({2.5f, -2.5f});
  for (const std::string& values : {before + after, before + padding + after}) {
    const PointsRead read = ReadText(Head(fields, 2) + Compressed(values), PointFormat::kPcd);
    ASSERT_TRUE(read.status.ok()) << read.status;
    EXPECT_THAT(read.xyz(), ElementsAre(-5, 2.5, 0.1, 6, -2.5, 1e-310));
  }
}

TEST(CompressedPcd, ManyPointsMatchTheUncompressedForm) {
  std::mt19937 random(3);
  std::vector<float> rows;
  std::vector<float> columns(3 * 20000);
  for (size_t i = 0; i < 20000; ++i) {
    for (size_t axis = 0; axis < 3; ++axis) {
      rows.push_back(static_cast<float>(random() % 1000) / 8);
      columns[axis * 20000 + i] = rows.back();
    }
  }
  const PointsRead read =
      ReadText(Head(kFloats, 20000) + Compressed(Packed(columns)), PointFormat::kPcd);
  ASSERT_TRUE(read.status.ok()) << read.status;
  EXPECT_EQ(read.xyz(), std::vector<double>(rows.begin(), rows.end()));
}

TEST(CompressedPcd, HolesCanBeSkipped) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const std::string text =
      Head(kFloats, 3) + Compressed(Packed<float>({nan, 0, 1, nan, -0.0f, 2, nan, 0, 3}));
  EXPECT_THAT(ReadText(text, PointFormat::kPcd).error(), HasSubstr("FILE: point 1 has x = NaN"));
  ReadOptions options;
  options.skip_nonfinite = true;
  options.skip_zero = true;
  const PointsRead read = ReadText(text, PointFormat::kPcd, options);
  EXPECT_THAT(read.xyz(), ElementsAre(1, 2, 3));
  EXPECT_EQ(read.counts.skipped, 1u);
  EXPECT_EQ(read.counts.zeros, 1u);
}

TEST(CompressedPcd, SizesAreCheckedAgainstTheData) {
  const std::string data = Compressed(Packed<float>({1, 2, 3, 4, 5, 6}));
  const std::string head = Head(kFloats, 2);
  const auto error = [&](const std::string& text) {
    return ReadText(text, PointFormat::kPcd).error();
  };
  EXPECT_EQ(error(head + data), "");
  EXPECT_THAT(error(Head(kFloats, 3) + data),
              HasSubstr("decompresses to 24 bytes, but 3 points of 12 bytes are declared"));
  EXPECT_THAT(error(head + data.substr(0, 5)), HasSubstr("within the compressed sizes"));
  EXPECT_THAT(error(head + data.substr(0, data.size() - 1)),
              HasSubstr("bytes of compressed data; is it complete?"));
  std::string damaged = data;
  damaged[8] = '\xff';
  EXPECT_THAT(error(head + damaged), HasSubstr("do not decompress to 24; the file is damaged"));
  // 4 GiB from 8 bytes.
  EXPECT_THAT(error(head + Packed<uint32_t>({8, 0xffffffff}) + "12345678"),
              HasSubstr("8 compressed bytes cannot hold 4294967295"));
  EXPECT_THAT(error(head + Packed<uint32_t>({0xffffffff, 24}) + "1234"),
              HasSubstr("within 4294967295 bytes of compressed data"));
  EXPECT_EQ(error(Head(kFloats, 0) + Packed<uint32_t>({0, 0})), "FILE: contains no points");
}

TEST(PcdFile, RowsBeyondTheDeclaredCountAreErrors) {
  const std::string row = Packed<float>({1, 2, 3});
  const std::string binary =
      "FIELDS X Y Z\nSIZE 4 4 4\nTYPE F F F\nPOINTS 2\nDATA binary\n" + row + row;
  const std::string compressed = Head(kFloats, 2) + Compressed(Packed<float>({1, 1, 2, 2, 3, 3}));
  for (const std::string& text : {binary, compressed}) {
    EXPECT_EQ(ReadText(text + row + row, PointFormat::kPcd).error(),
              "FILE: byte " + std::to_string(text.size()) +
                  ": 24 bytes follow the 2 points that the header declares; correct its count, or "
                  "cut the file here");
    // Padding: less than a row, or zeros, as PCL once wrote them.
    for (const std::string& padding : {std::string("\n"), std::string(4096, '\0')}) {
      EXPECT_THAT(ReadText(text + padding, PointFormat::kPcd).xyz(), ElementsAre(1, 2, 3, 1, 2, 3));
    }
  }
}

TEST(PcdFile, HeadersThatContradictTheirDataAreErrors) {
  const std::string fields = "FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\n";
  const auto error = [&](const std::string& rest) {
    return ReadText(fields + rest, PointFormat::kPcd).error();
  };
  EXPECT_EQ(error("WIDTH 2\nHEIGHT 2\nPOINTS 3\nDATA ascii\n"),
            "FILE:7: POINTS is 3, but WIDTH times HEIGHT is 4");
  EXPECT_EQ(error("POINTS 1\nDATA ascii\n1 2 3\n\n4 5 6\n"),
            "FILE:8: the file has more rows than the 1 POINTS of its header");
  EXPECT_THAT(error("POINTS 0\nDATA binary\n123456789012"),
              HasSubstr("12 bytes follow the 0 points that the header declares"));
  EXPECT_THAT(error("POINTS 1\nDATA zip\n"), HasSubstr("binary and binary_compressed"));
}

}  // namespace pcd_file_test
}  // namespace hulld
