#include "tests/fuzz/files/file_seeds.h"

#include <cstring>
#include <string>
#include <vector>

namespace hulld::fuzz {
namespace {

// Two compressed points; LZF stores incompressible data as a length and the bytes.
std::string CompressedPcd() {
  const std::string sizes = std::string("\x19\0\0\0\x18\0\0\0", 8);
  return "FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH 2\nHEIGHT 1\nPOINTS 2\n"
         "DATA binary_compressed\n" +
         sizes + "\x17" + std::string(24, '\x3f');
}

const char* SmallStl() {
  return "solid two words\nfacet normal 0 0 -nan(ind)\nouter loop\nvertex 0 0 1\nvertex 1 0 0\n"
         "vertex 0 1 0\nendloop\nendfacet\nendsolid\nSOLID\nFACET\nOUTER LOOP\nVERTEX 1 2 3\n"
         "VERTEX 4 5 6\nVERTEX 7 8 9\nENDLOOP\nENDFACET\nENDSOLID\n";
}

std::string SmallBinaryStl() {
  return "solid" + std::string(75, ' ') + std::string("\2\0\0\0", 4) + std::string(100, '\x3f') +
         "x";
}

const char* SmallGltf() {
  return R"({"asset":{"version":"2.0"},"extensionsRequired":["KHR_mesh_quantization"],"scene":0,)"
         R"("scenes":[{"nodes":[1]}],"nodes":[{"mesh":0,"rotation":[0,0,1,0]},{"children":[0],)"
         R"("scale":[1,2,3],"mesh":0}],"meshes":[{"primitives":[{"attributes":{"POSITION":0},)"
         R"("indices":1,"mode":5}]}],"buffers":[{"byteLength":36,"uri":"data:;base64,)"
         R"(AAAAAAAAgD8AAABAAABAQAAAgEAAAKBAAADAQAAA4EAAAQIA"}],"bufferViews":[{"buffer":0,)"
         R"("byteLength":36}],"accessors":[{"bufferView":0,"componentType":5122,"normalized":true,)"
         R"("count":3,"type":"VEC3","sparse":{"count":1,"indices":{"bufferView":0,"byteOffset":33,)"
         R"("componentType":5121},"values":{"bufferView":0,"byteOffset":2}}},{"bufferView":0,)"
         R"("byteOffset":32,"componentType":5121,"count":3,"type":"SCALAR"}]})";
}

// Elements are lines, so that changes of lines are changes of elements.
const char* SmallDae() {
  return R"(<?xml version="1.0"?>
<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
<asset><unit name="inch" meter="0.0254"/></asset>
<library_geometries><geometry id="g"><mesh>
<source id="s"><float_array id="a" count="13">
9 0 0 0 1 0 0 0 1 0 .5 -2 1e3
</float_array><technique_common>
<accessor source="#a" offset="1" count="4" stride="3">
<param name="X" type="float"/>
<param name="Y" type="float"/>
<param name="Z" type="float"/>
</accessor></technique_common></source>
<vertices id="v">
<input semantic="POSITION" source="#s"/>
</vertices>
<polylist count="2">
<input semantic="VERTEX" source="#v" offset="0"/>
<input semantic="NORMAL" source="#n" offset="1"/>
<vcount>3 4</vcount>
<p>0 7 1 7 2 7 0 7 1 7 2 7 3 7</p>
</polylist>
<tristrips count="1">
<input semantic="VERTEX" source="#v" offset="0"/>
<p>0 1 2 3</p>
</tristrips>
</mesh></geometry></library_geometries>
<library_nodes><node id="n">
<rotate>0 0 1 30</rotate>
<instance_geometry url="#g"/>
</node></library_nodes>
<library_visual_scenes><visual_scene id="c">
<node id="m">
<matrix>1 0 0 4 0 1 0 5 0 0 2 6 0 0 0 1</matrix>
<lookat>1 2 3 4 5 6 0 0 1</lookat>
<instance_node url="#n"/>
<node>
<scale>1 -1 2</scale>
<skew>30 1 0 0 0 1 0</skew>
<instance_node url="#n"/>
</node>
</node>
<node id="k">
<translate>0 0 0</translate>
<instance_geometry url="#g"/>
</node>
</visual_scene></library_visual_scenes>
<scene><instance_visual_scene url="#c"/></scene>
</COLLADA>
)";
}

// The binary container of glTF, with a JSON chunk and a chunk of three points.
std::string SmallGlb() {
  const auto word = [](size_t number) {
    const auto value = static_cast<uint32_t>(number);
    return std::string(reinterpret_cast<const char*>(&value), sizeof(value));
  };
  std::string json =
      R"({"asset":{"version":"2.0"},"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0}],)"
      R"("meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],"buffers":[{"byteLength":36}],)"
      R"("bufferViews":[{"buffer":0,"byteLength":36}],"accessors":[{"bufferView":0,)"
      R"("componentType":5126,"count":3,"type":"VEC3"}]})";
  json.resize((json.size() + 3) / 4 * 4, ' ');
  const std::string chunks = word(json.size()) + "JSON" + json + word(36) +
                             std::string("BIN\0", 4) + std::string(36, '\x3f');
  return "glTF" + word(2) + word(12 + chunks.size()) + chunks;
}

// LAS 1.2 or 1.4 with two points of format 0, scale 1 and offset 0.
std::string SmallLas(int minor) {
  const size_t header = minor < 4 ? 227 : 375;
  std::string las(header, '\0');
  const auto put = [&las](size_t at, const auto& value) {
    std::memcpy(las.data() + at, &value, sizeof(value));
  };
  las.replace(0, 4, "LASF");
  put(24, uint8_t{1});
  put(25, static_cast<uint8_t>(minor));
  put(94, static_cast<uint16_t>(header));
  put(96, static_cast<uint32_t>(header));
  put(105, uint16_t{20});
  put(107, uint32_t{minor < 4 ? 2U : 0U});
  if (minor == 4) put(247, uint64_t{2});
  for (size_t axis = 0; axis < 3; ++axis) put(131 + 8 * axis, 1.0);
  return las + std::string(40, '\x01');
}

}  // namespace

std::vector<SeedFile> SeedFiles() {
  const std::string packed(48, '\x3f');
  return {
      {FileKind::kObj, "# c\no a\nv 1 2 3 1\nv -4e-3 5 .6\nvn 0 0 1\nf 1 2 \\\n 1\n"},
      {FileKind::kOff, "OFF\n2 1 0\n1 2 3\n4 5 6\n3 0 1 1\n"},
      {FileKind::kOff, "COFF\n# c\n1 0 0\n1 2 3 0 0 0 1\n"},
      {FileKind::kPly,
       "ply\nformat ascii 1.0\ncomment c\nelement vertex 2\nproperty float x\nproperty float y\n"
       "property list uchar int l\nproperty double z\nend_header\n1 2 1 9 3\n4 5 0 6\n"},
      {FileKind::kPly,
       "ply\nformat binary_little_endian 1.0\nelement a 2\nproperty list uchar uchar l\n"
       "element vertex 2\nproperty float x\nproperty float y\nproperty float z\nend_header\n" +
           std::string("\x02zz\x00", 4) + packed.substr(0, 24)},
      {FileKind::kPly,
       "ply\nformat binary_big_endian 1.0\nelement vertex 2\nproperty double x\nproperty short y\n"
       "property uint z\nend_header\n" +
           packed.substr(0, 28)},
      {FileKind::kXyz, "1 2 3 255 0 0\n4\t5 6\n\n# c\n-0 1e308 5e-324\n"},
      {FileKind::kCsv, "t,x,y,\"z\"\n0,1,2,3\n1,\"4\",5,6\n"},
      {FileKind::kCsv, "1;2;3\n4;5;6\n"},
      {FileKind::kPcd,
       "VERSION .7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH 2\nHEIGHT 1\n"
       "VIEWPOINT 0 0 0 1 0 0 0\nPOINTS 2\nDATA ascii\n1 2 3\nnan nan nan\n"},
      {FileKind::kPcd,
       "FIELDS x y z w\nSIZE 4 4 4 8\nTYPE F F F U\nCOUNT 1 1 1 1\nWIDTH 2\nHEIGHT 1\n"
       "POINTS 2\nDATA binary\n" +
           packed},
      {FileKind::kPcd, CompressedPcd()},
      {FileKind::kXyz, "1,2,3,0\n4, 5, 6,7\n8;9;10\n"},
      {FileKind::kXyz, "2\n1 2 3 -9 255 0 0\n4 5 6\n1\n7 8 9\n"},
      {FileKind::kLas, SmallLas(2)},
      {FileKind::kLas, SmallLas(4)},
      {FileKind::kStl, SmallStl()},
      {FileKind::kStl, SmallBinaryStl()},
      {FileKind::kStlMesh, SmallStl()},
      {FileKind::kStlMesh, SmallBinaryStl()},
      {FileKind::kGltf, SmallGltf()},
      {FileKind::kGltfMesh, SmallGltf()},
      {FileKind::kGltf, SmallGlb()},
      {FileKind::kGltfMesh, SmallGlb()},
      {FileKind::kDae, SmallDae()},
      {FileKind::kDaeMesh, SmallDae()},
      {FileKind::kObjMesh, "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\nf 1/1 2//2 -1/3/3 4\n"},
      {FileKind::kOffMesh, "OFF 3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2 255 0 0\n"},
      {FileKind::kPlyMesh,
       "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
       "property float z\nelement face 1\nproperty list uchar int vertex_indices\n"
       "element tristrips 1\nproperty list int int vertex_index\nend_header\n0 0 0\n1 0 0\n"
       "0 1 0\n3 0 1 2\n5 2 1 0 -1 0\n"},
      {FileKind::kPlyMesh,
       "ply\nformat binary_big_endian 1.0\nelement vertex 1\nproperty char x\nproperty char y\n"
       "property char z\nelement face 2\nproperty list char short vertex_index\nend_header\n" +
           std::string("\1\2\3\3\0\0\0\0\0\0\0", 11)},
      {FileKind::kBatch,
       "# c\nplace: {a: {id: arm}, b: {id: box, at: [1, 0, 0, 0, 1, 2, 3]}}\n"
       "ask: {pairs: [[a, b]]} # d\n"},
      {FileKind::kBatch, "{\"place\": {\"a\": {\"id\": \"arm\"}, \"b\": {\"id\": \"arm\"}}}\n"},
      {FileKind::kBatch, R"({"placements":[{"hullId":"a"},{"hullId":"b"}],)"
                         "\n"
                         R"("pairs":[0,1],"method":1})"},
      {FileKind::kBatch,
       R"({"packedPlacements":{"hullIds":["a"],"hulls":[0,0],"poses":[1,0,0,0,0,0,0,)"
       R"(1,0,0,0,2,0,0]},"groups":[1,2],"ignoredGroupPairs":[2,2],"movers":1})"},
      {FileKind::kSceneJson,
       R"({"placements":[{"hullId":"a"},{"hullId":"b","pose":{"translation":{"x":2}}},)"
       R"({"hullId":"b","pose":{"rotation":{"w":1,"z":"NaN"}}}],"groups":[0,1,1],)"
       R"("ignoreSameGroup":true,"movers":1,"wanted":{"clearance":0.1}})"},
      {FileKind::kAnswerJson,
       R"({"request":{"a":{"hullId":"a"},"b":{"hullId":"b"}},"response":{"header":)"
       R"({"storeId":"s","revision":"4"},"relation":"RELATION_TOUCHING","rung":4,"certificate":)"
       R"({"direction":{"x":1},"pairs":[{"indexA":4,"vertexA":{"x":1e308}}]},)"
       R"("withinClearance":false}})"},
      {FileKind::kYamlScene,
       "prefix: p/\nscale: mm\nhulls:\n  h: {box: [1, 2, 3]}\n  f: {file: a.stl, scale: 2}\n"
       "  g: {points: [[0, 0, 0], [1, 0, 0]]}\nbodies:\n  b: [{hull: h, at: &p [1, 0, 0]}, "
       "{id: x, at: {xyz: [0, 0, 1], rpy: [0, 0, 1]}}]\nplace:\n  a: {hull: h, group: q}\n"
       "  c: {body: b, at: *p}\n  d: {id: x, group: q}\nignore: [[a, c]]\n"
       "ask: {movers: [c], clearance: 0.1}\n"},
      {FileKind::kYamlScene,
       "# c\n---\nplace:\n  a: {id: x}\n  b:\n    id: \"y\"\n    at: [1, 0, 0, 1, 0, 0, 2]\n"
       "ask: {pairs: [[a, b]], separation: true}\n"},
      {FileKind::kUrdf,
       "<?xml version=\"1.0\"?>\n<!-- c -->\n<robot name=\"r\"><link name=\"a\"><collision>"
       "<origin xyz=\"0 0 1\" rpy=\"0 0 1\"/><geometry><capsule radius=\"1\" length=\"2\"/>"
       "</geometry></collision></link><link name=\"b\"><collision><geometry><mesh "
       "filename=\"a.stl\" scale=\"1 1 2\"/></geometry></collision></link><link name=\"c\"/>"
       "<joint name=\"i\" type=\"revolute\"><parent link=\"a\"/><child link=\"b\"/>"
       "<axis xyz=\"0 1 0\"/><limit lower=\"-1\" upper=\"2\"/></joint><joint name=\"j\" "
       "type=\"continuous\"><parent link=\"b\"/><child link=\"c\"/><mimic joint=\"i\" "
       "multiplier=\"2\"/></joint></robot>"},
      {FileKind::kSrdf,
       "<robot name='r'><disable_default_collisions link='a'/><enable_collisions link1='a' "
       "link2='b'/><disable_collisions link1='a' link2='b' reason='Never'/></robot>"},
      {FileKind::kJoints, "time,j\n0,1.5\n# c\n\n1,-2e3\n"},
      {FileKind::kStreamJson,
       R"({"placements":[{"hullId":"a"},{"hullId":"b"}],"pairs":[0,1],"onlyChanges":true})"},
  };
}

}  // namespace hulld::fuzz
