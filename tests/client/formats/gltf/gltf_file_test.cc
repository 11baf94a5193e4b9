#include <absl/strings/escaping.h>
#include <absl/strings/str_cat.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "client/formats/mesh_file.h"
#include "tests/client/formats/point_reading.h"

namespace hulld {
namespace gltf_file_test {

using testing::ElementsAre;
using testing::HasSubstr;

template <typename Scalar>
std::string Bytes(const std::vector<Scalar>& values) {
  return std::string(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(Scalar));
}

std::string Replaced(std::string text, const std::string& from, const std::string& to) {
  const size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return at == std::string::npos ? text : text.replace(at, from.size(), to);
}

std::string DataUri(const std::string& bytes) {
  return absl::StrCat("data:application/octet-stream;base64,", absl::Base64Escape(bytes));
}

// A mesh of the positions, shown by one node with `node` in it.
std::string Gltf(const std::string& bytes, const std::string& accessor,
                 const std::string& node = "", const std::string& root = "",
                 const std::string& stride = "") {
  return absl::StrCat(R"({"asset":{"version":"2.0"},)", root,
                      R"("scene":0,"scenes":[{"nodes":[0]}],)", R"("nodes":[{"mesh":0)", node,
                      R"(}],"meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],)",
                      R"("buffers":[{"byteLength":)", bytes.size(), R"(,"uri":")", DataUri(bytes),
                      R"("}],"bufferViews":[{"buffer":0,"byteLength":)", bytes.size(), stride,
                      R"(}],"accessors":[{"bufferView":0,"type":"VEC3",)", accessor, "}]}");
}

constexpr char kQuantization[] = R"("extensionsRequired":["KHR_mesh_quantization"],)";
const std::vector<float> kTriangle = {0.1f, 0, 0, 1, 0, 0, 0, 2, 0};
constexpr char kFloats[] = R"("componentType":5126,"count":3)";

std::string Error(const std::string& text) { return ReadText(text, PointFormat::kGltf).error(); }

// As gltfpack writes it: a tetrahedron of 2 x 3 x 4, whose node undoes the quantization.
TEST(QuantizedGltf, IntegersAreScaledByTheNode) {
  const std::string bytes =
      Bytes<uint16_t>({0, 0, 0, 9, 8192, 0, 0, 9, 0, 12288, 0, 9, 0, 0, 16384, 9});
  const PointsRead read = ReadText(
      Gltf(bytes, R"("componentType":5123,"count":4)",
           R"(,"scale":[0.000244140625,0.000244140625,0.000244140625],"translation":[1,0,0])",
           kQuantization, R"(,"byteStride":8)"),
      PointFormat::kGltf);
  ASSERT_TRUE(read.status.ok()) << read.status;
  EXPECT_THAT(read.xyz(), ElementsAre(1, 0, 0, 3, 0, 0, 1, 3, 0, 1, 0, 4));
}

TEST(QuantizedGltf, EachTypeIsDecodedAsTheExtensionSays) {
  const auto read = [](const std::string& bytes, const std::string& type, bool normalized) {
    return ReadText(Gltf(bytes,
                         absl::StrCat(R"("componentType":)", type, R"(,"count":1,"normalized":)",
                                      normalized ? "true" : "false"),
                         "", kQuantization),
                    PointFormat::kGltf)
        .xyz();
  };
  EXPECT_THAT(read(Bytes<int8_t>({-128, 127, 1}), "5120", true), ElementsAre(-1, 1, 1 / 127.0));
  EXPECT_THAT(read(Bytes<int8_t>({-128, 127, 1}), "5120", false), ElementsAre(-128, 127, 1));
  EXPECT_THAT(read(Bytes<uint8_t>({0, 255, 1}), "5121", true), ElementsAre(0, 1, 1 / 255.0));
  EXPECT_THAT(read(Bytes<uint8_t>({0, 255, 1}), "5121", false), ElementsAre(0, 255, 1));
  EXPECT_THAT(read(Bytes<int16_t>({-32768, 32767, 1}), "5122", true),
              ElementsAre(-1, 1, 1 / 32767.0));
  EXPECT_THAT(read(Bytes<int16_t>({-32768, 32767, 1}), "5122", false),
              ElementsAre(-32768, 32767, 1));
  EXPECT_THAT(read(Bytes<uint16_t>({0, 65535, 1}), "5123", true), ElementsAre(0, 1, 1 / 65535.0));
  EXPECT_THAT(read(Bytes<uint16_t>({0, 65535, 1}), "5123", false), ElementsAre(0, 65535, 1));
}

TEST(GltfFile, UnknownRequiredExtensionsAreRefusedByName) {
  for (const char* name : {"KHR_draco_mesh_compression", "EXT_meshopt_compression", "ACME_new"}) {
    EXPECT_THAT(Error(Gltf(Bytes(kTriangle), kFloats, "",
                           absl::StrCat(R"("extensionsRequired":[")", name, R"("],)"))),
                HasSubstr(absl::StrCat("FILE: the extension \"", name, "\" is required")));
  }
  EXPECT_EQ(Error(Gltf(Bytes(kTriangle), kFloats, "",
                       R"("extensionsRequired":["KHR_materials_unlit"],)")),
            "");
}

TEST(GltfFile, UntransformedFloatsStayFloats) {
  const PointsRead read = ReadText(Gltf(Bytes(kTriangle), kFloats), PointFormat::kGltf);
  ASSERT_TRUE(read.status.ok()) << read.status;
  EXPECT_TRUE(read.all_float());
  EXPECT_THAT(read.xyz(), ElementsAre(0.1f, 0, 0, 1, 0, 0, 0, 2, 0));
}

TEST(GltfFile, FilesWithoutScenesUseAllRoots) {
  const std::string text = Replaced(Gltf(Bytes(kTriangle), kFloats, R"(,"translation":[0,0,5])"),
                                    R"("scene":0,"scenes":[{"nodes":[0]}],)", "");
  EXPECT_THAT(ReadText(text, PointFormat::kGltf).xyz(), ElementsAre(0.1f, 0, 5, 1, 0, 5, 0, 2, 5));
  const std::string bare = Replaced(text, R"("nodes":[{"mesh":0,"translation":[0,0,5]}],)", "");
  EXPECT_EQ(ReadText(bare, PointFormat::kGltf).counts.points, 3u);
}

// A triangle at z = 5 in the first scene, and another at z = 7 in the second one, which also shows
// the first.
TEST(GltfFile, FilesWithoutADefaultSceneUseAllScenes) {
  const std::string text = Replaced(
      Gltf(Bytes(kTriangle), kFloats, R"(,"translation":[0,0,5]},{"mesh":0,"translation":[0,0,7])"),
      R"("scene":0,"scenes":[{"nodes":[0]}])", R"("scenes":[{"nodes":[0]},{"nodes":[1,0]}])");
  EXPECT_THAT(ReadText(text, PointFormat::kGltf).xyz(),
              ElementsAre(0.1f, 0, 5, 1, 0, 5, 0, 2, 5, 0.1f, 0, 7, 1, 0, 7, 0, 2, 7));
  const auto of_scene = [&text](const std::string& scene) {
    return ReadText(Replaced(text, R"("scenes")", R"("scene":)" + scene + R"(,"scenes")"),
                    PointFormat::kGltf);
  };
  EXPECT_THAT(of_scene("0").xyz(), ElementsAre(0.1f, 0, 5, 1, 0, 5, 0, 2, 5));
  EXPECT_EQ(of_scene("1").counts.points, 6u);
  EXPECT_EQ(of_scene("2").error(), "FILE: scenes[2] is out of range; the list's size is 2");
}

TEST(GltfFile, ErrorsOfPrimitivesNameTheNode) {
  EXPECT_EQ(Error(Replaced(Gltf(Bytes(kTriangle), kFloats, R"(,"name":"arm")"),
                           R"("primitives":[{)", R"("primitives":[{"mode":7,)")),
            "FILE: \"arm\": a primitive has an unknown mode 7");
  EXPECT_EQ(Error(Gltf(Bytes(kTriangle), kFloats, R"(,"rotation":[0,0,0,0])")),
            "FILE: \"nodes[0]\": a rotation is not a unit quaternion");
}

TEST(GltfFile, NodesWithMatrixAndAnotherTransformAreRefusedByName) {
  const std::string matrix = R"(,"matrix":[1,0,0,0,0,1,0,0,0,0,1,0,0,0,0,1])";
  for (const char* const other :
       {"translation\":[1,2,3]", "scale\":[1,1,1]", "rotation\":[0,0,0,1]"}) {
    const std::string name(other, std::string(other).find('"'));
    const std::string both = absl::StrCat(matrix, ",\"", other);
    EXPECT_EQ(Error(Gltf(Bytes(kTriangle), kFloats, both + R"(,"name":"arm")")),
              "FILE: \"arm\": has both matrix and " + name + "; remove one of them");
    EXPECT_THAT(Error(Gltf(Bytes(kTriangle), kFloats, both)), HasSubstr("\"nodes[0]\": has both"));
  }
}

TEST(GltfFile, NodesComposeMatricesAndRotations) {
  const std::string matrix = R"(,"matrix":[0,1,0,0,-1,0,0,0,0,0,1,0,10,0,0,1])";
  EXPECT_THAT(ReadText(Gltf(Bytes(kTriangle), kFloats, matrix), PointFormat::kGltf).xyz(),
              ElementsAre(10, 0.1f, 0, 10, 1, 0, 8, 0, 0));
  const std::string nested = Replaced(
      Gltf(Bytes(kTriangle), kFloats,
           R"(,"rotation":[1,0,0,0]},{"children":[0],"scale":[1,1,2],"translation":[0,0,1])"),
      R"("scenes":[{"nodes":[0]}])", R"("scenes":[{"nodes":[1]}])");
  EXPECT_THAT(ReadText(nested, PointFormat::kGltf).xyz(),
              ElementsAre(0.1f, 0, 1, 1, 0, 1, 0, -2, 1));
  EXPECT_THAT(Error(Gltf(Bytes(kTriangle), kFloats, R"(,"children":[0])")),
              HasSubstr("several parents"));
}

// Exporters write quaternions as floats: half a turn about x + y, then a quarter turn about z.
TEST(GltfFile, RotationsAreNormalized) {
  const auto turned = [](const std::string& quaternion) {
    return Gltf(Bytes(kTriangle), kFloats, R"(,"rotation":)" + quaternion);
  };
  EXPECT_THAT(ReadText(turned("[0.70710677,0.70710677,0,0]"), PointFormat::kGltf).xyz(),
              ElementsAre(0, 0.1f, 0, 0, 1, 0, 2, 0, 0));
  EXPECT_THAT(ReadText(turned("[0,0,3,3]"), PointFormat::kGltf).xyz(),
              ElementsAre(0, 0.1f, 0, 0, 1, 0, -2, 0, 0));
  EXPECT_THAT(Error(turned("[0,0,0,0]")), HasSubstr("rotation is not a unit quaternion"));
  EXPECT_THAT(Error(turned("[0,0,0,1e200]")), HasSubstr("rotation is not a unit quaternion"));
}

TEST(GltfFile, BuffersMayBeFilesWithEscapedNames) {
  const TempFile buffer("my buffer#1.bin", Bytes(kTriangle));
  const std::string name = buffer.path().substr(buffer.path().rfind('/') + 1);
  const std::string escaped = Replaced(Replaced(name, " ", "%20"), "#", "%23");
  const std::string text =
      Replaced(Gltf(Bytes(kTriangle), kFloats), DataUri(Bytes(kTriangle)), escaped);
  EXPECT_EQ(ReadText(text, PointFormat::kGltf).counts.points, 3u);
  EXPECT_EQ(Error(Replaced(text, escaped, ".\\\\" + escaped)), "");
  EXPECT_THAT(Error(Replaced(text, "%23", "%24")), HasSubstr("cannot be read"));
  EXPECT_THAT(Error(Replaced(text, R"("byteLength":36,"uri")", R"("byteLength":37,"uri")")),
              HasSubstr("declares 37 bytes"));
}

TEST(GltfFile, AStrideOfZeroMeansPackedElements) {
  EXPECT_THAT(
      ReadText(Gltf(Bytes(kTriangle), kFloats, "", "", R"(,"byteStride":0)"), PointFormat::kGltf)
          .xyz(),
      ElementsAre(0.1f, 0, 0, 1, 0, 0, 0, 2, 0));
  EXPECT_THAT(Error(Gltf(Bytes(kTriangle), kFloats, "", "", R"(,"byteStride":4)")),
              HasSubstr("reaches beyond its buffer"));
}

TEST(GltfFile, PrimitivesMayBeEmpty) {
  const std::string two = Replaced(Gltf(Bytes(kTriangle), kFloats), R"("primitives":[)",
                                   R"("primitives":[{"attributes":{"POSITION":1}},)");
  const auto with_accessor = [&two](const std::string& accessor) {
    return ReadText(
        Replaced(two, R"("count":3})",
                 absl::StrCat(R"("count":3},{"type":"VEC3","componentType":5126)", accessor, "}")),
        PointFormat::kGltf);
  };
  EXPECT_EQ(with_accessor(R"(,"count":0)").counts.points, 3u);
  EXPECT_THAT(with_accessor("").error(), HasSubstr("accessors[1] has no positions"));
  EXPECT_THAT(Error(Gltf(Bytes(kTriangle), R"("componentType":5126,"count":0)")),
              HasSubstr("the meshes of the scene have no vertex"));
}

TEST(GltfFile, NamesNeedNotBeUtf8) {
  const PointsRead read =
      ReadText(Gltf(Bytes(kTriangle), kFloats, ",\"name\":\"\xa3\""), PointFormat::kGltf);
  ASSERT_TRUE(read.status.ok()) << read.status;
  EXPECT_EQ(read.counts.points, 3u);
  EXPECT_EQ(Error(Gltf(Bytes(kTriangle), kFloats,
                       ",\"name\":\"K\xf6rper \xe4\xbd\x93\",\"rotation\":[0,0,0,0]")),
            "FILE: \"K?rper \xe4\xbd\x93\": a rotation is not a unit quaternion");
}

// The text of the base64 was read as positions.
TEST(GltfFile, TheEncodingOfDataIsNamedInAnyCase) {
  EXPECT_THAT(ReadText(Replaced(Gltf(Bytes(kTriangle), kFloats), ";base64,", ";BASE64,"),
                       PointFormat::kGltf)
                  .xyz(),
              ElementsAre(0.1f, 0, 0, 1, 0, 0, 0, 2, 0));
}

TEST(GltfFile, SparseAccessorsReplacePositions) {
  const std::string bytes = Bytes(kTriangle) + Bytes<float>({7, 8, 9}) + Bytes<uint16_t>({1});
  const std::string text = Gltf(
      bytes,
      absl::StrCat(kFloats, R"(,"sparse":{"count":1,"indices":{"bufferView":0,"byteOffset":48,)"
                            R"("componentType":5123},"values":{"bufferView":0,"byteOffset":36}})"));
  EXPECT_THAT(ReadText(text, PointFormat::kGltf).xyz(), ElementsAre(0.1f, 0, 0, 7, 8, 9, 0, 2, 0));
  const std::string zeros = Replaced(text, R"("bufferView":0,"type")", R"("type")");
  EXPECT_THAT(ReadText(zeros, PointFormat::kGltf).xyz(), ElementsAre(0, 0, 0, 7, 8, 9, 0, 0, 0));
  EXPECT_THAT(Error(Replaced(text, R"("byteOffset":48)", R"("byteOffset":49)")),
              HasSubstr("reaches beyond its buffer"));
}

// A morph target that moves by (2, 4, 8), and a second one by (100, 0, 0).
std::string MorphGltf(const std::string& mesh_weights, const std::string& node_weights) {
  const std::string bytes = Bytes(kTriangle) + Bytes<float>({2, 4, 8, 2, 4, 8, 2, 4, 8}) +
                            Bytes<float>({100, 0, 0, 100, 0, 0, 100, 0, 0});
  std::string text =
      Gltf(bytes, kFloats, node_weights.empty() ? "" : R"(,"weights":)" + node_weights);
  text = Replaced(text, R"({"POSITION":0}}])",
                  absl::StrCat(R"({"POSITION":0},"targets":[{"POSITION":1},{"POSITION":2}]}])",
                               mesh_weights.empty() ? "" : R"(,"weights":)" + mesh_weights));
  const std::string accessor = R"({"bufferView":0,"type":"VEC3","componentType":5126,"count":3)";
  return Replaced(text, accessor + "}",
                  absl::StrCat(accessor, "},", accessor, R"(,"byteOffset":36},)", accessor,
                               R"(,"byteOffset":72})"));
}

TEST(GltfFile, MorphTargetsMoveVerticesByTheirWeights) {
  const auto read = [](const std::string& mesh, const std::string& node) {
    const PointsRead points = ReadText(MorphGltf(mesh, node), PointFormat::kGltf);
    EXPECT_TRUE(points.status.ok()) << points.status;
    return points.xyz();
  };
  const double x = 0.1f;
  EXPECT_THAT(read("", ""), ElementsAre(x, 0, 0, 1, 0, 0, 0, 2, 0));
  EXPECT_THAT(read("[0,0]", ""), ElementsAre(x, 0, 0, 1, 0, 0, 0, 2, 0));
  EXPECT_THAT(read("[0.5,0]", ""), ElementsAre(x + 1, 2, 4, 2, 2, 4, 1, 4, 4));
  EXPECT_THAT(read("[0.5,1]", ""), ElementsAre(x + 1 + 100, 2, 4, 102, 2, 4, 101, 4, 4));
  // The node's weights take precedence.
  EXPECT_THAT(read("[9,9]", "[-0.5,0]"), ElementsAre(x - 1, -2, -4, 0, -2, -4, -1, 0, -4));
  EXPECT_THAT(Error(Replaced(MorphGltf("[1,0]", ""), R"("count":3,"byteOffset":36)",
                             R"("count":2,"byteOffset":36)")),
              HasSubstr("a morph target has 2 positions for 3 vertices"));
}

// The first vertex follows nodes[1], the second nodes[2], the third both.
std::string SkinGltf() {
  const std::string bytes = Bytes(kTriangle) +
                            Bytes<uint8_t>({0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0}) +
                            Bytes<float>({1, 0, 0, 0, 1, 0, 0, 0, 0.25f, 0.75f, 0, 0}) +
                            Bytes<float>({1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1}) +
                            Bytes<float>({1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, -3, 0, 0, 1});
  std::string text =
      Gltf(bytes, kFloats,
           R"(,"skin":0,"translation":[1000,0,0]},{"translation":[0,0,8]},{"translation":[3,4,0])",
           R"("skins":[{"joints":[1,2],"inverseBindMatrices":3}],)");
  text = Replaced(text, R"("nodes":[0])", R"("nodes":[0,1,2])");
  text = Replaced(text, R"("POSITION":0)", R"("POSITION":0,"JOINTS_0":1,"WEIGHTS_0":2)");
  return Replaced(text, R"("count":3}])",
                  R"("count":3},
      {"bufferView":0,"byteOffset":36,"type":"VEC4","componentType":5121,"count":3},
      {"bufferView":0,"byteOffset":48,"type":"VEC4","componentType":5126,"count":3},
      {"bufferView":0,"byteOffset":96,"type":"MAT4","componentType":5126,"count":2}])");
}

TEST(GltfFile, SkinsPlaceVerticesByTheirJoints) {
  const PointsRead read = ReadText(SkinGltf(), PointFormat::kGltf);
  ASSERT_TRUE(read.status.ok()) << read.status;
  EXPECT_THAT(read.xyz(), ElementsAre(0.1f, 0, 8, 1, 4, 0, 0, 5, 2));
}

TEST(GltfFile, SkinsThatDoNotMatchTheirMeshAreErrors) {
  const auto error = [](const std::string& from, const std::string& to) {
    return Error(Replaced(SkinGltf(), from, to));
  };
  EXPECT_THAT(error(R"("nodes":[0,1,2])", R"("nodes":[0,1])"),
              HasSubstr("skins[0]: the joint nodes[2] is not in the scene"));
  EXPECT_THAT(error(R"("joints":[1,2])", R"("joints":[1])"),
              HasSubstr("vertex 1 has the joint 1, but the skin has 1"));
  EXPECT_THAT(error(R"("joints":[1,2])", R"("joints":[1,2,1])"),
              HasSubstr("fewer inverseBindMatrices than joints"));
  EXPECT_THAT(error(R"("skin":0)", R"("skin":1)"), HasSubstr("skins[1] is out of range"));
  EXPECT_THAT(error(R"("componentType":5121,"count":3)", R"("componentType":5121,"count":2)"),
              HasSubstr("more or fewer joints than vertices"));
  EXPECT_THAT(error(R"("byteOffset":36,"type":"VEC4","componentType":5121)",
                    R"("byteOffset":50,"type":"VEC4","componentType":5120)"),
              HasSubstr("vertex 0 has the joint -128, but the skin has 2"));
  EXPECT_THAT(error(R"("type":"MAT4")", R"("type":"MAT3")"), HasSubstr("must be MAT4"));
}

TEST(GltfFile, BoundsAreChecked) {
  const std::string good = Gltf(Bytes(kTriangle), kFloats);
  const auto error = [&](const std::string& from, const std::string& to) {
    return Error(Replaced(good, from, to));
  };
  EXPECT_THAT(error(R"("count":3)", R"("count":4)"), HasSubstr("accessors[0] reaches beyond"));
  EXPECT_THAT(error(R"("count":3)", R"("count":9e15)"), HasSubstr("accessors[0] reaches beyond"));
  EXPECT_THAT(error(R"("count":3)", R"("count":-1)"), HasSubstr("count is not a whole number"));
  EXPECT_THAT(error(R"("count":3)", R"("count":0)"), HasSubstr("have no vertex"));
  EXPECT_THAT(error(R"("POSITION":0)", R"("POSITION":1)"),
              HasSubstr("accessors[1] is out of range"));
  EXPECT_THAT(error(R"("POSITION":0)", R"("NORMAL":0)"), HasSubstr("have no vertex"));
  EXPECT_THAT(error("VEC3", "VEC2"), HasSubstr("is not a position"));
  EXPECT_THAT(error(R"("mesh":0)", R"("mesh":1)"), HasSubstr("meshes[1] is out of range"));
  EXPECT_THAT(error(R"("2.0")", R"("1.0")"), HasSubstr("only glTF 2.0 is supported"));
  EXPECT_THAT(error("}]}", "}]"), HasSubstr("is not valid glTF JSON"));
}

TEST(GltfFile, IndicesMakeTrianglesOfEachMode) {
  const std::string bytes =
      Bytes<float>({0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0}) + Bytes<uint8_t>({0, 1, 2, 3});
  const auto triangles = [&](const std::string& mode, const std::string& count) {
    const std::string text =
        Replaced(Gltf(bytes, R"("componentType":5126,"count":4)"), R"("attributes")",
                 absl::StrCat(R"("indices":1,"mode":)", mode, R"(,"attributes")"));
    const TempFile file(
        "a.gltf",
        Replaced(text, R"("count":4}])",
                 absl::StrCat(R"("count":4},{"bufferView":0,"byteOffset":48,)",
                              R"("type":"SCALAR","componentType":5121,"count":)", count, "}]")));
    const auto mesh = ReadMesh(file.path());
    EXPECT_TRUE(mesh.ok()) << mesh.status();
    return mesh.ok() ? mesh->triangles : TriangleMesh().triangles;
  };
  EXPECT_THAT(triangles("0", "4"), ElementsAre());
  EXPECT_THAT(triangles("4", "3"), ElementsAre(ElementsAre(0, 1, 2)));
  EXPECT_THAT(triangles("5", "4"), ElementsAre(ElementsAre(0, 1, 2), ElementsAre(2, 1, 3)));
  EXPECT_THAT(triangles("6", "4"), ElementsAre(ElementsAre(0, 1, 2), ElementsAre(0, 2, 3)));
}

// The other vertices of a shared accessor are not part of the mesh.
TEST(GltfFile, VerticesWithoutAnIndexAreOmitted) {
  const std::string bytes =
      Bytes<float>({9, 9, 9, 1, 0, 0, NAN, 9, 9, 0, 1, 0, 0, 0, 1}) + Bytes<uint8_t>({4, 1, 3});
  const std::string text =
      Replaced(Replaced(Gltf(bytes, R"("componentType":5126,"count":5)"), R"("attributes")",
                        R"("indices":1,"attributes")"),
               R"("count":5}])",
               R"("count":5},{"bufferView":0,"byteOffset":60,"componentType":5121,"count":3}])");
  const PointsRead read = ReadText(text, PointFormat::kGltf);
  ASSERT_TRUE(read.status.ok()) << read.status;
  EXPECT_TRUE(read.all_float());
  EXPECT_THAT(read.xyz(), ElementsAre(1, 0, 0, 0, 1, 0, 0, 0, 1));
  EXPECT_THAT(
      ReadText(Replaced(text, R"("indices":1)", R"("indices":1,"mode":0)"), PointFormat::kGltf)
          .xyz(),
      ElementsAre(1, 0, 0, 0, 1, 0, 0, 0, 1));
  const TempFile file("a.gltf", text);
  const auto mesh = ReadMesh(file.path());
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  EXPECT_THAT(mesh->vertices,
              ElementsAre(ElementsAre(1, 0, 0), ElementsAre(0, 1, 0), ElementsAre(0, 0, 1)));
  EXPECT_THAT(mesh->triangles, ElementsAre(ElementsAre(2, 0, 1)));
}

TEST(GltfFile, BinaryFilesAreReadAndTruncatedOnesRefused) {
  std::string json = Replaced(Gltf(Bytes(kTriangle), kFloats),
                              absl::StrCat(R"(,"uri":")", DataUri(Bytes(kTriangle)), "\""), "");
  while (json.size() % 4 != 0) json += ' ';
  const auto size = [](size_t value) { return Bytes<uint32_t>({static_cast<uint32_t>(value)}); };
  const auto glb_of = [&](const std::string& text) {
    const std::string body =
        size(text.size()) + "JSON" + text + size(36) + std::string("BIN\0", 4) + Bytes(kTriangle);
    return "glTF" + size(2) + size(12 + body.size()) + body;
  };
  const std::string glb = glb_of(json);
  EXPECT_EQ(ReadText(glb, PointFormat::kGltf).counts.points, 3u);
  // Some writers pad with zeros.
  EXPECT_EQ(ReadText(glb_of(json + std::string(4, '\0')), PointFormat::kGltf).counts.points, 3u);
  for (size_t length = 4; length < glb.size(); ++length) {
    EXPECT_THAT(Error(glb.substr(0, length)), HasSubstr("FILE: byte ")) << length;
  }
}

}  // namespace gltf_file_test
}  // namespace hulld
