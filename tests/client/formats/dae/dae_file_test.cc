// Meshes of COLLADA files: numbers, accessors, primitives, units, and damage.
#include <absl/strings/str_cat.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cctype>
#include <cmath>
#include <tuple>

#include "tests/client/formats/dae/dae_text.h"

namespace hulld {
namespace dae_file_test {

using testing::AllOf;
using testing::ElementsAre;
using testing::ElementsAreArray;
using testing::HasSubstr;

constexpr std::string_view kNumbers = "0 0 0 200 0 0 0 0 50";

std::string Error(const std::string& text) { return ReadDaeText(text).error(); }

TEST(DaeFile, CoordinatesAreTheNearestDoubles) {
  const PointsRead read = ReadDaeText(
      DaeText(kNumbers, "0.1 -1e308 5e-324\n\t9007199254740993 +1e-400 -0 .3 4. 16777217"));
  ASSERT_TRUE(read.status.ok()) << read.status;
  EXPECT_THAT(read.xyz(),
              ElementsAre(0.1, -1e308, 0x1p-1074, 9007199254740992.0, 0, 0, 0.3, 4, 16777217));
  EXPECT_TRUE(std::signbit(read.xyz()[5]));
}

TEST(DaeFile, IsConvertedToMetersWithUnchangedAxes) {
  for (const char* axis : {"X_UP", "Y_UP", "Z_UP"}) {
    const std::string text = DaeReplaced(kPlate, "Z_UP", axis);
    EXPECT_THAT(ReadDaeText(text).xyz(), ElementsAre(0, 0, 0, 2, 0, 0, 0, 0, 0.5));
    const auto parts = DaeParts(text);
    ASSERT_EQ(parts.size(), 1u);
    EXPECT_EQ(parts[0].name, "plate");
    EXPECT_THAT(parts[0].mesh.triangles, ElementsAre(ElementsAre(0, 1, 2)));
    EXPECT_THAT(parts[0].mesh.vertices,
                ElementsAre(ElementsAre(0, 0, 0), ElementsAre(2, 0, 0), ElementsAre(0, 0, 0.5)));
  }
}

// 3 inches are the double nearest to 0.0762, not 3 times a rounded factor; 0.1 inches are the
// double nearest to 0.00254, although no double is exactly 0.1.
TEST(DaeFile, UnitsAreRoundedOnce) {
  const std::string moved =
      DaeText("<instance_geometry", "<translate>1 0 0</translate><instance_geometry");
  for (const auto& [unit, length, tenth] :
       {std::tuple("0.0254", 0.0762, 0.00254), std::tuple("0.3048", 0.9144, 0.03048),
        std::tuple("0.001", 0.003, 0.0001), std::tuple(" 1e-6 ", 3e-6, 1e-7)}) {
    const auto with = [&](const std::string& text, const char* numbers) {
      return DaeReplaced(DaeReplaced(text, "meter=\"1\"", absl::StrCat("meter=\"", unit, "\"")),
                         kNumbers, numbers);
    };
    const std::string plain = with(DaeText(), "3 0.1 0 1 2 3 4 5 6");
    EXPECT_THAT(ReadDaeText(plain).xyz()[0], length) << unit;
    EXPECT_THAT(ReadDaeText(plain).xyz()[1], tenth) << unit;
    EXPECT_THAT(DaeParts(plain).at(0).mesh.vertices[0], ElementsAre(length, tenth, 0)) << unit;
    const std::string shifted = with(moved, "2 0 0 1 2 3 4 5 6");
    EXPECT_THAT(ReadDaeText(shifted).xyz()[0], length) << unit;
    EXPECT_THAT(DaeParts(shifted).at(0).mesh.vertices[0], ElementsAre(length, 0, 0)) << unit;
  }
}

// The factors of unit and scale are multiplied before anything is rounded.
TEST(DaeFile, UnitAndScaleAreRoundedTogether) {
  ReadOptions options;
  options.scale[0] = *LengthScale::FromText("0.3");
  options.scale[1] = *LengthScale::FromText("-3");
  const std::string text = DaeReplaced(kPlate, kNumbers, "0.7 0.7 0 1 2 3 4 5 6");
  EXPECT_THAT(ReadDaeText(text, options).xyz(),
              ElementsAreArray({0.0021, -0.021, 0.0, 0.003, -0.06, 0.03, 0.012, -0.15, 0.06}));
  options.scale[0] = *LengthScale::FromText("1e-308");
  EXPECT_THAT(
      ReadDaeText(DaeReplaced(kPlate, "0.01", "1e-300"), options).error(),
      HasSubstr(
          "FILE:2: <COLLADA> has a unit that overflows a double when multiplied by the scale"));
}

TEST(DaeFile, UnitsMustBeLengths) {
  for (const char* unit : {"0", "-1", "inf", "nan"}) {
    EXPECT_THAT(Error(DaeReplaced(kPlate, "0.01", unit)),
                HasSubstr("FILE:3: <unit> is not a finite length above 0"))
        << unit;
  }
  // As FBX's exporter of 2008 wrote it in some countries.
  EXPECT_EQ(Error(DaeReplaced(kPlate, "0.01", "0,010000")),
            "FILE:3: \"0,010000\" is not a number (use a point as the decimal mark)");
  EXPECT_THAT(ReadDaeText(DaeText(" meter=\"1\"", "")).xyz()[3], 200);
  EXPECT_THAT(ReadDaeText(DaeText("<unit name=\"centimeter\" meter=\"1\"/>", "")).xyz()[3], 200);
  EXPECT_THAT(Error(DaeText("<mesh>", "<asset><unit meter=\"0.1\"/></asset><mesh>")),
              HasSubstr("FILE:4: <unit> differs from the unit of the file"));
  EXPECT_EQ(Error(DaeText("<mesh>", "<asset><unit meter=\"1.0\"/></asset><mesh>")), "");
}

TEST(DaeFile, AccessorsHaveOffsetsStridesAndParameters) {
  const auto read = [](const char* numbers, const char* accessor, const char* params) {
    std::string text = DaeText("count=\"9\"", "");
    text = DaeReplaced(text, kNumbers, numbers);
    text = DaeReplaced(text, "count=\"3\" stride=\"3\"", accessor);
    text = DaeReplaced(
        text,
        R"(<param name="X" type="float"/><param name="Y" type="float"/><param name="Z" type="float"/>)",
        params);
    text = DaeReplaced(text, "0 1 2", "0 1 1");
    return ReadDaeText(text);
  };
  EXPECT_THAT(read("9 1 2 3 9 4 5 6", "count='2' offset='1' stride='4'", "").xyz(),
              ElementsAre(1, 2, 3, 4, 5, 6));
  EXPECT_THAT(read("3 9 2 1 6 9 5 4", "count='2' stride='4'",
                   "<param name='Z'/><param/><param name='Y'/><param name='X'/>")
                  .xyz(),
              ElementsAre(1, 2, 3, 4, 5, 6));
  EXPECT_THAT(read("1 2 3 4 5 6", "count='2' stride='3'", "<param/><param/><param/>").xyz(),
              ElementsAre(1, 2, 3, 4, 5, 6));
  EXPECT_THAT(read("1 2 3 4 5 6", "count='2' stride='3'",
                   "<param name='X'/><param name='Y'/><param name='W'/>")
                  .error(),
              HasSubstr("FILE:6: <accessor> lacks some of the parameters X, Y, and Z"));
  EXPECT_THAT(read("1 2 3 4 5 6", "count='2'", "").error(),
              HasSubstr("FILE:6: <accessor> has stride 1, too small for x, y, and z"));
  EXPECT_THAT(read("1 2 3 4 5 6", "count='2' stride='0'", "").error(),
              HasSubstr("too small for x, y, and z"));
  for (const char* accessor : {"count='3' stride='3'", "count='2' offset='1' stride='3'",
                               "count='2' stride='4'", "count='4294967295' stride='4294967295'"}) {
    EXPECT_THAT(read("1 2 3 4 5 6", accessor, "").error(),
                HasSubstr("FILE:6: <accessor> needs more than the 6 numbers of its array"))
        << accessor;
  }
  EXPECT_THAT(read("1 2 3 4 5 6", "count='2' stride='-3'", "").error(),
              HasSubstr("FILE:6: <accessor> has stride=\"-3\", not a whole number below 2^32"));
}

TEST(DaeFile, IntegersAndSplitTextsAreRead) {
  std::string text = DaeText("<float_array", "<int_array");
  text = DaeReplaced(text, "float_array", "int_array");
  EXPECT_EQ(ReadDaeText(text).xyz()[3], 200);
  text = DaeText(kNumbers, "0 0 0<!-- 7 --> 200 0<![CDATA[ 0 0 ]]>&#48; 50");
  EXPECT_THAT(ReadDaeText(text).xyz(), ElementsAre(0, 0, 0, 200, 0, 0, 0, 0, 50));
}

// The plate with four vertices and these primitives.
std::string WithPrimitives(const std::string& primitives) {
  std::string text = DaeText("count=\"9\"", "count=\"15\"");
  text = DaeReplaced(text, kNumbers, "0 0 0 1 0 0 1 1 0 0 1 0 0 0 9");
  text = DaeReplaced(text, "count=\"3\"", "count=\"5\"");
  const size_t from = text.find("<triangles");
  const size_t to = text.find("</mesh>");
  return text.replace(from, to - from, primitives + "\n");
}

constexpr char kVertex[] = "<input semantic='VERTEX' source='#corners' offset='0'/>";

std::vector<std::array<uint32_t, 3>> Triangles(const std::string& primitives) {
  const auto parts = DaeParts(WithPrimitives(primitives));
  return parts.empty() ? std::vector<std::array<uint32_t, 3>>() : parts[0].mesh.triangles;
}

TEST(DaeFile, EachPrimitiveHasItsTriangles) {
  const std::string in = kVertex;
  EXPECT_THAT(Triangles("<triangles count='2'>" + in + "<p>0 1 2 0 2 3</p></triangles>"),
              ElementsAre(ElementsAre(0, 1, 2), ElementsAre(0, 2, 3)));
  EXPECT_THAT(Triangles("<polylist count='2'>" + in +
                        "<vcount>4 3</vcount><p>0 1 2 3 4 1 2</p></polylist>"),
              ElementsAre(ElementsAre(0, 1, 2), ElementsAre(0, 2, 3), ElementsAre(4, 1, 2)));
  EXPECT_THAT(Triangles("<polygons count='2'>" + in + "<p>0 1 2 3</p><p>4 1 2</p></polygons>"),
              ElementsAre(ElementsAre(0, 1, 2), ElementsAre(0, 2, 3), ElementsAre(4, 1, 2)));
  EXPECT_THAT(
      Triangles("<polygons count='1'>" + in + "<ph><p>0 1 2 3</p><h>3 2 1</h></ph></polygons>"),
      ElementsAre(ElementsAre(0, 1, 2), ElementsAre(0, 2, 3), ElementsAre(3, 2, 1)));
  EXPECT_THAT(Triangles("<tristrips count='2'>" + in + "<p>0 1 2 3</p><p>4 3 2</p></tristrips>"),
              ElementsAre(ElementsAre(0, 1, 2), ElementsAre(2, 1, 3), ElementsAre(4, 3, 2)));
  EXPECT_THAT(Triangles("<trifans count='1'>" + in + "<p>0 1 2 3</p></trifans>"),
              ElementsAre(ElementsAre(0, 1, 2), ElementsAre(0, 2, 3)));
  // Other indices of a corner are skipped.
  EXPECT_THAT(Triangles("<triangles count='1'><input semantic='NORMAL' source='#n' offset='0'/>"
                        "<input semantic='VERTEX' source='#corners' offset='1'/>"
                        "<input semantic='TEXCOORD' source='#t' offset='2'/>"
                        "<p>9 0 9 9 1 9 9 2 9</p></triangles>"),
              ElementsAre(ElementsAre(0, 1, 2)));
}

TEST(DaeFile, UnusedVerticesAreIncluded) {
  const std::string in = kVertex;
  for (const std::string& primitives :
       {std::string(), "<lines count='2'>" + in + "<p>0 1 1 2</p></lines>",
        "<linestrips count='1'>" + in + "<p>0 1 2</p></linestrips>",
        "<triangles count='0'>" + in + "</triangles>", std::string("<extra>&lt;</extra>")}) {
    EXPECT_THAT(ReadDaeText(WithPrimitives(primitives)).xyz(),
                ElementsAre(0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0, 0, 0, 9))
        << primitives;
    const TempFile file("a.dae", WithPrimitives(primitives));
    const auto mesh = ReadMesh(file.path());
    ASSERT_TRUE(mesh.ok()) << mesh.status();
    EXPECT_TRUE(mesh->triangles.empty());
  }
}

TEST(DaeFile, PrimitivesThatLackOrExceedVerticesAreRefused) {
  const std::string in = kVertex;
  const auto error = [](const std::string& primitives) {
    return Error(WithPrimitives(primitives));
  };
  EXPECT_EQ(error("<triangles count='1'>" + in + "\n<p>0 1\n5</p></triangles>"),
            "FILE:12: \"5\" is not the index of a vertex; the mesh has 5 vertices, counted from 0");
  EXPECT_THAT(error("<lines count='1'>" + in + "<p>0 -1</p></lines>"),
              HasSubstr("FILE:10: \"-1\" is not the index of a vertex"));
  EXPECT_EQ(error("<triangles count='2'>" + in + "<p>0 1 2</p></triangles>"),
            "FILE:10: <triangles> declares 2, but has 1; is the file complete?");
  EXPECT_THAT(error("<triangles count='1'>" + in + "</triangles>"), HasSubstr("but has 0"));
  EXPECT_THAT(error("<tristrips count='1'>" + in + "<p>0 1 2</p><p>0 1 2</p></tristrips>"),
              HasSubstr("<tristrips> declares 1, but has 2"));
  EXPECT_EQ(error("<triangles>" + in + "<p>0 1 2 3</p></triangles>"),
            "FILE:10: <triangles> has 4 corners, not a multiple of 3");
  EXPECT_EQ(error("<lines>" + in + "<p>0 1 2</p></lines>"),
            "FILE:10: <lines> has 3 corners, not a multiple of 2");
  EXPECT_EQ(
      error("<triangles>" + in + "<input semantic='NORMAL' offset='1'/><p>0 1 2</p></triangles>"),
      "FILE:10: <p> has 3 indices, not a multiple of 2");
  EXPECT_EQ(error("<polylist>" + in + "<vcount>4</vcount><p>0 1 2</p></polylist>"),
            "FILE:10: \"4\" is not a number of corners; <p> has 3 more");
  EXPECT_EQ(error("<polylist>" + in + "<vcount>3</vcount><p>0 1 2 3</p></polylist>"),
            "FILE:10: <polylist> has 4 corners in <p>, but 3 in <vcount>");
  EXPECT_THAT(error("<polylist>" + in + "<p>0 1 2</p></polylist>"), HasSubstr("but 0 in <vcount>"));
  EXPECT_EQ(error("<triangles><p>0 1 2</p></triangles>"),
            "FILE:10: <triangles> has no input VERTEX from the <vertices> of the mesh");
  EXPECT_THAT(error("<polygons><input semantic='VERTEX' source='#at'/><p>0 1</p></polygons>"),
              HasSubstr("has no input VERTEX"));
}

TEST(DaeFile, SourcesThatAreMissingOrDisagreeAreRefused) {
  EXPECT_EQ(Error(DaeText("count=\"9\"", "count=\"12\"")),
            "FILE:5: <float_array> declares 12, but has 9; is the file complete?");
  EXPECT_THAT(Error(DaeText("count=\"9\"", "count=\"8\"")), HasSubstr("declares 8, but has 9"));
  EXPECT_THAT(Error(DaeText("#at", "#elsewhere")),
              HasSubstr("FILE:9: <input> refers to no <source>"));
  EXPECT_THAT(Error(DaeText("#numbers", "#elsewhere")),
              HasSubstr("FILE:9: <input> refers to no <source>"));
  EXPECT_THAT(Error(DaeText("POSITION", "NORMAL")),
              HasSubstr("FILE:11: \"0\" is not the index of a vertex"));
  EXPECT_THAT(Error(DaeText("<vertices id=\"corners\"", "<vertices id=\"others\"")),
              HasSubstr("FILE:10: <triangles> has no input VERTEX"));
  EXPECT_EQ(Error(DaeText(kNumbers, "0 0 0 200 0 x 0 0 50")), "FILE:5: \"x\" is not a number");
  EXPECT_EQ(Error(DaeText(kNumbers, "0 0 0\n200\n0,5 0 0 0 50")),
            "FILE:7: \"0,5\" is not a number (use a point as the decimal mark)");
  EXPECT_THAT(Error(DaeText("0 50", "0 1e999")), HasSubstr("exceeds the largest double"));
}

TEST(DaeFile, NonFinitePointsAreErrorsOrSkipped) {
  for (const char* number : {"NaN", "INF", "-INF", "1.#QNAN"}) {
    for (const char* move : {"", "<translate>0 0 0</translate>", "<scale>2 1 1</scale>"}) {
      const std::string text =
          DaeReplaced(DaeText(kNumbers, absl::StrCat("0 0 0 1 ", number, " 0 0 0 1")),
                      "<instance_geometry", absl::StrCat(move, "<instance_geometry"));
      EXPECT_THAT(Error(text), AllOf(HasSubstr("FILE:4: vertex 1 of \"plate\": point 2 has"),
                                     HasSubstr("--skip-nonfinite")));
      ReadOptions options;
      options.skip_nonfinite = true;
      const PointsRead read = ReadDaeText(text, options);
      ASSERT_TRUE(read.status.ok()) << read.status;
      EXPECT_EQ(read.counts.points, 2u);
      EXPECT_EQ(read.counts.skipped, 1u);
      const TempFile file("a.dae", text);
      EXPECT_THAT(std::string(ReadMesh(file.path()).status().message()),
                  HasSubstr(":4: a vertex of \"plate\" is not finite"));
    }
  }
}

TEST(DaeFile, FilesWithoutMeshesHaveNoPoints) {
  for (const std::string& text :
       {DaeText("<instance_geometry url=\"#plate-mesh\"/>",
                "<node><translate>0 7 0</translate></node>"),
        std::string("<COLLADA/>"), DaeReplaced(DaeText(kNumbers, ""), "count=\"9\"", "count=\"0\""),
        DaeText(
            "<vertices id=\"corners\"><input semantic=\"POSITION\" source=\"#at\"/></vertices>\n"
            "<triangles count=\"1\"><input semantic=\"VERTEX\" source=\"#corners\" offset=\"0\"/>\n"
            "<p>0 1 2</p></triangles>",
            "")}) {
    EXPECT_FALSE(ReadDaeText(text).status.ok()) << text;
    const TempFile file("a.dae", text);
    EXPECT_FALSE(ReadParts(file.path(), SplitBy::kName).ok());
  }
  EXPECT_EQ(Error("<COLLADA/>"), "FILE: the scene contains no vertex");
}

TEST(DaeFile, PrefixesMarksAndLineEndsDoNotMatter) {
  const std::string plain = DaeText();
  std::string prefixed;
  for (const char c : plain) {
    if (!prefixed.empty() && prefixed.back() == '<' && std::isalpha(c)) prefixed += "c:";
    if (prefixed.size() > 1 && prefixed.substr(prefixed.size() - 2) == "</") prefixed += "c:";
    prefixed += c == '\n' ? "\r\n" : std::string(1, c);
  }
  for (const std::string& text : {prefixed, "\xEF\xBB\xBF" + prefixed, plain + "\x1A"}) {
    EXPECT_EQ(ReadDaeText(text).xyz()[3], 200) << ReadDaeText(text).status << text;
  }
  EXPECT_THAT(Error(DaeReplaced(prefixed, "0 1 2", "0 1 7")), HasSubstr("FILE:11: \"7\""));
}

TEST(DaeFile, EntitiesAreNotExpanded) {
  const std::string head =
      "<!DOCTYPE COLLADA [<!ENTITY a '1 1 1'><!ENTITY b '&a;&a;&a;'>"
      "<!ENTITY f SYSTEM 'file:///etc/passwd'>]>\n<COLLADA ";
  EXPECT_EQ(Error(DaeText("<COLLADA ", head)), "");
  for (const char* entity : {"&b;", "&f;"}) {
    const std::string text = DaeReplaced(DaeText("<COLLADA ", head), "0 0 50", entity);
    EXPECT_EQ(Error(text), absl::StrCat("FILE:6: \"", entity, "\" is not a number"));
  }
}

TEST(DaeFile, FilesThatAreNotColladaAreRefused) {
  EXPECT_THAT(Error(""), HasSubstr("FILE:1: not well-formed XML"));
  EXPECT_THAT(Error("hello"), HasSubstr("FILE:1: not well-formed XML"));
  EXPECT_THAT(Error("\n<robot/>"),
              HasSubstr("FILE:2: <robot> is the outermost element, not <COLLADA>"));
  EXPECT_THAT(Error(DaeText("</triangles>", "")), HasSubstr("not well-formed XML"));
  EXPECT_THAT(Error(DaeText(kNumbers, std::string("0 0 0\n\0 0", 9))),
              HasSubstr("FILE:6: a NUL byte"));
}

TEST(DaeFile, EveryPrefixIsRefused) {
  const std::string whole = DaeText();
  for (size_t size = 0; size <= whole.rfind('>'); ++size) {
    EXPECT_THAT(Error(whole.substr(0, size)), HasSubstr("is it complete?")) << size;
  }
}

}  // namespace dae_file_test
}  // namespace hulld
