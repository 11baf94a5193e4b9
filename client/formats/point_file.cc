#include "client/formats/point_file.h"

#include <absl/strings/ascii.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_join.h>

#include <array>
#include <iterator>

#include "client/formats/text_number.h"

namespace hulld {
namespace {

struct FormatName {
  const char* name;
  PointFormat format;
};

// The first name of each format is the listed one.
constexpr FormatName kFormatNames[] = {
    {"obj", PointFormat::kObj}, {"off", PointFormat::kOff},   {"ply", PointFormat::kPly},
    {"xyz", PointFormat::kXyz}, {"csv", PointFormat::kCsv},   {"pcd", PointFormat::kPcd},
    {"stl", PointFormat::kStl}, {"gltf", PointFormat::kGltf}, {"glb", PointFormat::kGltf},
    {"dae", PointFormat::kDae}, {"txt", PointFormat::kXyz},   {"asc", PointFormat::kXyz},
    {"tsv", PointFormat::kCsv}, {"pts", PointFormat::kXyz},   {"las", PointFormat::kLas},
    {"laz", PointFormat::kLas}, {"xyzn", PointFormat::kXyz},  {"xyzrgb", PointFormat::kXyz},
};

using PointReader = absl::Status (*)(ByteSource* source, PointCollector* points);
// In the order of PointFormat.
constexpr PointReader kReaders[] = {ReadObj, ReadOff, ReadPly, ReadXyz,  ReadCsv,
                                    ReadPcd, ReadLas, ReadStl, ReadGltf, ReadDae};
static_assert(std::size(kReaders) == static_cast<size_t>(PointFormat::kDae) + 1);

}  // namespace

const std::vector<std::string>& PointFormatNames() {
  static const auto* const kNames = [] {
    auto* all = new std::vector<std::string>;
    for (const FormatName& entry : kFormatNames) all->push_back(entry.name);
    return all;
  }();
  return *kNames;
}

absl::StatusOr<PointFormat> PointFormatFromName(const std::string& name) {
  for (const FormatName& entry : kFormatNames) {
    if (absl::AsciiStrToLower(name) == entry.name) return entry.format;
  }
  return absl::InvalidArgumentError(absl::StrCat("unknown format ", Quoted(name),
                                                 "; supported formats are ",
                                                 absl::StrJoin(PointFormatNames(), ", ")));
}

absl::StatusOr<PointFormat> PointFormatOfPath(const std::string& path) {
  const size_t slash = path.find_last_of('/');
  const std::string file = slash == std::string::npos ? path : path.substr(slash + 1);
  const size_t dot = file.find_last_of('.');
  if (dot != std::string::npos) {
    if (auto format = PointFormatFromName(file.substr(dot + 1)); format.ok()) return format;
  }
  return absl::InvalidArgumentError(
      absl::StrCat(path, ": unknown file extension; convert or rename the file; supported are ",
                   absl::StrJoin(PointFormatNames(), ", ")));
}

bool IsMeshFormat(PointFormat format) {
  return format == PointFormat::kObj || format == PointFormat::kOff ||
         format == PointFormat::kPly || format == PointFormat::kStl ||
         format == PointFormat::kGltf || format == PointFormat::kDae;
}

absl::StatusOr<ReadCounts> ReadPoints(const ReadRequest& request, const BlockReceiver& receive) {
  const auto source = ByteSource::Open(request.path);
  if (!source.ok()) return source.status();
  (*source)->ReportProgress(request.progress);
  PointCollector points(request.options, receive);
  absl::Status status = (*source)->CheckStart();
  if (status.ok()) status = kReaders[static_cast<size_t>(request.format)](source->get(), &points);
  if (status.ok()) status = points.Flush();
  if (!status.ok()) return status;
  const ReadCounts& counts = points.counts();
  if (request.options.allow_empty || !counts.is_empty()) return counts;
  return absl::InvalidArgumentError(absl::StrCat((*source)->name(), ": contains no points"));
}

absl::StatusOr<std::vector<double>> ReadAllPoints(const ReadRequest& request) {
  std::vector<double> xyz;
  const auto counts = ReadPoints(request, [&xyz](const PointChunk& block) {
    xyz.insert(xyz.end(), block.xyz.begin(), block.xyz.end());
    xyz.insert(xyz.end(), block.xyz_float.begin(), block.xyz_float.end());
    return absl::OkStatus();
  });
  if (!counts.ok()) return counts.status();
  return xyz;
}

absl::Status AddTextPoint(const ByteSource& source, std::string_view text, PointCollector* points) {
  std::array<double, 3> xyz;
  for (size_t i = 0; i < 3; ++i) {
    const std::string_view token = NextToken(&text);
    if (token.empty()) {
      return source.ErrorAtLine(absl::StrCat("a point needs 3 coordinates, got ", i));
    }
    if (const NumberText kind = points->Parse(token, i, &xyz[i]); kind != NumberText::kNumber) {
      return source.ErrorAtLine(NumberProblem(kind, token));
    }
  }
  return points->AddScaled(xyz[0], xyz[1], xyz[2],
                           [&](const std::string& message) { return source.ErrorAtLine(message); });
}

}  // namespace hulld
