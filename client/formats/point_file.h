#ifndef HULLD_CLIENT_FORMATS_POINT_FILE_H_
#define HULLD_CLIENT_FORMATS_POINT_FILE_H_

#include <absl/status/statusor.h>

#include <functional>
#include <string>
#include <vector>

#include "client/formats/byte_source.h"
#include "client/formats/point_collector.h"

namespace hulld {

enum class PointFormat { kObj, kOff, kPly, kXyz, kCsv, kPcd, kLas, kStl, kGltf, kDae };

// Returns the values of --format: "obj" and so on.
const std::vector<std::string>& PointFormatNames();
absl::StatusOr<PointFormat> PointFormatFromName(const std::string& name);
// Returns the format by extension, ignoring case. INVALID_ARGUMENT if it is unknown.
absl::StatusOr<PointFormat> PointFormatOfPath(const std::string& path);

// Returns true if ReadMesh (mesh_file.h) can read triangles of the format.
bool IsMeshFormat(PointFormat format);

// Reads the points of a file and passes them to `receive` in blocks, in file order, up to the first
// error. Text is rounded to the nearest double; binary scalars are kept unchanged.
//
// INVALID_ARGUMENT: the file is defective, or contains no points. The message names the file and,
// for a defect, the line or byte. Errors of `receive` are returned unchanged.
//
// Points by format: obj: each `v` (weights and colors are ignored); off, ply, pcd, las: each
// vertex; xyz, csv: the columns that the header names x, y, and z, or the first three; stl: each
// corner of each triangle; gltf, dae: each vertex of each mesh, transformed by its node, once per
// node that uses it; vertices of gltf that no index names are omitted. COLLADA (dae) is converted
// to meters using the file's unit, and keeps its axes, as robot descriptions expect: up_axis is
// ignored. Coordinates of a mesh that no node moves are rounded once.
//
// `path` "-" is standard input. `progress`, if set, periodically receives the number of bytes read.
struct ReadRequest {
  std::string path;
  PointFormat format;
  ReadOptions options;
  std::function<void(uint64_t bytes)> progress;
};
absl::StatusOr<ReadCounts> ReadPoints(const ReadRequest& request, const BlockReceiver& receive);

// Returns all points of a file, n x 3. Errors are those of ReadPoints.
absl::StatusOr<std::vector<double>> ReadAllPoints(const ReadRequest& request);

// Readers of the formats. They stop at the first error; the caller flushes the collector.
absl::Status ReadObj(ByteSource* source, PointCollector* points);
absl::Status ReadOff(ByteSource* source, PointCollector* points);
absl::Status ReadPly(ByteSource* source, PointCollector* points);
absl::Status ReadXyz(ByteSource* source, PointCollector* points);
absl::Status ReadCsv(ByteSource* source, PointCollector* points);
absl::Status ReadPcd(ByteSource* source, PointCollector* points);
absl::Status ReadLas(ByteSource* source, PointCollector* points);
absl::Status ReadStl(ByteSource* source, PointCollector* points);
absl::Status ReadGltf(ByteSource* source, PointCollector* points);
absl::Status ReadDae(ByteSource* source, PointCollector* points);

// Parses the first three tokens of `text`, the coordinates of a point on the source's current line,
// and adds the point.
absl::Status AddTextPoint(const ByteSource& source, std::string_view text, PointCollector* points);

}  // namespace hulld

#endif  // HULLD_CLIENT_FORMATS_POINT_FILE_H_
