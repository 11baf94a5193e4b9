#ifndef HULLD_CLIENT_HULLCTL_SCENE_TEXT_SCENE_H_
#define HULLD_CLIENT_HULLCTL_SCENE_TEXT_SCENE_H_

#include <absl/status/statusor.h>

#include <cstdint>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

#include "client/formats/byte_source.h"
#include "client/hullctl/scene/scene_file.h"

namespace hulld {

// Reads a scene in the text format of kSceneFileHelp, line by line.
class TextSceneReader {
 public:
  // `source` gives the positions of errors.
  explicit TextSceneReader(const ByteSource* source) : source_(source) {}

  // Takes the line last read from the source.
  absl::Status TakeLine(std::string_view line);
  // Call after the last line.
  absl::StatusOr<Scene> Finish();

 private:
  struct NamedPair {
    std::string a;
    std::string b;
    uint64_t line;
  };

  absl::Status TakePlacement(const std::vector<std::string_view>& words);
  absl::Status ErrorAt(uint64_t line, const std::string& message) const;

  const ByteSource* source_;
  Scene scene_;
  std::unordered_map<std::string, uint32_t> index_;
  std::vector<NamedPair> pairs_;
  // True after the keyword `all`.
  bool all_ = false;
};

}  // namespace hulld

#endif  // HULLD_CLIENT_HULLCTL_SCENE_TEXT_SCENE_H_
