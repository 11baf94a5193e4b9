#ifndef HULLD_CLIENT_HULLCTL_COMMAND_LINE_POINT_INPUT_H_
#define HULLD_CLIENT_HULLCTL_COMMAND_LINE_POINT_INPUT_H_

#include <absl/status/statusor.h>

#include <cstdint>
#include <string>
#include <vector>

#include "client/formats/point_file.h"
#include "client/hullctl/command_line/command.h"
#include "hulld/v1/geometry.pb.h"

namespace hulld {

// Point files of a command, and read options.
struct PointInput {
  std::vector<std::string> files;
  bool skip_nonfinite = false;
  bool skip_zero = false;
  // Empty: by extension.
  std::string format;
  // 0: about 1 MiB.
  uint64_t chunk_points = 0;
};

// Declares FILE..., --skip-nonfinite, --skip-zero, --format, and --chunk-points. `input` must
// outlive the command.
void AddPointInput(Command command, PointInput* input);

// Returns the numbers of skipped points by reason: "3 points with NaN or infinity", "5 points at
// (0, 0, 0)".
std::vector<std::string> SkippedTexts(const ReadCounts& counts);

// Returns the files to read, in order. Checks that all are readable before anything is sent, so
// that a mistyped name changes nothing. total_bytes: the size of all files, 0 if unknown.
absl::StatusOr<std::vector<ReadRequest>> PlanReads(const PointInput& input, uint64_t* total_bytes);

v1::PointBlock ToProto(const PointChunk& block);

}  // namespace hulld

#endif  // HULLD_CLIENT_HULLCTL_COMMAND_LINE_POINT_INPUT_H_
