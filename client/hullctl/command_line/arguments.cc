#include "client/hullctl/command_line/arguments.h"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_split.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "client/base/status_macros.h"
#include "client/formats/text_number.h"
#include "client/packed_placements.h"
#include "client/pose/rigid_pose.h"

namespace hulld {
namespace {

absl::StatusOr<std::vector<double>> ParseNumbers(const std::string& text) {
  std::vector<double> numbers;
  for (const std::string& cell : std::vector<std::string>(absl::StrSplit(text, ','))) {
    const std::string_view part = Trim(cell);
    const auto number = ParseFinite(part);
    if (!number.ok()) {
      const bool has_blanks = part.find_first_of(" \t") != std::string_view::npos;
      return absl::InvalidArgumentError(
          absl::StrCat(number.status().message(),
                       has_blanks ? "; separate numbers with commas, as in 1,0,0" : ""));
    }
    numbers.push_back(*number);
  }
  return numbers;
}

}  // namespace

absl::StatusOr<std::chrono::milliseconds> ParseDuration(const std::string& text) {
  struct Unit {
    std::string_view name;
    double milliseconds;
  };
  static constexpr Unit kUnits[] = {{"ms", 1}, {"s", 1e3}, {"m", 6e4}, {"h", 3.6e6}, {"", 1e3}};
  constexpr double kDay = 24 * 3.6e6;
  for (const Unit& unit : kUnits) {
    std::string_view number = text;
    if (!number.ends_with(unit.name)) continue;
    number.remove_suffix(unit.name.size());
    double value = 0;
    if (ParseDouble(number, &value) != NumberText::kNumber) continue;
    const double milliseconds = value * unit.milliseconds;
    if (!(milliseconds >= 1 && milliseconds <= kDay)) break;
    return std::chrono::milliseconds(std::llround(milliseconds));
  }
  return absl::InvalidArgumentError(
      absl::StrCat(Quoted(text), " is not a time from 1ms to 24h, such as 500ms, 30s or 2m"));
}

absl::StatusOr<std::array<double, 3>> ParseTriple(const std::string& text) {
  HULLD_ASSIGN_OR_RETURN(std::vector<double> numbers, ParseNumbers(text));
  if (numbers.size() != 3) {
    return absl::InvalidArgumentError(
        absl::StrCat(Quoted(text), " is not three comma-separated numbers x,y,z"));
  }
  return std::array<double, 3>{numbers[0], numbers[1], numbers[2]};
}

absl::StatusOr<v1::Pose> ParsePose(const std::string& text) {
  HULLD_ASSIGN_OR_RETURN(const auto numbers, ParseNumbers(text));
  if (numbers.size() != 3 && numbers.size() != 7) {
    return absl::InvalidArgumentError(absl::StrCat(
        "a pose has 3 comma-separated numbers, x,y,z, or 7, w,x,y,z,x,y,z; got ", numbers.size()));
  }
  RigidPose all = kNoMotion;
  std::copy(numbers.begin(), numbers.end(), all.end() - numbers.size());
  if (std::all_of(all.begin(), all.begin() + 4, [](double number) { return number == 0; })) {
    return absl::InvalidArgumentError(
        "the quaternion w,x,y,z is zero; use 1,0,0,0 for no rotation");
  }
  v1::Pose pose = PoseOf(all);
  if (numbers.size() == 3) pose.clear_rotation();
  return pose;
}

void SetMotion(const v1::Pose& end, v1::Placement* placement) {
  const RigidPose start = NumbersOf(placement->pose());
  RigidPose numbers = NumbersOf(end);
  if (!end.has_rotation()) std::copy_n(start.begin(), 4, numbers.begin());
  *placement->mutable_end_pose() = PoseOf(OnShorterPath(start, numbers));
}

}  // namespace hulld
