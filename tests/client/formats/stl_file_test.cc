#include <absl/strings/str_cat.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstring>
#include <limits>

#include "client/formats/mesh_file.h"
#include "tests/client/formats/point_reading.h"

namespace hulld {
namespace stl_file_test {

using testing::ElementsAre;
using testing::HasSubstr;

std::string Facet(const std::string& normal = "normal 0 0 1") {
  return "facet " + normal +
         "\nouter loop\nvertex 0.1 2 3\nvertex 4 5e0 6\nvertex 7 8 -9\n"
         "endloop\nendfacet\n";
}

void ExpectFacets(const std::string& text, int facets) {
  const PointsRead read = ReadText(text, PointFormat::kStl);
  ASSERT_TRUE(read.status.ok()) << read.status << "\n" << text;
  std::vector<double> expected;
  for (int i = 0; i < facets; ++i) {
    expected.insert(expected.end(), {0.1, 2, 3, 4, 5, 6, 7, 8, -9});
  }
  EXPECT_EQ(read.xyz(), expected) << text;
}

std::string Error(const std::string& text) { return ReadText(text, PointFormat::kStl).error(); }

std::string Replaced(std::string text, const std::string& from, const std::string& to) {
  for (size_t at = 0; (at = text.find(from, at)) != std::string::npos; at += to.size()) {
    text.replace(at, from.size(), to);
  }
  return text;
}

std::string Upper(std::string text) {
  for (char& c : text) c = static_cast<char>(std::toupper(c));
  return text;
}

TEST(StlText, ErrorsCountFacets) {
  EXPECT_THAT(Error("solid a\n" + Facet()), HasSubstr("ends after 1 facet, before endsolid"));
  EXPECT_THAT(Error("solid a\n" + Facet() + Facet()), HasSubstr("ends after 2 facets, before"));
  EXPECT_EQ(Error(""), "FILE: not an STL file: it is empty");
}

TEST(StlText, LetterCaseNamesAndWhiteSpaceDoNotMatter) {
  for (const char* name : {"", " s", " two words", " facet", " \xc3\xa4"}) {
    const std::string solid = std::string("solid") + name + "\n";
    const std::string text = absl::StrCat(solid, Facet(), Facet(), "end", solid);
    ExpectFacets(text, 2);
    ExpectFacets(Upper(text), 2);
    ExpectFacets(solid + Upper(Facet()) + "endsolid", 1);
    ExpectFacets(Replaced(text, "\n", "\r\n"), 2);
    ExpectFacets(Replaced(text, "\n", "\r"), 2);
    ExpectFacets(Replaced(text, "\n", "\n\t\t  "), 2);
  }
  ExpectFacets("\xEF\xBB\xBFsolid\n" + Facet() + "endsolid\n", 1);
  ExpectFacets("\n solid a\n" + Replaced(Facet(), "\n", " ") + " endsolid\n", 1);
}

TEST(StlText, NormalsAreNotRead) {
  for (const char* normal : {"", "normal", "normal nan nan nan", "normal -nan(ind) 0 1.#QNAN",
                             "normal 1e999 -inf x", "\nnormal\n0 0 1"}) {
    ExpectFacets("solid\n" + Facet(normal) + "endsolid\n", 1);
  }
}

TEST(StlText, ReadsSeveralSolids) {
  ExpectFacets(
      "solid a\n" + Facet() + "endsolid a\nsolid b\nendsolid b\n\nsolid\n" + Facet() + "endsolid\n",
      2);
}

// Twelve corners of a tetrahedron, cut at each line.
TEST(StlText, FilesTruncatedAnywhereAreRefusedWithLineAndCount) {
  const std::string whole = "solid t\n" + Facet() + Facet() + Facet() + Facet() + "endsolid t\n";
  int refused = 0;
  for (size_t end = 1; (end = whole.find('\n', end)) + 1 < whole.size(); ++end) {
    const std::string error = Error(whole.substr(0, end + 1));
    EXPECT_THAT(error, testing::MatchesRegex("FILE:[0-9]+: the file ends after [0-4] facets?, "
                                             "before .*; is it complete\\?"));
    ++refused;
  }
  EXPECT_EQ(refused, 29);
  EXPECT_EQ(Error("solid t\n" + Facet() + Facet() + Facet()),
            "FILE:22: the file ends after 3 facets, before endsolid; is it complete?");
}

TEST(StlText, OtherFilesAreRefusedWithLineAndCount) {
  EXPECT_EQ(Error("solid\nendsolid\n"), "FILE:2: the file contains no facet");
  EXPECT_EQ(Error("solid\n" + Facet() + "vertex 0 0 0\n"),
            "FILE:9: \"vertex\" after 1 facet where \"facet\" is expected");
  EXPECT_EQ(Error("solid\nfacet\nouter loop\nvertex 0 0 0\nendloop\n"),
            "FILE:5: \"endloop\" after 0 facets where \"vertex\" is expected");
  EXPECT_EQ(Error("solid\n" + Replaced(Facet(), "0.1", "o.1")), "FILE:4: \"o.1\" is not a number");
  EXPECT_THAT(Error("solid\n" + Replaced(Facet(), "0.1", "nan") + "endsolid"),
              HasSubstr("FILE:4: point 1 has x = NaN"));
  EXPECT_THAT(Error(Facet()), HasSubstr("not an STL file: it starts with \"facet\""));
  EXPECT_THAT(Error("solid\n" + Facet() + "endsolid\nx"), HasSubstr("\"solid\" is expected"));
}

// Also in the first KiB, where control characters are a sign of a binary file.
TEST(TextStl, DamagedTextIsNotTakenForBinary) {
  const std::string whole = "solid\n" + Facet() + "endsolid\n";
  EXPECT_EQ(Error(whole + "\x1A"), "");
  EXPECT_THAT(Error(Replaced(whole, "endloop", std::string("\0ndloop", 7))),
              HasSubstr("FILE:7: the line contains the byte 0 (NUL)"));
}

std::string Binary(uint32_t count, uint32_t triangles, const std::string& header = "") {
  std::string bytes = header + std::string(80 - header.size(), ' ');
  bytes.append(reinterpret_cast<const char*>(&count), 4);
  const float numbers[12] = {NAN, 0, 1, 0.1f, 2, 3, 4, 5, 6, 7, 8, -9};
  for (uint32_t i = 0; i < triangles; ++i) {
    bytes.append(reinterpret_cast<const char*>(numbers), sizeof(numbers)).append("ab");
  }
  return bytes;
}

TEST(BinaryStl, HeaderMayStartWithSolid) {
  for (const char* header : {"", "solid", "solid made by a CAD program", "SOLID x\nfacet",
                             "solid x\nfacet normal 0 0 1"}) {
    for (const char* trailing : {"", "x", "trailing bytes that are no triangle"}) {
      const PointsRead read = ReadText(Binary(2, 2, header) + trailing, PointFormat::kStl);
      ASSERT_TRUE(read.status.ok()) << read.status;
      EXPECT_TRUE(read.all_float());
      EXPECT_THAT(read.xyz(),
                  ElementsAre(0.1f, 2, 3, 4, 5, 6, 7, 8, -9, 0.1f, 2, 3, 4, 5, 6, 7, 8, -9));
    }
  }
}

TEST(BinaryStl, FewerOrMoreTrianglesThanDeclaredAreRefused) {
  for (const char* header : {"", "solid"}) {
    const std::string whole = Binary(3, 3, header);
    for (size_t size = 84; size < whole.size(); ++size) {
      EXPECT_THAT(Error(whole.substr(0, size)), HasSubstr(" of 3 triangles; is it complete?"));
    }
    EXPECT_THAT(Error(whole.substr(0, 83) + std::string(1, '\0')), HasSubstr("after 0 of 3"));
    EXPECT_THAT(Error(Binary(2, 3, header)),
                HasSubstr("byte 184: the header declares 2 triangles and 50 bytes follow them"));
    EXPECT_THAT(Error(Binary(0, 0, header)), HasSubstr("byte 84: the file contains no triangle"));
    EXPECT_THAT(Error(Binary(0, 1, header) + "x"), HasSubstr("declares 0 triangles and 51 bytes"));
    EXPECT_THAT(Error(Binary(4294967295u, 1, header)), HasSubstr("after 1 of 4294967295"));
  }
  EXPECT_THAT(Error(Binary(3, 2, "solid with a facet normal")), HasSubstr("after 2 of 3"));
}

TEST(BinaryStl, MeshHasTheSameCornersAsThePoints) {
  const TempFile file("a.stl", Binary(2, 2, "solid"));
  const auto mesh = ReadMesh(file.path());
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  EXPECT_EQ(mesh->vertices.size(), 6u);
  EXPECT_THAT(mesh->triangles, ElementsAre(ElementsAre(0, 1, 2), ElementsAre(3, 4, 5)));
}

}  // namespace stl_file_test
}  // namespace hulld
