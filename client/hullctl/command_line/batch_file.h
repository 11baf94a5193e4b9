#ifndef HULLD_CLIENT_HULLCTL_COMMAND_LINE_BATCH_FILE_H_
#define HULLD_CLIENT_HULLCTL_COMMAND_LINE_BATCH_FILE_H_

#include <absl/status/statusor.h>

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "client/formats/byte_source.h"
#include "hulld/v1/collision.pb.h"

namespace hulld {

struct BatchScene {
  // Names and placements, parallel.
  std::vector<std::string> names;
  std::vector<v1::Placement> placements;
  // Indices into placements.
  std::vector<std::pair<uint32_t, uint32_t>> pairs;
};

// What `batch --help` prints.
inline constexpr char kBatchFileHelp[] =
    "FILE is text, one item per line; # starts a comment:\n"
    "  place NAME HULL [[w x y z] tx ty tz]   a hull at a pose (none: as built)\n"
    "  pair NAME NAME                         ask about these two\n"
    "  all                                    ask about each two of all placements\n"
    "Names are free, each for one placement; pairs may come before their placements.\n";

// The most pairs that one file may ask for.
inline constexpr uint64_t kMaxBatchPairs = uint64_t{1} << 24;

// Reads a scene in the format above. INVALID_ARGUMENT "NAME:LINE: message".
absl::StatusOr<BatchScene> ReadBatchFile(ByteSource* source);

}  // namespace hulld

#endif  // HULLD_CLIENT_HULLCTL_COMMAND_LINE_BATCH_FILE_H_
