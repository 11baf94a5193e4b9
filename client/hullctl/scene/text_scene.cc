#include "client/hullctl/scene/text_scene.h"

#include <absl/strings/str_cat.h>

#include <cmath>
#include <utility>

#include "client/formats/text_number.h"
#include "client/hullctl/command_line/arguments.h"

namespace hulld {
namespace {

absl::StatusOr<v1::Pose> PoseOf(const std::vector<std::string_view>& words) {
  std::vector<double> numbers;
  for (const std::string_view word : words) {
    double number = 0;
    const NumberText kind = ParseDouble(word, &number);
    if (kind != NumberText::kNumber) return absl::InvalidArgumentError(NumberProblem(kind, word));
    if (!std::isfinite(number)) {
      return absl::InvalidArgumentError(absl::StrCat(Quoted(word), " is not a finite number"));
    }
    numbers.push_back(number);
  }
  return PoseFromNumbers(numbers);
}

}  // namespace

absl::Status TextSceneReader::ErrorAt(uint64_t line, const std::string& message) const {
  return absl::InvalidArgumentError(absl::StrCat(source_->name(), ":", line, ": ", message));
}

absl::Status TextSceneReader::TakeLine(std::string_view line) {
  std::vector<std::string_view> words;
  std::string_view rest = line.substr(0, line.find('#'));
  for (std::string_view word; !(word = NextToken(&rest)).empty();) words.push_back(word);
  if (words.empty()) return absl::OkStatus();
  if (words[0] == "place") return TakePlacement(words);
  if (words[0] == "pair") {
    if (words.size() != 3) return source_->ErrorAtLine("a pair is: pair NAME NAME");
    if (pairs_.size() >= kMostPairs) {
      return source_->ErrorAtLine(
          absl::StrCat("more than ", kMostPairs, " pairs; ask for them in several files"));
    }
    pairs_.push_back({std::string(words[1]), std::string(words[2]), source_->line()});
    return absl::OkStatus();
  }
  if (words[0] == "all" && words.size() == 1) {
    all_ = true;
    return absl::OkStatus();
  }
  return source_->ErrorAtLine(
      absl::StrCat(Quoted(words[0]), " is no item; items are place, pair and all"));
}

absl::Status TextSceneReader::TakePlacement(const std::vector<std::string_view>& words) {
  if (words.size() < 3) {
    return source_->ErrorAtLine("a placement is: place NAME HULL [[w x y z] tx ty tz]");
  }
  const std::string name(words[1]);
  if (!index_.emplace(name, scene_.size()).second) {
    return source_->ErrorAtLine(absl::StrCat("the name ", Quoted(name), " is taken already"));
  }
  v1::Placement placement;
  placement.set_hull_id(std::string(words[2]));
  if (words.size() > 3) {
    const absl::StatusOr<v1::Pose> pose = PoseOf({words.begin() + 3, words.end()});
    if (!pose.ok()) {
      return source_->ErrorAtLine(
          std::string(pose.status().message().data(), pose.status().message().size()));
    }
    *placement.mutable_pose() = *pose;
  }
  scene_.names.push_back(name);
  *scene_.request.add_placements() = std::move(placement);
  return absl::OkStatus();
}

absl::StatusOr<Scene> TextSceneReader::Finish() {
  std::vector<uint32_t> named;
  for (const NamedPair& pair : pairs_) {
    for (const std::string& name : {pair.a, pair.b}) {
      const auto placed = index_.find(name);
      if (placed == index_.end()) {
        return ErrorAt(pair.line,
                       absl::StrCat(Quoted(name), " is not placed; add: place NAME HULL"));
      }
      named.push_back(placed->second);
    }
  }
  // `all` includes the named pairs.
  if (!all_ && !pairs_.empty()) scene_.pairs = std::move(named);
  return std::move(scene_);
}

}  // namespace hulld
