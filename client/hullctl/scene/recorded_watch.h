#ifndef HULLD_CLIENT_HULLCTL_SCENE_RECORDED_WATCH_H_
#define HULLD_CLIENT_HULLCTL_SCENE_RECORDED_WATCH_H_

#include <absl/status/statusor.h>

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace hulld {

// The output of `hullctl watch --output json`: messages of the contract, one per line.
struct RecordedWatch {
  // Messages in JSON, of one type: WatchCollisionsResponse or WatchHullsResponse.
  std::vector<std::string> messages;
  bool is_of_pairs = false;
  // One more than the highest placement named by an event.
  uint64_t placements = 0;
};

inline constexpr size_t kMaxRecordedMessages = 100'000;

// Reads a recorded watch; "-" is standard input. Omits messages that report nothing but progress.
// INVALID_ARGUMENT names the file and the line.
absl::StatusOr<RecordedWatch> ReadRecordedWatch(const std::string& path);

}  // namespace hulld

#endif  // HULLD_CLIENT_HULLCTL_SCENE_RECORDED_WATCH_H_
