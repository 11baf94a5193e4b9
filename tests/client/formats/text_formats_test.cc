// OBJ, OFF, XYZ, CSV, and the text forms of PLY and PCD.
#include <absl/strings/str_cat.h>
#include <absl/strings/str_replace.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "client/formats/mesh_file.h"
#include "tests/client/formats/point_reading.h"

namespace hulld {
namespace text_formats_test {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

TEST(ObjFile, ReadsEachVLineAndNothingElse) {
  const PointsRead read = ReadText(
      "# v 9 9 9\no thing\nv 1 2 3\nvn 5 5 5\nvt 0 1\n  v\t+4 -5e-1 .5 1.0\nv 7 8 9 0.1 0.2 0.3\n"
      "f 1 2 3\nvp 1 2 3\n",
      PointFormat::kObj);
  EXPECT_TRUE(read.status.ok()) << read.status;
  EXPECT_THAT(read.xyz(), ElementsAre(1, 2, 3, 4, -0.5, 0.5, 7, 8, 9));
}

TEST(ObjFile, ABackslashContinuesALine) {
  EXPECT_THAT(ReadText("v 1 \\\n2 3\nf 1 \\\n 2\nv 4 5 6", PointFormat::kObj).xyz(),
              ElementsAre(1, 2, 3, 4, 5, 6));
}

// The next vertex was lost.
TEST(ObjFile, ABackslashEndsNamesAndComments) {
  EXPECT_THAT(
      ReadText("mtllib c:\\a\\\nv 1 2 3 # c:\\b\\\nv 4 5 6\ng d:\\c\\\nv 7 8 9\n# \\\nv 0 0 0",
               PointFormat::kObj)
          .xyz(),
      ElementsAre(1, 2, 3, 4, 5, 6, 7, 8, 9, 0, 0, 0));
}

// The vertex was lost.
TEST(ObjFile, AKeywordWithoutASpaceIsAnError) {
  EXPECT_EQ(ReadText("v 1 2 3\nv4 5 6\n", PointFormat::kObj).error(),
            "FILE:2: \"v4\" is not a statement; separate \"v\" from its first number with a space");
  EXPECT_THAT(ReadText("v\xC2\xA0 1 2 3\n", PointFormat::kObj).error(),
              HasSubstr("is not a statement"));
}

TEST(ObjFile, ErrorsNameFileAndLine) {
  EXPECT_EQ(ReadText("v 1 2 3\n\nv 1 abc 3\n", PointFormat::kObj).error(),
            "FILE:3: \"abc\" is not a number");
  EXPECT_EQ(ReadText("v 1 2\n", PointFormat::kObj).error(),
            "FILE:1: a point needs 3 coordinates, got 2");
}

// Modeled on malformed.obj, malformed2.obj, and empty.obj of assimp-testmodels, which were formerly
// accepted.
TEST(ObjFile, ReferencesToOtherFilesAreErrors) {
  EXPECT_EQ(ReadText("v 1 2 3\ncall part 2.obj\nv 4 5 6\n", PointFormat::kObj).error(),
            "FILE:2: the file refers to \"part 2.obj\", which is not read; insert the content of "
            "that file here, and remove \"call\"");
  EXPECT_THAT(ReadText("v 1 2 3\ncsh -make\n", PointFormat::kObj).error(),
              HasSubstr("FILE:2: the file refers to \"-make\""));
}

TEST(ObjFile, FacesOfABrokenFileAreErrors) {
  const std::string vertices = "v 1 2 3\nv 4 5 6\n";
  EXPECT_EQ(ReadText(vertices + "f 1 2\nf 1/7 3//1 2\n", PointFormat::kObj).error(),
            "FILE:4: a face names vertex 3, but the file has 2");
  EXPECT_EQ(ReadText(vertices + "f 1 0 2\n", PointFormat::kObj).error(),
            "FILE:3: \"0\" is not a vertex; 2 precede this line");
  EXPECT_THAT(ReadText(vertices + "f -1 -3\n", PointFormat::kObj).error(),
              HasSubstr("FILE:3: \"-3\" is not a vertex"));
  EXPECT_EQ(ReadText(vertices + "f\n", PointFormat::kObj).error(),
            "FILE:3: a face names no vertex");
  EXPECT_EQ(ReadText("", PointFormat::kObj).error(),
            "FILE: contains no vertices: no line starts with v; is it an OBJ file?");
}

// The OBJ reader ignores lines with an unknown keyword, so a block of zeros used to hide vertices.
TEST(TextFiles, BytesThatNoTextContainsAreErrors) {
  const std::string zeros(4, '\0');
  EXPECT_THAT(ReadText("v 1 2 3\n" + zeros + "\nv 4 5 6\n", PointFormat::kObj).error(),
              HasSubstr("FILE:2: the line contains the byte 0 (NUL)"));
  EXPECT_THAT(ReadText("1 2 3\n4 5 6" + zeros, PointFormat::kXyz).error(),
              HasSubstr("FILE:2: the line contains the byte 0 (NUL)"));
  EXPECT_THAT(ReadText("x,y,z\n1,2,3\n" + zeros, PointFormat::kCsv).error(),
              HasSubstr("FILE:3: the line contains the byte 0 (NUL)"));
  for (const char* text : {"1 2 3\n4 5 6\x1A", "1 2 3\r\n4 5 6\r\n\x1A"}) {
    EXPECT_THAT(ReadText(text, PointFormat::kXyz).xyz(), ElementsAre(1, 2, 3, 4, 5, 6));
  }
  EXPECT_THAT(ReadText("v 1 2 3\n\x1A", PointFormat::kObj).xyz(), ElementsAre(1, 2, 3));
  EXPECT_THAT(ReadText("OFF\n1 0 0\n1 2 3\n\x1A", PointFormat::kOff).xyz(), ElementsAre(1, 2, 3));
  EXPECT_THAT(ReadText("x,y,z\n1,2,3\n\x1A", PointFormat::kCsv).xyz(), ElementsAre(1, 2, 3));
}

// A CR in a file with other line ends was white space: points after it were lost, unnoticed.
TEST(TextFiles, LineEndsMayVary) {
  EXPECT_THAT(ReadText("1 2 3\n4 5 6\r7 8 9\r\n", PointFormat::kXyz).xyz(),
              ElementsAre(1, 2, 3, 4, 5, 6, 7, 8, 9));
  EXPECT_THAT(ReadText("1 2 3\r4 5 6\n7 8 9\r", PointFormat::kXyz).xyz(),
              ElementsAre(1, 2, 3, 4, 5, 6, 7, 8, 9));
  EXPECT_THAT(ReadText("x,y,z\r\n1,2,3\r4,5,6\n", PointFormat::kCsv).xyz(),
              ElementsAre(1, 2, 3, 4, 5, 6));
  EXPECT_THAT(ReadText("# a\nv 1 2 3\n# b\rv 4 5 6\n", PointFormat::kObj).xyz(),
              ElementsAre(1, 2, 3, 4, 5, 6));
  EXPECT_THAT(ReadText("OFF\n2 0 0\n1 2 3\r4 5 6\n", PointFormat::kOff).xyz(),
              ElementsAre(1, 2, 3, 4, 5, 6));
  EXPECT_THAT(ReadText("solid a\nfacet outer loop vertex 1 2 3 vertex 4 5 6 vertex 7 8 9\n"
                       "endloop endfacet\nendsolid a\rsolid b\rfacet outer loop vertex 1 0 0 "
                       "vertex 2 0 0 vertex 3 0 0 endloop endfacet endsolid b\n",
                       PointFormat::kStl)
                  .counts.points,
              6u);
}

TEST(XyzFile, CoordinatesArriveAsTheNearestDoubles) {
  const PointsRead read =
      ReadText("1e-310 0.1 -1e308\n5e-324 9007199254740993 1e-400 extra 7\n", PointFormat::kXyz);
  EXPECT_TRUE(read.status.ok()) << read.status;
  EXPECT_THAT(read.xyz(), ElementsAre(1e-310, 0.1, -1e308, 0x1p-1074, 9007199254740992.0, 0.0));
}

TEST(XyzFile, SkipsCommentsAndBlankLines) {
  EXPECT_THAT(ReadText("# x y z\n\n  1 2 3 # end\r\n\t\n4\t5\t6", PointFormat::kXyz).xyz(),
              ElementsAre(1, 2, 3, 4, 5, 6));
}

TEST(XyzFile, HeadersOfCloudCompareAreComments) {
  EXPECT_THAT(ReadText("//X Y Z R G B\n1 2 3 0 0 0\n", PointFormat::kXyz).xyz(),
              ElementsAre(1, 2, 3));
}

// Cut at the comment mark, the third coordinate would be 1.
TEST(XyzFile, InfinitiesWithACommentMarkAreNotTruncated) {
  EXPECT_EQ(ReadText("1 2 3\n4 5 1.#INF\n", PointFormat::kXyz).error(),
            "FILE:2: point 2 has z = infinity; skip such points with --skip-nonfinite");
  EXPECT_THAT(ReadText("OFF\n1 0 0\n1 2 -1.#IND\n", PointFormat::kOff).error(),
              HasSubstr("z = NaN"));
  EXPECT_THAT(ReadText("v 1 2 1.#QNAN\n", PointFormat::kObj).error(), HasSubstr("z = NaN"));
  EXPECT_THAT(ReadText("v 1 2 3#c\n", PointFormat::kObj).xyz(), ElementsAre(1, 2, 3));
}

TEST(XyzFile, NumbersMayBeSeparatedByCommasOrSemicolons) {
  for (const char* text :
       {"1,2,3\n4,5,6\n", "1, 2, 3\n4 , 5\t,6\n", "1;2;3;255;0\n4; 5; 6\n",
        "1,2,3,255,0,0\n4,5,6,\n", "1 2 3\n4,5,6 # a, b\n", "1 2 3 a,b\n4 5 6 c;d\n"}) {
    const PointsRead read = ReadText(text, PointFormat::kXyz);
    EXPECT_TRUE(read.status.ok()) << read.status << "\n" << text;
    EXPECT_THAT(read.xyz(), ElementsAre(1, 2, 3, 4, 5, 6)) << text;
  }
}

// A header was refused with the advice to use --format csv.
TEST(XyzFile, AHeaderNamesTheColumns) {
  for (const char* text :
       {"x y z\n1 2 3\n", "\nX,Y,Z\n1,2,3\n", "id;z;y;x\n7;3;2;1\n", "x\ty\tz\n1\t2\t3\n",
        "x y z\n1\t2  3\n", "# saved today\nt z y x\n0 3 2 1\n", "# t x y z\n0 1 2 3\n",
        "// t,x,y,z\n0,1,2,3\n", "# columns: x y z\n1 2 3\n", "//X Y Z R\n1\n1 2 3 9\n",
        "\"Points:0\",\"Points:1\",\"Points:2\",\"T\"\n1,2,3,nan\n"}) {
    for (const PointFormat format : {PointFormat::kXyz, PointFormat::kCsv}) {
      // Only XYZ has counts.
      if (format == PointFormat::kCsv && text[0] == '/' && text[2] == 'X') continue;
      const PointsRead read = ReadText(text, format);
      EXPECT_TRUE(read.status.ok()) << read.status << "\n" << text;
      EXPECT_THAT(read.xyz(), ElementsAre(1, 2, 3)) << text;
    }
  }
}

TEST(XyzFile, AnAmbiguousHeaderIsAnError) {
  for (const PointFormat format : {PointFormat::kXyz, PointFormat::kCsv}) {
    EXPECT_EQ(ReadText("x,y,z,X\n1,2,3,4\n", format).error(),
              "FILE:1: the header \"x,y,z,X\" names x in columns 1 and 4; it must name x, y and z "
              "once");
    EXPECT_THAT(ReadText("Points:0,Points:1,Points:2,z\n1,2,3,4\n", format).error(),
                HasSubstr("names z in columns 3 and 4"));
    EXPECT_EQ(ReadText("a b c\n1 2 3\n", format).error(),
              "FILE:1: the header \"a b c\" has no column \"x\"; it must name x, y and z");
  }
}

TEST(XyzFile, CommasThatMayBeDecimalMarksAreErrors) {
  const auto error = [](const char* text) { return ReadText(text, PointFormat::kXyz).error(); };
  EXPECT_THAT(error("1,5 2,5 3,5\n"),
              HasSubstr("FILE:1: \"1,5 2,5 3,5\" has white space and \",\" between its numbers"));
  EXPECT_THAT(error("1 2 3\n1,2,3 255 0 0\n"), HasSubstr("FILE:2:"));
  EXPECT_THAT(error("1,5;2,5;3,5\n"), HasSubstr("use a point as the decimal mark"));
  EXPECT_THAT(error("1,,3\n"), HasSubstr("\"\" is not a number"));
  EXPECT_EQ(error("1,2\n"), "FILE:1: a point needs 3 coordinates, got 2");
}

TEST(SkipZero, DropsAndCountsPointsAtExactlyZero) {
  ReadOptions options;
  options.skip_zero = true;
  const PointsRead read =
      ReadText("0 0 0\n1 0 0\n-0 0.0 0e5\n0 0 5e-324\n", PointFormat::kXyz, options);
  EXPECT_THAT(read.xyz(), ElementsAre(1, 0, 0, 0, 0, 0x1p-1074));
  EXPECT_EQ(read.counts.zeros, 2u);
  EXPECT_EQ(read.counts.points, 2u);
  EXPECT_THAT(ReadText("0 0 0\n", PointFormat::kXyz).xyz(), ElementsAre(0, 0, 0));
}

TEST(XyzFile, ANumberTooLargeIsAnErrorEvenWhenNonFinitePointsAreSkipped) {
  ReadOptions options;
  options.skip_nonfinite = true;
  EXPECT_THAT(ReadText("1 2 3\n1 1e999 3\n", PointFormat::kXyz, options).error(),
              HasSubstr("FILE:2: \"1e999\" exceeds the largest double"));
}

TEST(XyzFile, NonFinitePointsAreErrorsThatNameFileAndPoint) {
  EXPECT_EQ(ReadText("1 2 3\n4 nan 6\n", PointFormat::kXyz).error(),
            "FILE:2: point 2 has y = NaN; skip such points with --skip-nonfinite");
  EXPECT_THAT(ReadText("1 2 -inf\n", PointFormat::kXyz).error(), HasSubstr("point 1 has z = inf"));
}

TEST(XyzFile, NonFinitePointsCanBeSkippedAndCounted) {
  ReadOptions options;
  options.skip_nonfinite = true;
  const PointsRead read =
      ReadText("nan nan nan\n1 2 3\n1 Inf 3\n4 5 6\n", PointFormat::kXyz, options);
  EXPECT_TRUE(read.status.ok()) << read.status;
  EXPECT_THAT(read.xyz(), ElementsAre(1, 2, 3, 4, 5, 6));
  EXPECT_EQ(read.counts.skipped, 2u);
  EXPECT_EQ(read.counts.points, 2u);
}

TEST(Blocks, HaveTheRequestedNumberOfPoints) {
  ReadOptions options;
  options.points_per_block = 2;
  const PointsRead read =
      ReadText("1 1 1\n2 2 2\n3 3 3\n4 4 4\n5 5 5\n", PointFormat::kXyz, options);
  ASSERT_EQ(read.blocks.size(), 3u);
  EXPECT_EQ(read.blocks[0].size(), 2u);
  EXPECT_EQ(read.blocks[2].size(), 1u);
  EXPECT_THAT(read.xyz(), ElementsAre(1, 1, 1, 2, 2, 2, 3, 3, 3, 4, 4, 4, 5, 5, 5));
}

TEST(Blocks, AreAboutOneMebibyteByDefault) {
  std::string text;
  for (int i = 0; i < 50000; ++i) text += "1 2 3\n";
  const PointsRead read = ReadText(text, PointFormat::kXyz);
  ASSERT_EQ(read.blocks.size(), 2u);
  EXPECT_EQ(read.blocks[0].size(), (1u << 20) / 24);
}

TEST(Blocks, AnErrorOfTheReceiverStopsReading) {
  const TempFile file("points", "1 2 3\n4 5 6\n7 8 9\n");
  ReadRequest request{file.path(), PointFormat::kXyz, {}, {}};
  request.options.points_per_block = 1;
  int calls = 0;
  const auto counts = ReadPoints(request, [&](const PointChunk&) {
    return ++calls == 2 ? absl::AbortedError("enough") : absl::OkStatus();
  });
  EXPECT_EQ(counts.status(), absl::AbortedError("enough"));
  EXPECT_EQ(calls, 2);
}

TEST(CsvFile, ReadsRowsWithoutAHeader) {
  EXPECT_THAT(ReadText("1,2,3\n4, 5 ,6,extra\n\n# note\n", PointFormat::kCsv).xyz(),
              ElementsAre(1, 2, 3, 4, 5, 6));
}

TEST(CsvFile, FindsColumnsByTheHeader) {
  EXPECT_THAT(ReadText("id,Z,\"x\",Y\n7,3,1,2\n8,\"6\",4,5\n", PointFormat::kCsv).xyz(),
              ElementsAre(1, 2, 3, 4, 5, 6));
  EXPECT_THAT(ReadText("//X,Y,Z,R\n1,2,3,9\n", PointFormat::kCsv).xyz(), ElementsAre(1, 2, 3));
}

// A mark with a space after it hid the first name, so that the row was taken for a comment and the
// columns for x, y, and z.
TEST(CsvFile, AHeaderMayBeAComment) {
  for (const char* text : {"# z,y,x\n3,2,1\n", "# z y x i\n3 2 1 9\n", "#z\ty\tx\n3\t2\t1\n",
                           "# saved today\n####\n\n// z;y;x\n3;2;1\n", "# frame x\n1 2 3\n"}) {
    EXPECT_THAT(ReadText(text, PointFormat::kCsv).xyz(), ElementsAre(1, 2, 3)) << text;
  }
}

// pandas names a column that has no name after its number.
TEST(CsvFile, AHeaderMayNameColumnsLikeNumbers) {
  EXPECT_THAT(ReadText("x,y,z,0\n1,2,3,9\n", PointFormat::kCsv).xyz(), ElementsAre(1, 2, 3));
}

// The numbers of the columns were read as the point (0, 1, 2).
TEST(CsvFile, AHeaderThatMayBeAPointIsAnError) {
  for (const char* text : {"0,1,2\n0.5,1.5,2.5\n", "0,1,2,3\n5,6,7,0.5\n", "0 1 2\n\n1.0 2 3\n",
                           "\"0\";\"1\";\"2\"\n1e3;2;3\n", "# saved\n0\t1\t2\nnan\t2\t3\n"}) {
    for (const PointFormat format : {PointFormat::kXyz, PointFormat::kCsv}) {
      // Quotes occur only in CSV.
      if (format == PointFormat::kXyz && text[0] == '"') continue;
      EXPECT_THAT(ReadText(text, format).error(),
                  HasSubstr("may be a point, or a header that numbers the columns, as pandas"))
          << text;
    }
  }
  EXPECT_EQ(ReadText("0,1,2\n0.5,1.5,2.5\n", PointFormat::kCsv).error(),
            "FILE:1: \"0,1,2\" may be a point, or a header that numbers the columns, as pandas "
            "writes it; replace it with x,y,z if it is a header, or insert x,y,z above it");
}

TEST(CsvFile, ARowOfNumbersThatIsNoHeaderIsAPoint) {
  for (const PointFormat format : {PointFormat::kXyz, PointFormat::kCsv}) {
    EXPECT_THAT(ReadText("0,1,2\n3,-4,5\n", format).xyz(), ElementsAre(0, 1, 2, 3, -4, 5));
    EXPECT_THAT(ReadText("0,1,2", format).xyz(), ElementsAre(0, 1, 2));
    EXPECT_THAT(ReadText("0,1,2\n# 0.5\n0.5,1,2\n", format).xyz(), ElementsAre(0, 1, 2, 0.5, 1, 2));
    EXPECT_THAT(ReadText("0,1.0,2\n3.5,4,5\n", format).xyz(), ElementsAre(0, 1, 2, 3.5, 4, 5));
    EXPECT_THAT(ReadText("1,2,3\n3.5,4,5\n", format).xyz(), ElementsAre(1, 2, 3, 3.5, 4, 5));
    EXPECT_THAT(ReadText("x,y,z\n0,1,2\n0.5,1,2\n", format).xyz(), ElementsAre(0, 1, 2, 0.5, 1, 2));
  }
}

// pandas leaves the name of the index empty.
TEST(CsvFile, AHeaderMayNumberTheColumnsAfterAnIndex) {
  for (const PointFormat format : {PointFormat::kXyz, PointFormat::kCsv}) {
    EXPECT_THAT(ReadText(",0,1,2\n0,1.5,2,3\n1,4,5,6\n", format).xyz(),
                ElementsAre(1.5, 2, 3, 4, 5, 6));
  }
}

TEST(CsvFile, NamesMayHaveAUnitOrAPath) {
  for (const char* text :
       {"X [m],Y [m],Z [m]\n1,2,3\n", "id;z(mm);y(mm);x(mm)\n7;3;2;1\n",
        "X [m] Y [m] Z [m] I\n1 2 3 9\n", "x (m)\ty (m)\tz (m)\n1\t2\t3\n",
        "\"x[m]\",\"y[m]\",\"z[m]\"\n1,2,3\n",
        "%time,field.header.seq,field.point.x,field.point.y,field.point.z\n17,0,1,2,3\n",
        "t,Position.X,Position.Y,Position.Z\n0,1,2,3\n"}) {
    for (const PointFormat format : {PointFormat::kXyz, PointFormat::kCsv}) {
      EXPECT_THAT(ReadText(text, format).xyz(), ElementsAre(1, 2, 3)) << text;
    }
  }
  // A plain name decides.
  EXPECT_THAT(ReadText("x [px],x,y,z,n.x,n.y,n.z\n9,1,2,3,7,7,7\n", PointFormat::kCsv).xyz(),
              ElementsAre(1, 2, 3));
  EXPECT_THAT(ReadText("p.x,p.y,p.z,v.x,v.y,v.z\n1,2,3,4,5,6\n", PointFormat::kCsv).error(),
              HasSubstr("names x in columns 1 and 4"));
}

TEST(CsvFile, PercentSignsStartComments) {
  for (const PointFormat format : {PointFormat::kXyz, PointFormat::kCsv}) {
    EXPECT_THAT(ReadText("% Created by Octave\n%\n1 2 3\n % end\n", format).xyz(),
                ElementsAre(1, 2, 3));
    EXPECT_THAT(ReadText("% z y x\n3 2 1\n", format).xyz(), ElementsAre(1, 2, 3));
  }
}

TEST(CsvFile, WhiteSpaceSeparatesCellsIfTheFirstRowHasNoOtherSeparator) {
  EXPECT_THAT(ReadText("x y z\n1 2 3\n 4  5 6 \n", PointFormat::kCsv).xyz(),
              ElementsAre(1, 2, 3, 4, 5, 6));
  EXPECT_THAT(ReadText("\"z\" \"Y\" X\n3 \"2\" 1\n", PointFormat::kCsv).xyz(),
              ElementsAre(1, 2, 3));
  EXPECT_THAT(ReadText("1 2 3\n", PointFormat::kCsv).xyz(), ElementsAre(1, 2, 3));
}

// R's write.table names the columns of the data, but not that of the row names, so that each value
// was read from the column before it.
TEST(CsvFile, RowsWithMoreCellsThanTheHeaderAreErrors) {
  for (const char* text : {"x,y,z\n7,1,2,3\n", "\"x\" \"y\" \"z\"\n\"7\" 1 2 3\n"}) {
    EXPECT_EQ(ReadText(text, PointFormat::kCsv).error(),
              "FILE:2: the row has 4 columns, but the header names 3; name each column")
        << text;
  }
  EXPECT_THAT(ReadText("x,y,z\n1,2,3,\n", PointFormat::kCsv).xyz(), ElementsAre(1, 2, 3));
}

// The last row was read as 7 8 910.
TEST(TextTable, RowsJoinedByALostLineEndAreErrors) {
  for (const PointFormat format : {PointFormat::kCsv, PointFormat::kXyz}) {
    for (const char* separator : {",", ";", "\t", " "}) {
      const auto read = [=](const char* last) {
        return ReadText(
            absl::StrReplaceAll(absl::StrCat("1 2 3\n4 5 6\n", last, "\n"), {{" ", separator}}),
            format);
      };
      EXPECT_EQ(read("7 8 910 11 12").error(),
                "FILE:3: the row has 5 columns, but the first row has 3; is a line end missing?");
      // Labels may have any number of words.
      EXPECT_EQ(read("7 8 9 a tree").counts.points, 3u) << separator;
    }
    EXPECT_EQ(ReadText("1 2 3 4 5\n6 7 8\n9 1 2 3 4\n", format).counts.points, 3u);
  }
}

TEST(CsvFile, AFirstLineMayNameTheSeparator) {
  EXPECT_THAT(ReadText("sep=;\nx;y;z\n1;2;3\n", PointFormat::kCsv).xyz(), ElementsAre(1, 2, 3));
}

TEST(CsvFile, SupportsSemicolonsTabsAndQuotes) {
  EXPECT_THAT(ReadText("x;y;z\n1;2;3\n", PointFormat::kCsv).xyz(), ElementsAre(1, 2, 3));
  EXPECT_THAT(ReadText("1\t2\t3\n", PointFormat::kCsv).xyz(), ElementsAre(1, 2, 3));
  EXPECT_THAT(ReadText("name,x,y,z\n\"a,b\",1,2,3\n", PointFormat::kCsv).xyz(),
              ElementsAre(1, 2, 3));
}

TEST(CsvFile, ErrorsNameFileAndLine) {
  EXPECT_EQ(ReadText("x,y,z\n1,2,3\n1,abc,3\n", PointFormat::kCsv).error(),
            "FILE:3: \"abc\" is not a number");
  EXPECT_EQ(ReadText("1,2\n", PointFormat::kCsv).error(),
            "FILE:1: the row has 2 columns; z is column 3");
  EXPECT_EQ(ReadText("a,b,c\n1,2,3\n", PointFormat::kCsv).error(),
            "FILE:1: the header \"a,b,c\" has no column \"x\"; it must name x, y and z");
  EXPECT_EQ(ReadText("1,5;2,5;3,5\n", PointFormat::kCsv).error(),
            "FILE:1: \"1,5\" is not a number (use a point as the decimal mark)");
  EXPECT_EQ(ReadText("1,,3\n", PointFormat::kCsv).error(), "FILE:1: \"\" is not a number");
}

TEST(OffFile, ReadsTheVerticesItDeclares) {
  EXPECT_THAT(
      ReadText("OFF # head\n# note\n2 1 0\n\n1 2 3\n4 5 6\n3 0 1 1\n", PointFormat::kOff).xyz(),
      ElementsAre(1, 2, 3, 4, 5, 6));
  EXPECT_THAT(ReadText("OFF 1 0 0\n1 2 3\n", PointFormat::kOff).xyz(), ElementsAre(1, 2, 3));
  // Modeled on OFF/invalid.off of assimp-testmodels.
  EXPECT_THAT(ReadText("OFF\n1 4\n1 2 3\n", PointFormat::kOff).error(),
              HasSubstr("after 0 of 4 faces; is it complete?"));
  EXPECT_THAT(ReadText("STCNOFF\n1 0 0\n1 2 3 9 9 9 0 0 0 1 5 5\n", PointFormat::kOff).xyz(),
              ElementsAre(1, 2, 3));
}

TEST(OffFile, FacesWithoutVerticesAreAnError) {
  EXPECT_EQ(ReadText("OFF\n0 1 0\n3 0 1 2\n", PointFormat::kOff).error(),
            "FILE:2: the file declares 1 faces, but no vertex");
}

// If the vertex count is too small, the last vertices are parsed as faces.
TEST(OffFile, CountsThatContradictTheFileAreErrors) {
  const std::string rows = "0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 1 2\n3 0 1 3\n";
  const auto error = [&](const std::string& counts) {
    return ReadText("OFF\n" + counts + "\n" + rows, PointFormat::kOff).error();
  };
  EXPECT_EQ(error("4 2 0"), "");
  EXPECT_THAT(error("3 2 0"), HasSubstr("FILE:"));
  EXPECT_THAT(error("3 3 0"), HasSubstr("FILE:"));
  EXPECT_EQ(error("4 1 0"),
            "FILE:8: the file continues after 4 vertices and 1 face, the counts of its header");
  EXPECT_THAT(ReadText("OFF\n1 1 0\n1 2 3\n3 0 0 1\n", PointFormat::kOff).error(),
              HasSubstr("FILE:4: a face needs its number of corners"));
}

TEST(OffFile, CountsMayFollowTheKeywordDirectly) {
  EXPECT_THAT(ReadText("OFF1 0 0\n1 2 3\n", PointFormat::kOff).xyz(), ElementsAre(1, 2, 3));
  EXPECT_THAT(ReadText("COFF1 0 0\n1 2 3 9 9 9 9\n", PointFormat::kOff).xyz(),
              ElementsAre(1, 2, 3));
}

TEST(OffFile, RefusesUnknownContent) {
  EXPECT_THAT(ReadText("4OFF\n1 0 0\n1 2 3 4\n", PointFormat::kOff).error(),
              HasSubstr("FILE:1: \"4OFF\" is not OFF"));
  EXPECT_THAT(ReadText("OFF BINARY\n", PointFormat::kOff).error(), HasSubstr("convert it"));
  EXPECT_THAT(ReadText("OFF\n-1 0 0\n", PointFormat::kOff).error(), HasSubstr("FILE:2: \"-1\""));
}

constexpr char kAsciiPly[] =
    "ply\nformat ascii 1.0\ncomment made by hand\nobj_info none\n"
    "element extra 2\nproperty list uchar int items\nproperty float weight\n"
    "element vertex 2\nproperty uchar red\nproperty float z\nproperty list int float bag\n"
    "property double x\nproperty float y\n"
    "element face 1\nproperty list uchar int vertex_indices\nend_header\n";

TEST(PlyFile, AsciiKeepsThePrecisionOfTheText) {
  const PointsRead read = ReadText(
      std::string(kAsciiPly) + "2 8 9 0.5\n0 0.25\n255 3 2 7 7 1 2\n0 0.1 0 4 5\n3 0 1 1\n",
      PointFormat::kPly);
  EXPECT_TRUE(read.status.ok()) << read.status;
  // 0.1 in a float property, but as text: the nearest double is used.
  EXPECT_THAT(read.xyz(), ElementsAre(1, 2, 3, 4, 5, 0.1));
  EXPECT_FALSE(read.all_float());
}

TEST(PlyFile, NamesOfCoordinatesMayBeUpperCase) {
  const auto read = [](const std::string& properties) {
    return ReadText(
        "ply\nformat ascii 1.0\nelement vertex 1\n" + properties + "end_header\n1 2 3 4\n",
        PointFormat::kPly);
  };
  EXPECT_THAT(read("property int id\nproperty float X\nproperty float Y\nproperty float Z\n").xyz(),
              ElementsAre(2, 3, 4));
  EXPECT_THAT(
      read("property float X\nproperty float x\nproperty float y\nproperty float z\n").error(),
      HasSubstr("has a coordinate twice"));
}

TEST(PlyFile, AsciiErrorsNameFileAndLine) {
  EXPECT_EQ(ReadText(std::string(kAsciiPly) + "3 8 9\n", PointFormat::kPly).error(),
            "FILE: ends at byte 311 within the element extra, after 2 of 3 items of a list; is it "
            "complete?");
  EXPECT_THAT(ReadText(std::string(kAsciiPly) + "0 1\n0 1\n", PointFormat::kPly).error(),
              HasSubstr("within the element vertex"));
  EXPECT_EQ(ReadText("ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\n"
                     "end_header\n1 2\n",
                     PointFormat::kPly)
                .error(),
            "FILE:6: the element vertex needs the properties x, y and z");
  EXPECT_THAT(ReadText("ply\nformat binary_middle_endian 1.0\n", PointFormat::kPly).error(),
              HasSubstr("FILE:2: format \"binary_middle_endian\" is unknown"));
  EXPECT_THAT(ReadText("plx\n", PointFormat::kPly).error(), HasSubstr("FILE:1: a PLY file starts"));
}

// RealSense Viewer writes a vertex and its color on two lines; other writers use one.
TEST(PlyFile, AsciiValuesMayBeOnAnyLines) {
  const std::string head =
      "ply\r\nformat ascii 1.0\r\nelement vertex 2\r\nproperty float x\r\nproperty float y\r\n"
      "property float z\r\nproperty uchar red\r\nproperty uchar green\r\nelement face 1\r\n"
      "property list uchar int vertex_indices\r\nend_header\r\n";
  for (const char* body :
       {"1 2 3\r\n10 20\r\n4 5 6\r\n30 40\r\n3 0\r\n1 0\r\n", "1 2 3 10 20 4 5 6 30 40 3 0 1 0",
        "1\n2\n3\n10\n20\n4\n5\n6\n30\n40\n3\n0\n1\n0\n",
        "comment begin\n1 2 3 10 20\n\ncomment 9 9\n4 5 6 30 40\n3 0 1 0\ncomment end\n"}) {
    const PointsRead read = ReadText(head + body, PointFormat::kPly);
    EXPECT_TRUE(read.status.ok()) << read.status << "\n" << body;
    EXPECT_THAT(read.xyz(), ElementsAre(1, 2, 3, 4, 5, 6)) << body;
  }
}

// A surplus or missing value shifts all later ones: the points read are then wrong.
TEST(PlyFile, AsciiFilesThatContradictTheirHeaderAreErrors) {
  const auto error = [](const std::string& counts, const std::string& body) {
    return ReadText("ply\nformat ascii 1.0\n" + counts +
                        "property float x\nproperty float y\nproperty float z\nend_header\n" + body,
                    PointFormat::kPly)
        .error();
  };
  EXPECT_THAT(error("element vertex 2\n", "1 2 3 255\n4 5 6 255\n"),
              HasSubstr("FILE:9: \"6\" is beyond the last value that the header declares"));
  EXPECT_THAT(error("element vertex 2\n", "1 2\n4 5 6\n"),
              HasSubstr("within the element vertex; is it complete?"));
  EXPECT_THAT(error("element vertex 1\n", "1 2 3\n4 5 6\n"), HasSubstr("FILE:9: \"4\" is beyond"));
  EXPECT_THAT(error("element vertex 1\n", "1 2 x\n"), HasSubstr("FILE:8: \"x\" is not a number"));
  EXPECT_THAT(error("element vertex 0\nproperty float x\nproperty float y\nproperty float z\n"
                    "element face 1\n",
                    "1 2 3\n"),
              HasSubstr("declares 1 elements \"face\", but no vertex"));
  EXPECT_THAT(error("element vertex 1\nproperty float x\nelement vertex 1\n", "1 1 2 3\n"),
              HasSubstr("declares the element vertex twice"));
  EXPECT_EQ(error("element vertex 0\n", ""), "FILE: contains no points");
  EXPECT_EQ(error("format binary_little_endian 1.0\nelement vertex 1\n", "1 2 3\n"),
            "FILE:3: the header has the line \"format\" twice");
}

TEST(PlyFile, FilesTruncatedWithinTheirFacesAreErrors) {
  const std::string head =
      std::string(kAsciiPly) + "2 8 9 0.5\n0 0.25\n255 3 2 7 7 1 2\n0 0.1 0 4 5\n";
  EXPECT_THAT(ReadText(head, PointFormat::kPly).error(), HasSubstr("within the element face"));
  EXPECT_THAT(ReadText(head + "3 0 1", PointFormat::kPly).error(),
              HasSubstr("within the element face, after 2 of 3 items of a list"));
}

constexpr char kPcdHead[] =
    "# .PCD v0.7\nVERSION 0.7\nFIELDS rgb x y z normal\nSIZE 4 4 8 4 4\nTYPE U F F I F\n"
    "COUNT 1 1 1 1 3\nWIDTH 2\nHEIGHT 1\nVIEWPOINT 5 5 5 1 0 0 0\n";

TEST(PcdFile, AsciiFindsFieldsByName) {
  const PointsRead read =
      ReadText(std::string(kPcdHead) + "POINTS 2\nDATA ascii\n0 0.1 2 3 0 0 1\n0 4 5 6 0 0 1\n",
               PointFormat::kPcd);
  EXPECT_TRUE(read.status.ok()) << read.status;
  EXPECT_THAT(read.xyz(), ElementsAre(0.1, 2, 3, 4, 5, 6));
}

TEST(PcdFile, NamesOfFieldsMayBeUpperCase) {
  const auto read = [](const std::string& fields) {
    return ReadText(
        "FIELDS " + fields + "\nSIZE 4 4 4 4\nTYPE F F F F\nPOINTS 1\nDATA ascii\n" + "1 2 3 4\n",
        PointFormat::kPcd);
  };
  EXPECT_THAT(read("I X Y Z").xyz(), ElementsAre(2, 3, 4));
  EXPECT_THAT(read("x X y z").error(), HasSubstr("must occur once"));
}

TEST(PcdFile, AsciiErrorsNameFileAndLine) {
  EXPECT_EQ(
      ReadText(std::string(kPcdHead) + "POINTS 2\nDATA ascii\n0 1 2\n", PointFormat::kPcd).error(),
      "FILE:12: the line has 3 of 7 values");
  EXPECT_THAT(
      ReadText(std::string(kPcdHead) + "DATA ascii\n0 1 2 3 0 0 0\n", PointFormat::kPcd).error(),
      HasSubstr("after 1 of 2 points"));
  EXPECT_EQ(ReadText(std::string(kPcdHead) + "POINTS 1\nWIDTH 1\nDATA ascii\n0 1 2 3 0 0 0 8\n",
                     PointFormat::kPcd)
                .error(),
            "FILE:13: \"8\" is one value too many; FIELDS and COUNT declare 7 per point");
  EXPECT_EQ(
      ReadText("FIELDS x y\nSIZE 4 4\nTYPE F F\nPOINTS 1\nDATA ascii\n1 2\n", PointFormat::kPcd)
          .error(),
      "FILE:5: FIELDS must name x, y and z");
  // The second line would exchange the coordinates.
  EXPECT_EQ(
      ReadText("FIELDS x y z\nCOLUMNS z y x\nPOINTS 1\nDATA ascii\n1 2 3\n", PointFormat::kPcd)
          .error(),
      "FILE:2: the header has \"COLUMNS\" twice");
}

TEST(Formats, AreRecognizedByExtensionInAnyCase) {
  EXPECT_EQ(*PointFormatOfPath("/a.b/C.OBJ"), PointFormat::kObj);
  EXPECT_EQ(*PointFormatOfPath("x.glb"), PointFormat::kGltf);
  EXPECT_THAT(std::string(PointFormatOfPath("/a.obj/file").status().message()),
              HasSubstr("/a.obj/file: unknown file extension; convert or rename the file; "
                        "supported are obj, off, "));
  EXPECT_FALSE(PointFormatOfPath("x.docx").ok());
}

TEST(Formats, CompressedAndUtf16FilesAreRefusedAsSuch) {
  for (const std::string& name : PointFormatNames()) {
    const PointFormat format = *PointFormatFromName(name);
    EXPECT_EQ(ReadText("\x1F\x8B\x08 123456", format).error(),
              "FILE is compressed (gzip); decompress it first")
        << name;
    EXPECT_THAT(ReadText("PK\x03\x04 123456", format).error(), HasSubstr("(zip)")) << name;
    EXPECT_THAT(ReadText(std::string("\xFF\xFEs\0o\0", 6), format).error(),
                HasSubstr("is UTF-16 text"))
        << name;
    if (!IsMeshFormat(format)) continue;
    const TempFile file("a." + name, "\x1F\x8B\x08 123456");
    EXPECT_THAT(std::string(ReadMesh(file.path()).status().message()), HasSubstr("(gzip)")) << name;
  }
}

// Formerly, only formats with a header refused such files.
TEST(Formats, FilesWithoutAPointAreErrors) {
  const std::pair<PointFormat, std::string> files[] = {
      {PointFormat::kXyz, ""},
      {PointFormat::kXyz, "# x y z\n\n0\n"},
      {PointFormat::kCsv, ""},
      {PointFormat::kCsv, "x,y,z\n"},
      {PointFormat::kOff, "OFF\n0 0 0\n"},
      {PointFormat::kPcd, "FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nPOINTS 0\nDATA ascii\n"}};
  for (const auto& [format, text] : files) {
    EXPECT_EQ(ReadText(text, format).error(), "FILE: contains no points") << text;
    ReadOptions options;
    options.allow_empty = true;
    const PointsRead read = ReadText(text, format, options);
    EXPECT_TRUE(read.status.ok()) << read.status;
    EXPECT_THAT(read.blocks, IsEmpty());
  }
}

TEST(Formats, ExponentsOfFortranAreRead) {
  const std::string row = "1.5D+03 -.5d-1 2.D0";
  const std::string ply =
      "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\n"
      "property float z\nend_header\n";
  const std::string pcd = "FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nPOINTS 1\nDATA ascii\n";
  const std::pair<PointFormat, std::string> files[] = {{PointFormat::kXyz, row},
                                                       {PointFormat::kXyz, "1.5D+03, -.5d-1, 2.D0"},
                                                       {PointFormat::kCsv, "x y z\n" + row},
                                                       {PointFormat::kCsv, "1.5D+03,-.5d-1,2.D0"},
                                                       {PointFormat::kObj, "v " + row},
                                                       {PointFormat::kOff, "OFF 1 0 0\n" + row},
                                                       {PointFormat::kPly, ply + row},
                                                       {PointFormat::kPcd, pcd + row}};
  for (const auto& [format, text] : files) {
    EXPECT_THAT(ReadText(text, format).xyz(), ElementsAre(1500, -0.05, 2)) << text;
    ReadOptions options;
    options.scale.fill(*LengthScale::FromText("0.001"));
    EXPECT_THAT(ReadText(text, format, options).xyz(), ElementsAre(1.5, -5e-5, 0.002)) << text;
  }
  for (const char* text : {"D5 0 0", "1D 0 0", "1D2D3 0 0", "1DE2 0 0"}) {
    EXPECT_THAT(ReadText(text, PointFormat::kXyz).error(), HasSubstr("is not a number")) << text;
  }
  EXPECT_THAT(ReadText("1D999 0 0", PointFormat::kXyz).error(), HasSubstr("the largest double"));
  const TempFile mesh("a.obj", "v " + row + "\n");
  EXPECT_THAT(ReadMesh(mesh.path())->vertices[0], ElementsAre(1500, -0.05, 2));
}

}  // namespace text_formats_test
}  // namespace hulld
