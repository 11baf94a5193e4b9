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

// The files of points that a command reads, and how.
struct PointInput {
  std::vector<std::string> files;
  bool skip_nonfinite = false;
  // Empty: by extension.
  std::string format;
  // 0: about 1 MiB.
  uint64_t chunk_points = 0;
};

// Declares FILE..., --skip-nonfinite, --format and --chunk-points. `input` must outlive the
// command.
void AddPointInput(Command command, PointInput* input);

// The files to read, in order. Checks that they can be read before anything is sent, so that a
// mistyped name changes nothing. total_bytes: the size of all files, 0 when that is not known.
absl::StatusOr<std::vector<ReadRequest>> PlanReads(const PointInput& input, uint64_t* total_bytes);

v1::PointBlock ToProto(const PointBlock& block);

}  // namespace hulld

#endif  // HULLD_CLIENT_HULLCTL_COMMAND_LINE_POINT_INPUT_H_
