#include "client/hullctl/command_line/point_input.h"

#include <absl/strings/str_cat.h>
#include <sys/stat.h>

#include <utility>

#include "client/formats/text_number.h"

namespace hulld {

void AddPointInput(Command command, PointInput* input) {
  command.AddTexts("FILE", &input->files, "Files with points; - is standard input").Required();
  command.AddFlag("--skip-nonfinite", &input->skip_nonfinite,
                  "Skip and count points with a coordinate that is NaN or infinite");
  command.AddFlag(
      "--skip-zero", &input->skip_zero,
      "Skip and count points at exactly (0, 0, 0), which depth cameras write for missing data");
  command
      .AddText("--format", &input->format,
               "Format of the files (default: by extension; standard input: xyz)")
      .ValueName("FORMAT")
      .OneOf(PointFormatNames());
  command.AddNumber("--chunk-points", 1, uint64_t{100} << 20,
                    "Points per message (default: about 1 MiB)", &input->chunk_points);
}

std::vector<std::string> SkippedTexts(const ReadCounts& counts) {
  std::vector<std::string> texts;
  if (counts.skipped > 0) {
    texts.push_back(Counted(counts.skipped, "point") + " with NaN or infinity");
  }
  if (counts.zeros > 0) texts.push_back(Counted(counts.zeros, "point") + " at (0, 0, 0)");
  return texts;
}

v1::PointBlock ToProto(const PointChunk& block) {
  v1::PointBlock points;
  points.mutable_xyz()->Add(block.xyz.begin(), block.xyz.end());
  points.mutable_xyz_float()->Add(block.xyz_float.begin(), block.xyz_float.end());
  return points;
}

namespace {

absl::StatusOr<PointFormat> FormatOf(const std::string& path, const std::string& named) {
  if (!named.empty()) return PointFormatFromName(named);
  if (path == "-") return PointFormat::kXyz;
  auto format = PointFormatOfPath(path);
  if (format.ok()) return format;
  return absl::InvalidArgumentError(
      absl::StrCat(format.status().message(), "; or set the format with --format"));
}

}  // namespace

absl::StatusOr<std::vector<ReadRequest>> PlanReads(const PointInput& input, uint64_t* total_bytes) {
  std::vector<ReadRequest> plan;
  *total_bytes = 0;
  bool known = true;
  for (const std::string& path : input.files) {
    struct stat info = {};
    if (path != "-" && stat(path.c_str(), &info) == 0 && S_ISREG(info.st_mode)) {
      *total_bytes += static_cast<uint64_t>(info.st_size);
    } else {
      known = false;
    }
    // A pipe is opened only once: its writer would see it closed.
    if (path != "-" && !S_ISFIFO(info.st_mode)) {
      if (auto source = ByteSource::Open(path); !source.ok()) return source.status();
    }
    const absl::StatusOr<PointFormat> format = FormatOf(path, input.format);
    if (!format.ok()) return format.status();
    ReadRequest request{path, *format, {}, {}};
    request.options.points_per_block = input.chunk_points;
    request.options.skip_nonfinite = input.skip_nonfinite;
    request.options.skip_zero = input.skip_zero;
    plan.push_back(std::move(request));
  }
  if (!known) *total_bytes = 0;
  return plan;
}

}  // namespace hulld
