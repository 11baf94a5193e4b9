#ifndef HULLD_CLIENT_FORMATS_POINT_FILE_H_
#define HULLD_CLIENT_FORMATS_POINT_FILE_H_

#include <absl/status/statusor.h>

#include <functional>
#include <string>
#include <vector>

#include "client/formats/byte_source.h"
#include "client/formats/point_collector.h"

namespace hulld {

enum class PointFormat { kObj, kOff, kPly, kXyz, kCsv, kPcd, kStl, kGltf, kDae };

// "obj" and so on, as --format takes them.
const std::vector<std::string>& PointFormatNames();
absl::StatusOr<PointFormat> PointFormatFromName(const std::string& name);
// By the extension, in any case. INVALID_ARGUMENT when it is unknown.
absl::StatusOr<PointFormat> PointFormatOfPath(const std::string& path);

// Whether ReadMesh (mesh_file.h) reads triangles of it.
bool IsMeshFormat(PointFormat format);
// Whether it is read through assimp, which needs a file that has a name.
bool IsAssimpFormat(PointFormat format);

// Reads the points of one file and passes them on in blocks, in the file's order, as they are
// found; blocks before an error were passed on. Text becomes the nearest double, binary scalars are
// taken as they are. Errors of the file are INVALID_ARGUMENT and name file and line, or file and
// byte; errors of `receive` are returned as they are.
//
// What counts as a point: obj: each `v` (weights and colours are ignored); off, ply, pcd: each
// vertex; xyz: the first three columns; csv: the columns x, y and z; stl: each corner of each
// triangle; gltf, dae: each vertex of each mesh, moved as its node says, once per node that shows
// it. COLLADA (dae) comes in metres, by the file's own unit, and with its axes as they are, as
// robot descriptions expect it: its up_axis turns nothing.
//
// `path` "-" is standard input, which stl, gltf and dae refuse. `progress`, when set, is told the
// bytes read now and then.
struct ReadRequest {
  std::string path;
  PointFormat format;
  ReadOptions options;
  std::function<void(uint64_t bytes)> progress;
};
absl::StatusOr<ReadCounts> ReadPoints(const ReadRequest& request, const BlockReceiver& receive);

// The readers of each format. They stop at the first error; the caller flushes the collector.
absl::Status ReadObj(ByteSource* source, PointCollector* points);
absl::Status ReadOff(ByteSource* source, PointCollector* points);
absl::Status ReadPly(ByteSource* source, PointCollector* points);
absl::Status ReadXyz(ByteSource* source, PointCollector* points);
absl::Status ReadCsv(ByteSource* source, PointCollector* points);
absl::Status ReadPcd(ByteSource* source, PointCollector* points);
absl::Status ReadStl(const std::string& path, PointCollector* points);
absl::Status ReadGltf(const std::string& path, PointCollector* points);
absl::Status ReadDae(const std::string& path, PointCollector* points);

// Parses the first three tokens of `text`, the coordinates of a point that is on the source's
// present line, and adds it.
absl::Status AddTextPoint(const ByteSource& source, std::string_view text, PointCollector* points);

}  // namespace hulld

#endif  // HULLD_CLIENT_FORMATS_POINT_FILE_H_
