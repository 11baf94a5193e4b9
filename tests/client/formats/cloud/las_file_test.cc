#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <boost/multiprecision/cpp_int.hpp>
#include <cmath>
#include <cstring>
#include <limits>
#include <random>

#include "tests/client/formats/point_reading.h"

namespace hulld {
namespace las_file_test {

using testing::ElementsAre;
using testing::HasSubstr;

// A LAS file with three integers per point.
struct LasText {
  int minor = 2;
  int format = 0;
  uint16_t record_bytes = 20;
  double scale[3] = {0.01, 0.01, 0.001};
  double offset[3] = {0, 100, -5};
  std::vector<int32_t> xyz;
  // Bytes between the header and the points.
  size_t gap = 0;

  uint64_t count() const { return xyz.size() / 3; }

  std::string Text() const {
    std::string text(minor == 4 ? 375 : minor == 3 ? 235 : 227, '\0');
    const auto put = [&text](size_t at, auto value) {
      std::memcpy(text.data() + at, &value, sizeof(value));
    };
    text.replace(0, 4, "LASF");
    put(24, uint8_t{1});
    put(25, static_cast<uint8_t>(minor));
    put(94, static_cast<uint16_t>(text.size()));
    put(96, static_cast<uint32_t>(text.size() + gap));
    put(104, static_cast<uint8_t>(format));
    put(105, record_bytes);
    if (format < 6) put(107, static_cast<uint32_t>(count()));
    for (size_t axis = 0; axis < 3; ++axis) {
      put(131 + 8 * axis, scale[axis]);
      put(155 + 8 * axis, offset[axis]);
    }
    if (minor == 4) put(247, count());
    text.append(gap, 'v');
    for (size_t i = 0; i < xyz.size(); i += 3) {
      std::string record(record_bytes, '\x7f');
      std::memcpy(record.data(), xyz.data() + i, 12);
      text += record;
    }
    return text;
  }
};

PointsRead Read(const LasText& las) { return ReadText(las.Text(), PointFormat::kLas); }

TEST(LasFile, EveryVersionAndPointFormat) {
  constexpr uint16_t kBytes[] = {20, 28, 26, 34, 57, 63, 30, 36, 38, 59, 67};
  for (int minor = 0; minor <= 4; ++minor) {
    for (int format = 0; format <= (minor == 4 ? 10 : minor == 3 ? 5 : 3); ++format) {
      LasText las;
      las.minor = minor;
      las.format = format;
      las.gap = 54;
      // Some writers add bytes to each record.
      las.record_bytes = static_cast<uint16_t>(kBytes[format] + 3 * (format % 2));
      las.xyz = {100, -200, 3000, 7, 8, -9};
      const PointsRead read = Read(las);
      ASSERT_TRUE(read.status.ok()) << read.status;
      EXPECT_THAT(read.xyz(), ElementsAre(1, 98, -2, 0.07, 100.08, -5.009)) << minor << format;
    }
  }
}

// Expects the double nearest to integer * scale + offset, in rational arithmetic.
TEST(LasFile, CoordinatesAreRoundedOnce) {
  using Rational = boost::multiprecision::cpp_rational;
  using Integer = boost::multiprecision::cpp_int;
  const auto exact = [](double x) {
    int exponent = 0;
    const auto mantissa = static_cast<int64_t>(std::ldexp(std::frexp(x, &exponent), 53));
    const Integer power = Integer(1) << std::abs(exponent - 53);
    return exponent >= 53 ? Rational(mantissa) * power : Rational(mantissa) / power;
  };
  std::mt19937_64 random(17);
  int differs = 0;
  for (int i = 0; i < 2000; ++i) {
    LasText las;
    for (size_t axis = 0; axis < 3; ++axis) {
      las.scale[axis] = i % 2 == 0 ? 0.001 : std::ldexp(static_cast<double>(random()), -70);
      las.offset[axis] = static_cast<double>(random() % 10000000) / 7;
      las.xyz.push_back(static_cast<int32_t>(random()));
    }
    const std::vector<double> xyz = Read(las).xyz();
    ASSERT_EQ(xyz.size(), 3u);
    for (size_t axis = 0; axis < 3; ++axis) {
      const Rational value =
          Rational(las.xyz[axis]) * exact(las.scale[axis]) + exact(las.offset[axis]);
      const Rational error = abs(exact(xyz[axis]) - value);
      EXPECT_LE(error, abs(exact(std::nextafter(xyz[axis], HUGE_VAL)) - value));
      EXPECT_LE(error, abs(exact(std::nextafter(xyz[axis], -HUGE_VAL)) - value));
      const double product = las.xyz[axis] * las.scale[axis];
      differs += xyz[axis] != product + las.offset[axis] ? 1 : 0;
    }
  }
  EXPECT_GT(differs, 100);
}

TEST(LasFile, CompressedFilesAreRefusedByName) {
  LasText las;
  las.format = 128 + 3;
  las.record_bytes = 34;
  las.xyz = {1, 2, 3};
  EXPECT_THAT(Read(las).error(), HasSubstr("compressed (LAZ); decompress the file first"));
  EXPECT_EQ(*PointFormatOfPath("scan.LAZ"), PointFormat::kLas);
}

TEST(LasFile, FilesWithMissingPointsAreErrors) {
  LasText las;
  las.xyz = {1, 2, 3, 4, 5, 6};
  const std::string text = las.Text();
  EXPECT_THAT(ReadText(text.substr(0, text.size() - 1), PointFormat::kLas).error(),
              HasSubstr("after 1 of 2 points; is it complete?"));
  EXPECT_THAT(ReadText(text.substr(0, 200), PointFormat::kLas).error(),
              HasSubstr("within the header"));
  LasText far = las;
  far.gap = 100;
  EXPECT_THAT(ReadText(far.Text().substr(0, 300), PointFormat::kLas).error(),
              HasSubstr("before the points at byte 327"));
  // An interrupted writer leaves the count at 0.
  std::string none = text;
  std::memset(none.data() + 107, 0, 4);
  EXPECT_THAT(ReadText(none, PointFormat::kLas).error(),
              HasSubstr("40 bytes follow the 0 points that the header declares"));
}

TEST(LasFile, RecordsBeyondTheDeclaredCountAreErrors) {
  for (const int minor : {2, 3, 4}) {
    LasText las;
    las.minor = minor;
    las.xyz = {100, 200, 3000, 4, 5, 6};
    const std::string text = las.Text();
    const std::string record(20, 'r');
    EXPECT_EQ(ReadText(text + record + record, PointFormat::kLas).error(),
              "FILE: byte " + std::to_string(text.size()) +
                  ": 40 bytes follow the 2 points that the header declares; correct its count, or "
                  "cut the file here");
    for (const std::string& padding : {std::string("\r\n"), std::string(512, '\0')}) {
      EXPECT_EQ(ReadText(text + padding, PointFormat::kLas).counts.points, 2u);
    }
  }
}

// Waveforms of LAS 1.3, and extended records of LAS 1.4.
TEST(LasFile, OtherRecordsMayFollowThePoints) {
  for (const int minor : {3, 4}) {
    LasText las;
    las.minor = minor;
    las.xyz = {100, 200, 3000, 4, 5, 6};
    const size_t field = minor == 3 ? 227 : 235;
    for (const size_t gap : {0, 19, 20}) {
      std::string text = las.Text() + std::string(gap, 'r');
      const uint64_t start = text.size();
      std::memcpy(text.data() + field, &start, sizeof(start));
      if (minor == 4) text[243] = 1;
      text += std::string(100, 'e');
      EXPECT_EQ(ReadText(text, PointFormat::kLas).status.ok(), gap < 20) << gap;
      if (gap < 20) continue;
      EXPECT_THAT(ReadText(text, PointFormat::kLas).error(), HasSubstr(": 20 bytes follow the 2"));
    }
  }
}

// A field of 0 says nothing about the number of points.
TEST(LasFile, OneOfTheTwoCountsMayBeZero) {
  LasText las;
  las.minor = 4;
  las.xyz = {100, 200, 3000, 400, 500, 6000};
  for (const size_t field : {107, 247}) {
    std::string text = las.Text();
    text[field] = 0;
    EXPECT_EQ(ReadText(text, PointFormat::kLas).counts.points, 2u) << field;
  }
}

TEST(LasFile, CountsThatContradictEachOtherAreErrors) {
  LasText two;
  two.xyz = {1, 2, 3, 4, 5, 6};
  two.minor = 4;
  std::string disagreeing = two.Text();
  disagreeing[247] = 9;
  EXPECT_THAT(ReadText(disagreeing, PointFormat::kLas).error(),
              HasSubstr("declares 2 points in its legacy field and 9 in its LAS 1.4 field"));
}

TEST(LasFile, UnsupportedHeadersAreErrors) {
  LasText las;
  las.xyz = {1, 2, 3};
  const auto changed = [&](auto change) {
    LasText other = las;
    change(&other);
    return Read(other).error();
  };
  EXPECT_THAT(changed([](LasText* l) { l->minor = 5; }), HasSubstr("LAS 1.5 is not supported"));
  EXPECT_THAT(changed([](LasText* l) { l->format = 11; }), HasSubstr("point format 11 is unknown"));
  EXPECT_THAT(changed([](LasText* l) { l->format = 1; }),
              HasSubstr("a record of point format 1 needs 28 bytes, not 20"));
  EXPECT_THAT(changed([](LasText* l) { l->scale[1] = 0; }), HasSubstr("the scale of y must be"));
  EXPECT_THAT(changed([](LasText* l) { l->offset[2] = HUGE_VAL; }), HasSubstr("the scale of z"));
  EXPECT_EQ(ReadText("LAS", PointFormat::kLas).error(),
            "FILE: byte 0: a LAS file starts with LASF");
  // Skipping it as infinite would lose a point.
  las.scale[0] = 1e308;
  las.xyz[0] = 1000;
  ReadOptions options;
  options.skip_nonfinite = true;
  EXPECT_EQ(ReadText(las.Text(), PointFormat::kLas, options).error(),
            "FILE: byte 227: a coordinate exceeds the largest double");
}

}  // namespace las_file_test
}  // namespace hulld
