#include "tests/fuzz/files/file_check.h"

#include <absl/status/status.h>
#include <absl/strings/str_cat.h>
#include <google/protobuf/message.h>
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

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

}  // namespace hulld::fuzz
