#include "client/hullctl/command_line/arguments.h"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "client/formats/text_number.h"

namespace hulld {
namespace {

absl::StatusOr<std::vector<double>> ParseNumbers(std::string_view text) {
  std::vector<double> numbers;
  for (;;) {
    const size_t comma = text.find(',');
    const std::string_view part = Trim(text.substr(0, comma));
    double number = 0;
    const NumberText kind = ParseDouble(part, &number);
    if (kind != NumberText::kNumber) {
      std::string problem = NumberProblem(kind, part);
      const bool has_blanks = part.find_first_of(" \t") != std::string_view::npos;
      if (has_blanks) problem += "; separate numbers with commas, as in 1,0,0";
      return absl::InvalidArgumentError(std::move(problem));
    }
    if (!std::isfinite(number)) {
      return absl::InvalidArgumentError(absl::StrCat(Quoted(part), " is not a finite number"));
    }
    numbers.push_back(number);
    if (comma == std::string_view::npos) return numbers;
    text.remove_prefix(comma + 1);
  }
}

// Returns the rotation of a pose; the identity if it has none.
v1::Quaternion GivenRotation(const v1::Pose& pose) {
  if (pose.has_rotation()) return pose.rotation();
  v1::Quaternion none;
  none.set_w(1);
  return none;
}

// Makes the largest component 1, so that products do not overflow.
v1::Quaternion Scaled(v1::Quaternion q) {
  const double largest =
      std::max({std::abs(q.w()), std::abs(q.x()), std::abs(q.y()), std::abs(q.z())});
  q.set_w(q.w() / largest);
  q.set_x(q.x() / largest);
  q.set_y(q.y() / largest);
  q.set_z(q.z() / largest);
  return q;
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
    if (number.size() < unit.name.size() ||
        number.substr(number.size() - unit.name.size()) != unit.name) {
      continue;
    }
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
  absl::StatusOr<std::vector<double>> numbers = ParseNumbers(text);
  if (!numbers.ok()) return numbers.status();
  if (numbers->size() != 3) {
    return absl::InvalidArgumentError(
        absl::StrCat(Quoted(text), " is not three comma-separated numbers x,y,z"));
  }
  return std::array<double, 3>{(*numbers)[0], (*numbers)[1], (*numbers)[2]};
}

absl::StatusOr<v1::Pose> PoseFromNumbers(const std::vector<double>& numbers) {
  if (numbers.size() != 3 && numbers.size() != 7) {
    return absl::InvalidArgumentError(absl::StrCat(
        "a pose has 3 comma-separated numbers, x,y,z, or 7, w,x,y,z,x,y,z; got ", numbers.size()));
  }
  v1::Pose pose;
  const double* t = numbers.data();
  if (numbers.size() == 7) {
    v1::Quaternion& q = *pose.mutable_rotation();
    q.set_w(t[0]);
    q.set_x(t[1]);
    q.set_y(t[2]);
    q.set_z(t[3]);
    if (t[0] == 0 && t[1] == 0 && t[2] == 0 && t[3] == 0) {
      return absl::InvalidArgumentError(
          "the quaternion w,x,y,z is zero; use 1,0,0,0 for no rotation");
    }
    t += 4;
  }
  pose.mutable_translation()->set_x(t[0]);
  pose.mutable_translation()->set_y(t[1]);
  pose.mutable_translation()->set_z(t[2]);
  return pose;
}

absl::StatusOr<v1::Pose> ParsePose(const std::string& text) {
  absl::StatusOr<std::vector<double>> numbers = ParseNumbers(text);
  if (!numbers.ok()) return numbers.status();
  return PoseFromNumbers(*numbers);
}

void SetMotion(const v1::Pose& end, v1::Placement* placement) {
  const v1::Quaternion start = GivenRotation(placement->pose());
  v1::Quaternion q = end.has_rotation() ? end.rotation() : start;
  const v1::Quaternion from = Scaled(start);
  const v1::Quaternion to = Scaled(q);
  const bool is_longer =
      from.w() * to.w() + from.x() * to.x() + from.y() * to.y() + from.z() * to.z() < 0;
  if (is_longer) {
    q.set_w(-q.w());
    q.set_x(-q.x());
    q.set_y(-q.y());
    q.set_z(-q.z());
  }
  *placement->mutable_end_pose() = end;
  *placement->mutable_end_pose()->mutable_rotation() = q;
}

}  // namespace hulld
