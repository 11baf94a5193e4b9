#include "tests/fuzz/files/file_check.h"

#include <absl/status/status.h>
#include <absl/strings/str_cat.h>
#include <google/protobuf/message.h>
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <iterator>
#include <utility>

#include "client/formats/byte_source.h"
#include "client/formats/mesh_file.h"
#include "client/formats/point_file.h"
#include "client/hullctl/printing/json.h"
#include "client/hullctl/scene/scene_file.h"
#include "client/robot/joint_file.h"
#include "client/robot/srdf_file.h"
#include "client/robot/urdf_file.h"
#include "hulld/v1/collision.pb.h"

namespace hulld::fuzz {
namespace {

constexpr char kName[] = "the file";
constexpr size_t kSmallBlock = 2;

// Returns a file descriptor with this content, positioned at its start.
int OpenInMemory(std::string_view content) {
  const int file = memfd_create("fuzz", 0);
  if (file < 0) std::abort();
  while (!content.empty()) {
    const ssize_t written = write(file, content.data(), content.size());
    if (written <= 0) std::abort();
    content.remove_prefix(static_cast<size_t>(written));
  }
  lseek(file, 0, SEEK_SET);
  return file;
}

std::string CheckRefusal(const absl::Status& status) {
  const std::string message(status.message().data(), status.message().size());
  if (absl::IsInvalidArgument(status) && message.rfind(kName, 0) == 0 &&
      message.size() > sizeof(kName) + 3) {
    return {};
  }
  return "a refusal that does not name the file and the fault: " + status.ToString();
}

using PointReader = absl::Status (*)(ByteSource*, PointCollector*);

PointReader ReaderOf(FileKind kind) {
  switch (kind) {
    case FileKind::kObj:
      return ReadObj;
    case FileKind::kOff:
      return ReadOff;
    case FileKind::kPly:
      return ReadPly;
    case FileKind::kXyz:
      return ReadXyz;
    case FileKind::kCsv:
      return ReadCsv;
    case FileKind::kPcd:
      return ReadPcd;
    case FileKind::kLas:
      return ReadLas;
    case FileKind::kStl:
      return ReadStl;
    case FileKind::kGltf:
      return ReadGltf;
    case FileKind::kDae:
      return ReadDae;
    default:
      return nullptr;
  }
}

// All points read from a file.
struct PointsRead {
  absl::Status status;
  ReadCounts counts;
  std::vector<double> xyz;
  std::string finding;
};

void Take(const PointChunk& block, size_t most, PointsRead* to) {
  if (!block.xyz.empty() && !block.xyz_float.empty())
    to->finding = "a block contains both xyz and xyz_float";
  if (block.size() == 0 || (most > 0 && block.size() > most))
    to->finding = "a block is empty or too large";
  if ((block.xyz.size() + block.xyz_float.size()) % 3 != 0) to->finding = "a block splits a point";
  to->xyz.insert(to->xyz.end(), block.xyz.begin(), block.xyz.end());
  to->xyz.insert(to->xyz.end(), block.xyz_float.begin(), block.xyz_float.end());
}

PointsRead ReadPointsOf(PointReader reader, std::string_view content, const ReadOptions& options) {
  PointsRead read;
  PointCollector points(options, [&](const PointChunk& block) {
    Take(block, options.points_per_block, &read);
    return absl::OkStatus();
  });
  ByteSource source(OpenInMemory(content), kName);
  read.status = reader(&source, &points);
  if (read.status.ok()) read.status = points.Flush();
  read.counts = points.counts();
  const auto is_finite = [](double x) { return std::isfinite(x); };
  if (!read.finding.empty()) return read;
  if (!std::all_of(read.xyz.begin(), read.xyz.end(), is_finite)) {
    read.finding = "a non-finite point was delivered";
  } else if (!read.status.ok()) {
    read.finding = CheckRefusal(read.status);
  } else if (3 * read.counts.points != read.xyz.size()) {
    read.finding = absl::StrCat(read.counts.points, " points counted, but ", read.xyz.size(),
                                " coordinates delivered");
  }
  return read;
}

FileVerdict CheckPoints(PointReader reader, std::string_view content) {
  const PointsRead whole = ReadPointsOf(reader, content, {});
  if (!whole.finding.empty()) return {whole.finding, false};
  const bool has_geometry =
      reader == ReadObj || reader == ReadStl || reader == ReadGltf || reader == ReadDae;
  if (whole.status.ok() && has_geometry && whole.xyz.empty()) return {"read as empty", false};
  ReadOptions options;
  options.points_per_block = kSmallBlock;
  const PointsRead pieces = ReadPointsOf(reader, content, options);
  if (!pieces.finding.empty()) return {pieces.finding, false};
  if (pieces.status != whole.status) return {"the status depends on the block size", false};
  if (whole.status.ok() && pieces.xyz != whole.xyz) {
    return {"the points depend on the block size", false};
  }
  options.skip_nonfinite = true;
  const PointsRead lenient = ReadPointsOf(reader, content, options);
  if (!lenient.finding.empty()) return {lenient.finding, false};
  if (whole.status.ok() && (lenient.counts.skipped > 0 || lenient.xyz != whole.xyz)) {
    return {"points are skipped although all are finite", false};
  }
  return {"", whole.status.ok()};
}

template <absl::Status (*kReader)(ByteSource*, std::vector<MeshPart>*)>
absl::Status MeshOfParts(ByteSource* source, TriangleMesh* mesh) {
  std::vector<MeshPart> parts;
  absl::Status status = kReader(source, &parts);
  for (size_t i = 0; i < parts.size() && status.ok(); ++i) {
    status = AddMesh(kName, parts[i].mesh, mesh);
  }
  if (status.ok() && mesh->vertices.empty()) return absl::InternalError("read as empty");
  return status;
}

FileVerdict CheckMesh(absl::Status (*reader)(ByteSource*, TriangleMesh*),
                      std::string_view content) {
  ByteSource source(OpenInMemory(content), kName);
  TriangleMesh mesh;
  const absl::Status status = reader(&source, &mesh);
  if (!status.ok()) return {CheckRefusal(status), false};
  for (const auto& vertex : mesh.vertices) {
    for (const double x : vertex) {
      if (!std::isfinite(x)) return {"a vertex is not finite", false};
    }
  }
  for (const auto& triangle : mesh.triangles) {
    for (const uint32_t index : triangle) {
      if (index >= mesh.vertices.size()) return {"a triangle index is out of range", false};
    }
  }
  return {"", true};
}

FileVerdict CheckScene(std::string_view content) {
  ByteSource source(OpenInMemory(content), kName);
  const absl::StatusOr<Scene> scene = ReadScene(&source);
  if (!scene.ok()) return {CheckRefusal(scene.status()), false};
  const uint32_t size = scene->size();
  if (!scene->names.empty() && scene->names.size() != size)
    return {"names without placements", false};
  for (uint32_t i = 0; i < size; ++i) {
    if (scene->HullOf(i) == nullptr) return {"a placement without a hull", false};
    if (scene->PlacementOf(i).hull_id() != *scene->HullOf(i))
      return {"a placement has a different hull", false};
  }
  const absl::StatusOr<std::vector<uint32_t>> pairs = PairsOf(*scene, kName);
  if (!pairs.ok()) return {CheckRefusal(pairs.status()), false};
  for (const uint32_t index : *pairs) {
    if (index >= size) return {"a pair index is out of range", false};
  }
  return {pairs->size() % 2 == 0 ? "" : "a pair is incomplete", true};
}

// The message must round-trip bit by bit, including NaN.
std::string CheckRoundTrip(const google::protobuf::Message& message) {
  const std::string json = MessageJson(message);
  const std::unique_ptr<google::protobuf::Message> again(message.New());
  const absl::Status parsed = ParseJson(json, UnknownFields::kRefuse, again.get());
  if (!parsed.ok()) return "the written JSON cannot be read: " + parsed.ToString() + json;
  if (again->SerializeAsString() != message.SerializeAsString()) {
    return "the written JSON does not round-trip: " + json;
  }
  return {};
}

FileVerdict CheckJson(std::string_view content, google::protobuf::Message* message) {
  const absl::Status parsed = ParseJson(std::string(content), UnknownFields::kRefuse, message);
  if (parsed.ok()) return {CheckRoundTrip(*message), true};
  const bool explained = absl::IsInvalidArgument(parsed) && !parsed.message().empty();
  return {explained ? "" : "JSON is refused without an explanation: " + parsed.ToString(), false};
}

// Reads an answer as `hullctl verify` does.
FileVerdict CheckAnswer(std::string_view content) {
  const std::string json(content);
  v1::CheckCollisionRequest request;
  v1::CheckCollisionResponse response;
  absl::Status status = ParseMember(json, "request", &request);
  if (status.ok()) status = ParseMember(json, "response", &response);
  if (!status.ok()) {
    const bool explained = absl::IsInvalidArgument(status) && !status.message().empty();
    return {explained ? "" : "an answer is refused without an explanation: " + status.ToString(),
            false};
  }
  std::string finding = CheckRoundTrip(request);
  if (finding.empty()) finding = CheckRoundTrip(response);
  return {finding, true};
}

bool AreFinite(const std::vector<double>& numbers) {
  return std::all_of(numbers.begin(), numbers.end(), [](double x) { return std::isfinite(x); });
}

FileVerdict CheckUrdf(std::string_view content) {
  const auto robot = ParseUrdf(std::string(content), kName);
  if (!robot.ok()) return {CheckRefusal(robot.status()), false};
  const auto links = static_cast<int>(robot->links.size());
  for (int i = 0; i < links; ++i) {
    const RobotLink& link = robot->links[static_cast<size_t>(i)];
    if ((link.parent_joint < 0) != (i == 0)) return {"the first link is not the only root", false};
    if (i == 0) continue;
    const RobotJoint& joint = robot->joints[static_cast<size_t>(link.parent_joint)];
    if (joint.child != i || joint.parent >= i) return {"a joint precedes its parent", false};
  }
  // Mimic chains terminate, and every link has a pose.
  const std::vector<JointValue> values = AllJointValues(*robot, RestValues(*robot));
  if (values.size() != robot->joints.size()) return {"a joint without a value", false};
  if (LinkPoses(*robot, kNoMotion, values).size() != robot->links.size()) {
    return {"a link without a pose", false};
  }
  for (const LinkPair& pair : AdjacentPairs(*robot)) {
    if (pair.first < 0 || pair.first >= pair.second || pair.second >= links) {
      return {"an adjacent pair does not consist of links", false};
    }
  }
  return {"", true};
}

const Robot& SmallRobot() {
  static const auto* const kRobot = new Robot(*ParseUrdf(
      "<robot name='r'><link name='a'/><link name='b'/><joint name='j' type='continuous'>"
      "<parent link='a'/><child link='b'/></joint></robot>",
      kName));
  return *kRobot;
}

FileVerdict CheckSrdf(std::string_view content) {
  const auto pairs = ParseDisabledPairs(std::string(content), kName, SmallRobot());
  if (!pairs.ok()) return {CheckRefusal(pairs.status()), false};
  return {"", true};
}

FileVerdict CheckJoints(std::string_view content) {
  ByteSource source(OpenInMemory(content), kName);
  auto reader = WaypointReader::Open(&source, SmallRobot());
  if (!reader.ok()) return {CheckRefusal(reader.status()), false};
  for (std::vector<double> values;;) {
    const auto more = reader->Next(&values);
    if (!more.ok()) return {CheckRefusal(more.status()), false};
    if (!*more) return {"", true};
    if (values.size() != 1 || !AreFinite(values)) return {"a value that is not finite", false};
  }
}

}  // namespace

FileVerdict CheckFile(FileKind kind, std::string_view content) {
  if (const PointReader reader = ReaderOf(kind); reader != nullptr) {
    return CheckPoints(reader, content);
  }
  switch (kind) {
    case FileKind::kObjMesh:
      return CheckMesh(ReadObjMesh, content);
    case FileKind::kOffMesh:
      return CheckMesh(ReadOffMesh, content);
    case FileKind::kPlyMesh:
      return CheckMesh(ReadPlyMesh, content);
    case FileKind::kStlMesh:
      return CheckMesh(MeshOfParts<ReadStlParts>, content);
    case FileKind::kGltfMesh:
      return CheckMesh(MeshOfParts<ReadGltfParts>, content);
    case FileKind::kDaeMesh:
      return CheckMesh(MeshOfParts<ReadDaeParts>, content);
    case FileKind::kBatch:
    case FileKind::kYamlScene:
      return CheckScene(content);
    case FileKind::kUrdf:
      return CheckUrdf(content);
    case FileKind::kSrdf:
      return CheckSrdf(content);
    case FileKind::kJoints:
      return CheckJoints(content);
    case FileKind::kAnswerJson:
      return CheckAnswer(content);
    case FileKind::kStreamJson: {
      v1::CollisionStreamOpen message;
      return CheckJson(content, &message);
    }
    default: {
      v1::FindCollisionsRequest message;
      return CheckJson(content, &message);
    }
  }
}

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
      {FileKind::kXyz, "1 2 3\n4\t5 6 255 0 0\n\n# c\n-0 1e308 5e-324\n"},
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
      {FileKind::kXyz, "1,2,3\n4, 5, 6,7\n8;9;10\n"},
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

namespace {

// Returns the positions of all pieces of a kind: lines, runs of digits, aligned words, or tags with
// the text after them.
std::vector<std::pair<size_t, size_t>> Pieces(const std::string& content, size_t kind) {
  std::vector<std::pair<size_t, size_t>> pieces;
  for (size_t at = 0; at < content.size();) {
    size_t end = at + 1;
    if (kind == 0) {
      end = std::min(content.find('\n', at), content.size() - 1) + 1;
    } else if (kind == 3) {
      end = std::min(content.find('<', end), content.size());
    } else if (kind == 1) {
      while (end < content.size() && (content[at] >= '0' && content[at] <= '9') &&
             content[end] >= '0' && content[end] <= '9') {
        ++end;
      }
    } else {
      end = std::min(at + 4, content.size());
    }
    if (kind != 1 || (content[at] >= '0' && content[at] <= '9')) pieces.emplace_back(at, end - at);
    at = end;
  }
  return pieces;
}

}  // namespace

void ChangeStructure(const std::function<size_t(size_t)>& next, std::string* content) {
  static const auto* const kLimits =
      new std::vector<std::string>{"0",          "1",          "2",
                                   "3",          "255",        "65536",
                                   "4294967295", "4294967296", "18446744073709551615",
                                   "-1",         "1e999",      "1e-999",
                                   "nan"};
  constexpr uint32_t kWords[] = {0, 1, 2, 0xffffffff, 0x7fffffff, 0x80000000, 0x7f800000, 50, 84};
  const size_t kind = next(content->find('<') == std::string::npos ? 3 : 4);
  const auto pieces = Pieces(*content, kind);
  if (pieces.empty()) return;
  const auto [at, size] = pieces[next(pieces.size())];
  const auto [other, other_size] = pieces[next(pieces.size())];
  const std::string piece = content->substr(at, size);
  switch (next(5)) {
    case 0: {
      std::string swapped = content->substr(other, other_size);
      content->replace(std::max(at, other), at > other ? size : other_size,
                       at > other ? swapped : piece);
      if (at != other) {
        content->replace(std::min(at, other), at > other ? other_size : size,
                         at > other ? piece : swapped);
      }
      return;
    }
    case 1:
      content->insert(other, piece);
      return;
    case 2:
      content->erase(at, size);
      return;
    case 3:
      content->resize(at);
      return;
    default:
      if (kind == 1) {
        content->replace(at, size, (*kLimits)[next(kLimits->size())]);
      } else if (kind == 2 && size == 4) {
        std::memcpy(content->data() + at, &kWords[next(std::size(kWords))], 4);
      } else {
        content->insert(at + size, piece);
      }
  }
}

const std::vector<std::string>& FileTokens() {
  static const auto* const kTokens = new std::vector<std::string>{"nan",
                                                                  "1.#INF",
                                                                  "\"skin\":0,",
                                                                  "\"weights\":[1],",
                                                                  "\"JOINTS_0\":0,",
                                                                  "-inf",
                                                                  "1e308",
                                                                  "1e309",
                                                                  "-0",
                                                                  "5e-324",
                                                                  "0x1p3",
                                                                  "1,5",
                                                                  "\xef\xbb\xbf",
                                                                  "\r",
                                                                  "\r\n",
                                                                  "\\\n",
                                                                  "18446744073709551615",
                                                                  "4294967296",
                                                                  "-1",
                                                                  "#",
                                                                  "\"",
                                                                  ";",
                                                                  "\t",
                                                                  "element vertex 9\n",
                                                                  "property list uint double l\n",
                                                                  "property float x\n",
                                                                  "end_header\n",
                                                                  "format binary_big_endian 1.0\n",
                                                                  "DATA binary\n",
                                                                  "DATA binary_compressed\n",
                                                                  "type=\"planar\"",
                                                                  "type=\"floating\"",
                                                                  "POINTS 3\n",
                                                                  "COUNT 4000000000 1 1\n",
                                                                  "SIZE 8 8 8\n",
                                                                  "TYPE U F I\n",
                                                                  "f 1 2 3\n",
                                                                  "v 1 2\n",
                                                                  "f -9\n",
                                                                  "OFF\n",
                                                                  "STCOFF\n",
                                                                  "all\n",
                                                                  "place: {a: {id: b}}\n",
                                                                  "place a b 1 2\n",
                                                                  "ask: {pairs: [[a, a]]}\n",
                                                                  "{",
                                                                  "[",
                                                                  "}",
                                                                  "]",
                                                                  "\"NaN\"",
                                                                  "null",
                                                                  "\\u0000",
                                                                  "\\ud800",
                                                                  "\"hullId\":",
                                                                  "&a ",
                                                                  "*a",
                                                                  "<<: *p\n",
                                                                  "place: ",
                                                                  "  - ",
                                                                  "<link name=\"z\"/>",
                                                                  "<instance_node url=\"#m\"/>",
                                                                  "<instance_geometry url=\"#g\"/>",
                                                                  "<rotate>0 1 0 90</rotate>",
                                                                  "<polygons><ph><p>0 1 2</p>",
                                                                  "<h>0 1 2</h></ph></polygons>",
                                                                  "<!DOCTYPE a [<!ENTITY b 'c'>]>",
                                                                  "]]>",
                                                                  "<robot",
                                                                  "</",
                                                                  "/>",
                                                                  "<!--",
                                                                  "<![CDATA[",
                                                                  "&lt;",
                                                                  "&#x0;",
                                                                  "mimic joint=\"j\"",
                                                                  "x,y,z\n",
                                                                  std::string(1, '\0'),
                                                                  std::string(300, '1'),
                                                                  std::string(120, '[')};
  return *kTokens;
}

}  // namespace hulld::fuzz
