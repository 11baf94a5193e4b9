#include "client/robot/joint_file.h"

#include <absl/strings/ascii.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_join.h>

#include <algorithm>
#include <cmath>
#include <string_view>

#include "client/formats/text_number.h"

namespace hulld {
namespace {

// The cells of a line, without quotes and spaces. Empty for a line that says nothing.
std::vector<std::string_view> CellsOf(std::string_view line) {
  std::vector<std::string_view> cells;
  line = Trim(line);
  if (line.empty() || line.front() == '#') return cells;
  const size_t separator = line.find_first_of(",;\t");
  if (separator == std::string_view::npos) {
    for (std::string_view cell; !(cell = NextToken(&line)).empty();) cells.push_back(cell);
    return cells;
  }
  const char mark = line[separator];
  for (;;) {
    const size_t end = line.find(mark);
    std::string_view cell = Trim(line.substr(0, end));
    if (cell.size() >= 2 && cell.front() == '"' && cell.back() == '"') {
      cell = cell.substr(1, cell.size() - 2);
    }
    cells.push_back(cell);
    if (end == std::string_view::npos) return cells;
    line.remove_prefix(end + 1);
  }
}

std::string NamesOf(const Robot& robot, const std::vector<int>& joints) {
  return absl::StrJoin(joints, ", ", [&](std::string* out, int joint) {
    out->append(robot.joints[static_cast<size_t>(joint)].name);
  });
}

// The place of a column's joint among the free ones.
absl::StatusOr<int> PlaceOf(const Robot& robot, const std::vector<int>& free,
                            const std::string& name) {
  const int joint = robot.FindJoint(name);
  if (joint < 0) {
    return absl::InvalidArgumentError(absl::StrCat(
        Quoted(name), " is no joint of the robot; those with a value are ", NamesOf(robot, free)));
  }
  const RobotJoint& found = robot.joints[static_cast<size_t>(joint)];
  if (found.mimics >= 0) {
    return absl::InvalidArgumentError(
        absl::StrCat(Quoted(name), " follows ",
                     robot.joints[static_cast<size_t>(found.mimics)].name, "; leave it out"));
  }
  if (found.kind == JointKind::kFixed) {
    return absl::InvalidArgumentError(absl::StrCat(Quoted(name), " is fixed; leave it out"));
  }
  return static_cast<int>(std::find(free.begin(), free.end(), joint) - free.begin());
}

}  // namespace

absl::StatusOr<WaypointReader> WaypointReader::Open(ByteSource* source, const Robot& robot) {
  WaypointReader reader(source);
  reader.rest_ = RestValues(robot);
  const std::vector<int> free = robot.FreeJoints();
  bool names_joint = false;
  for (std::string_view line; source->ReadLine(&line);) {
    for (const std::string_view cell : CellsOf(line)) {
      if (absl::AsciiStrToLower(absl::string_view(cell.data(), cell.size())) == "time") {
        reader.columns_.push_back(-1);
        continue;
      }
      const auto place = PlaceOf(robot, free, std::string(cell));
      if (!place.ok()) {
        return source->ErrorAtLine(
            std::string(place.status().message().data(), place.status().message().size()));
      }
      if (std::find(reader.columns_.begin(), reader.columns_.end(), *place) !=
          reader.columns_.end()) {
        return source->ErrorAtLine(Quoted(cell) + " has two columns");
      }
      reader.columns_.push_back(*place);
      names_joint = true;
    }
    if (!reader.columns_.empty()) break;
  }
  if (!source->status().ok()) return source->status();
  if (!names_joint) {
    return absl::InvalidArgumentError(
        absl::StrCat(source->name(), ": there is no header that names joints in it"));
  }
  return reader;
}

absl::StatusOr<bool> WaypointReader::Next(std::vector<double>* free_values) {
  std::string_view line;
  while (source_->ReadLine(&line)) {
    const std::vector<std::string_view> cells = CellsOf(line);
    if (cells.empty()) continue;
    if (cells.size() != columns_.size()) {
      return source_->ErrorAtLine(
          absl::StrCat("the header has ", columns_.size(), " columns, this row ", cells.size()));
    }
    *free_values = rest_;
    for (size_t i = 0; i < cells.size(); ++i) {
      if (columns_[i] < 0) continue;
      double* const value = &(*free_values)[static_cast<size_t>(columns_[i])];
      const NumberText kind = ParseDouble(cells[i], value);
      if (kind != NumberText::kNumber) return source_->ErrorAtLine(NumberProblem(kind, cells[i]));
      if (!std::isfinite(*value)) {
        return source_->ErrorAtLine(Quoted(cells[i]) + " is not a finite number");
      }
    }
    return true;
  }
  if (!source_->status().ok()) return source_->status();
  return false;
}

}  // namespace hulld
