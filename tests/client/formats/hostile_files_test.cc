// Truncated files, false sizes, and noise: each yields an error or points, with little memory and
// time, and no sanitizer finding.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <random>

#include "tests/client/formats/point_reading.h"

namespace hulld {
namespace hostile_files_test {

using testing::AnyOf;
using testing::HasSubstr;

constexpr PointFormat kStreamed[] = {PointFormat::kObj, PointFormat::kOff, PointFormat::kPly,
                                     PointFormat::kXyz, PointFormat::kCsv, PointFormat::kPcd,
                                     PointFormat::kDae};

struct Sample {
  PointFormat format;
  std::string text;
};

std::vector<Sample> Samples() {
  const std::string packed(48, '\x3f');
  return {
      {PointFormat::kObj, "o a\nv 1 2 3\nv 4 5 6\nf 1 2 \\\n 1\n"},
      {PointFormat::kOff, "OFF\n2 1 0\n1 2 3\n4 5 6\n3 0 1 1\n"},
      {PointFormat::kXyz, "1 2 3\n4 5 6\n"},
      {PointFormat::kCsv, "x,y,\"z\"\n1,2,3\n4,5,6\n"},
      {PointFormat::kPly,
       "ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty float y\n"
       "property list uchar int l\nproperty float z\nend_header\n1 2 1 9 3\n4 5 0 6\n"},
      {PointFormat::kPly,
       std::string("ply\nformat binary_little_endian 1.0\nelement a 2\n"
                   "property list uchar uchar l\nelement vertex 2\nproperty float x\n"
                   "property float y\nproperty float z\nend_header\n")
           .append("\x02zz\x00", 4)
           .append(packed, 0, 24)},
      {PointFormat::kPcd,
       "VERSION .7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH 2\nHEIGHT 1\n"
       "POINTS 2\nDATA ascii\n1 2 3\n4 5 6\n"},
      {PointFormat::kPcd,
       "FIELDS x y z w\nSIZE 4 4 4 8\nTYPE F F F U\nCOUNT 1 1 1 1\nWIDTH 2\nHEIGHT 1\n"
       "POINTS 2\nDATA binary\n" +
           packed},
      {PointFormat::kDae,
       "<COLLADA><library_geometries><geometry id='g'><mesh><source id='s'>"
       "<float_array id='a' count='6'>1 2 3 4 5 6</float_array><technique_common>"
       "<accessor source='#a' count='2' stride='3'/></technique_common></source>"
       "<vertices id='v'><input semantic='POSITION' source='#s'/></vertices><lines count='1'>"
       "<input semantic='VERTEX' source='#v' offset='0'/><p>0 1</p></lines></mesh></geometry>"
       "</library_geometries></COLLADA>"},
  };
}

TEST(HostileFiles, EveryPrefixOfAFileIsReadOrRefused) {
  int refused = 0;
  for (const Sample& sample : Samples()) {
    const PointsRead whole = ReadText(sample.text, sample.format);
    ASSERT_TRUE(whole.status.ok()) << whole.status;
    ASSERT_EQ(whole.counts.points, 2u);
    for (size_t length = 0; length < sample.text.size(); ++length) {
      const PointsRead read = ReadText(sample.text.substr(0, length), sample.format);
      if (!read.status.ok()) {
        ++refused;
        EXPECT_THAT(read.error(), HasSubstr("FILE")) << length;
      }
      EXPECT_LE(read.xyz().size(), 6u);
    }
  }
  EXPECT_GT(refused, 300);
}

TEST(HostileFiles, AnyChangedByteIsReadOrRefused) {
  std::mt19937 random(7);
  int refused = 0;
  for (const Sample& sample : Samples()) {
    for (int i = 0; i < 1500; ++i) {
      std::string text = sample.text;
      for (int changes = 1 + i % 3; changes > 0; --changes) {
        text[random() % text.size()] = static_cast<char>(random());
      }
      refused += !ReadText(text, sample.format).status.ok();
    }
  }
  EXPECT_GT(refused, 1000);
}

TEST(HostileFiles, NoiseIsReadOrRefusedByEveryReader) {
  std::mt19937 random(11);
  for (int i = 0; i < 200; ++i) {
    std::string noise;
    for (size_t n = random() % 3000; n > 0; --n) noise += static_cast<char>(random());
    for (const PointFormat format : kStreamed) {
      const PointsRead read = ReadText(noise, format);
      if (read.status.ok()) continue;
      EXPECT_EQ(read.status.code(), absl::StatusCode::kInvalidArgument);
    }
  }
}

// Returns the peak memory of this process in bytes.
long PeakMemory() {
  rusage usage;
  getrusage(RUSAGE_SELF, &usage);
  return usage.ru_maxrss * 1024;
}

TEST(HostileFiles, DeclaredCountsAllocateNothing) {
  const std::string huge = "18446744073709551615";
  const std::string point(12, '\0');
  const long before = PeakMemory();
  const Sample samples[] = {
      {PointFormat::kOff, "OFF\n" + huge + " 0 0\n1 2 3\n"},
      {PointFormat::kPly,
       "ply\nformat ascii 1.0\nelement vertex " + huge +
           "\nproperty float x\nproperty float y\nproperty float z\nend_header\n1 2 3\n"},
      {PointFormat::kPly, "ply\nformat binary_big_endian 1.0\nelement vertex " + huge +
                              "\nproperty float x\nproperty float y\nproperty float z\n"
                              "end_header\n" +
                              point},
      {PointFormat::kPcd, "FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nPOINTS " + huge +
                              "\nDATA binary\n" + point},
      {PointFormat::kPcd, "FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nPOINTS " + huge +
                              "\nDATA ascii\n1 2 3\n"},
      {PointFormat::kDae,
       "<COLLADA><g><geometry><mesh><source id='s'><float_array id='a'>1 2 3"
       "</float_array><technique_common><accessor source='#a' count='4294967295' stride='3'/>"
       "</technique_common></source><vertices><input semantic='POSITION' source='#s'/></vertices>"
       "</mesh></geometry></g></COLLADA>"},
  };
  for (const Sample& sample : samples) {
    const PointsRead read = ReadText(sample.text, sample.format);
    EXPECT_THAT(read.error(), AnyOf(HasSubstr("is it complete?"), HasSubstr("needs more than")));
  }
  EXPECT_LT(PeakMemory() - before, 64l << 20);
}

TEST(HostileFiles, AListOfFourBillionItemsIsSkippedOnlyToTheEndOfTheFile) {
  const std::string head =
      "ply\nformat binary_little_endian 1.0\nelement vertex 1\nproperty list uint double l\n"
      "property float x\nproperty float y\nproperty float z\nend_header\n";
  EXPECT_THAT(
      ReadText(head + "\xff\xff\xff\xff" + std::string(100, 'x'), PointFormat::kPly).error(),
      HasSubstr("within the element vertex"));
}

TEST(HostileFiles, ANegativeListCountIsRefused) {
  const std::string head =
      "ply\nformat binary_little_endian 1.0\nelement vertex 1\nproperty list char int l\n"
      "property float x\nproperty float y\nproperty float z\nend_header\n";
  EXPECT_THAT(ReadText(head + "\xff" + std::string(100, 'x'), PointFormat::kPly).error(),
              HasSubstr("the count of a list is negative"));
}

TEST(HostileFiles, ElementsWithoutPropertiesTakeNoTime) {
  const std::string text =
      "ply\nformat binary_little_endian 1.0\nelement nothing 18446744073709551615\n"
      "element vertex 1\nproperty char x\nproperty char y\nproperty char "
      "z\nend_header\n\x01\x02\x03";
  const PointsRead read = ReadText(text, PointFormat::kPly);
  EXPECT_TRUE(read.status.ok()) << read.status;
  EXPECT_THAT(read.xyz(), testing::ElementsAre(1, 2, 3));
}

TEST(HostileFiles, ARowOfManyGigabytesIsRefused) {
  EXPECT_THAT(ReadText("FIELDS x y z big\nSIZE 4 4 4 8\nTYPE F F F F\nCOUNT 1 1 1 4000000000\n"
                       "POINTS 1\nDATA binary\nxx",
                       PointFormat::kPcd)
                  .error(),
              HasSubstr("too large"));
  EXPECT_THAT(ReadText("FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nWIDTH 4294967296\nHEIGHT 4294967296\n"
                       "DATA binary\nxx",
                       PointFormat::kPcd)
                  .error(),
              HasSubstr("WIDTH times HEIGHT exceeds 2^64"));
}

}  // namespace hostile_files_test
}  // namespace hulld
