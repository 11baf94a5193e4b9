#include "client/robot/joint_file.h"

#include <absl/strings/ascii.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_join.h>

#include <algorithm>

#include "client/base/status_macros.h"
#include "client/formats/text_number.h"

namespace hulld {

namespace {

// Returns the cell without surrounding white space and double quotes.
std::string_view Unquoted(std::string_view cell) {
  cell = Trim(cell);
  const bool is_quoted = cell.size() >= 2 && cell.front() == '"' && cell.back() == '"';
  return is_quoted ? cell.substr(1, cell.size() - 2) : cell;
}

}  // namespace

std::vector<std::string_view> CellsOf(std::string_view line) {
  std::vector<std::string_view> cells;
  line = Trim(line);
  if (line.empty() || line.front() == '#') return cells;
  const size_t separator = line.find_first_of(",;\t");
  if (separator == std::string_view::npos) {
    for (std::string_view cell; !(cell = NextToken(&line)).empty();) {
      cells.push_back(Unquoted(cell));
    }
    return cells;
  }
  const char mark = line[separator];
  for (;;) {
    const size_t end = line.find(mark);
    cells.push_back(Unquoted(line.substr(0, end)));
    if (end == std::string_view::npos) return cells;
    line.remove_prefix(end + 1);
  }
}

namespace {

// Returns the names of variables, separated by commas.
std::string NamesOf(const std::vector<JointVariable>& variables) {
  return absl::StrJoin(variables, ", ", [](std::string* out, const JointVariable& variable) {
    out->append(variable.name);
  });
}

// Returns the index of the variable that a column names.
absl::StatusOr<int> PlaceOf(const Robot& robot, const std::vector<JointVariable>& variables,
                            const std::string& name) {
  const auto variable = std::ranges::find(variables, name, &JointVariable::name);
  if (variable != variables.end()) return static_cast<int>(variable - variables.begin());
  const int joint = robot.FindJoint(name);
  if (joint < 0) {
    return absl::InvalidArgumentError(
        absl::StrCat(Quoted(name),
                     " is not a joint of the robot; joints that can be set: ", NamesOf(variables)));
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
  std::vector<JointVariable> parts = variables;
  std::erase_if(parts, [&](const JointVariable& one) { return one.joint != joint; });
  return absl::InvalidArgumentError(
      absl::StrCat(Quoted(name), " has several values; its columns are ", NamesOf(parts)));
}

// Checks that a table has either all four columns of a quaternion or none, because three numbers do
// not determine the fourth.
absl::Status CheckRotations(const ByteSource& source, const Robot& robot,
                            const std::vector<JointVariable>& variables,
                            const std::vector<int>& columns) {
  std::vector<int> parts(robot.joints.size(), 0);
  for (const int column : columns) {
    if (column < 0) continue;
    const JointVariable& variable = variables[static_cast<size_t>(column)];
    const auto joint = static_cast<size_t>(variable.joint);
    if (robot.joints[joint].kind == JointKind::kFloating && variable.place < 4) ++parts[joint];
  }
  for (size_t j = 0; j < parts.size(); ++j) {
    if (parts[j] % 4 == 0) continue;
    const std::string& name = robot.joints[j].name;
    return source.ErrorAtLine(absl::StrCat("the header has ", parts[j], " of the 4 columns ", name,
                                           "/rot_x, ", name, "/rot_y, ", name, "/rot_z and ", name,
                                           "/rot_w"));
  }
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<WaypointReader> WaypointReader::Open(ByteSource* source, const Robot& robot) {
  WaypointReader reader(source, robot);
  reader.rest_ = RestValues(robot);
  const std::vector<JointVariable> variables = robot.Variables();
  bool names_joint = false;
  for (std::string_view line; source->ReadLine(&line);) {
    for (const std::string_view cell : CellsOf(line)) {
      if (absl::AsciiStrToLower(absl::string_view(cell.data(), cell.size())) == "time") {
        reader.columns_.push_back(-1);
        continue;
      }
      const auto place = PlaceOf(robot, variables, std::string(cell));
      if (!place.ok()) {
        return source->ErrorAtLine(std::string(place.status().message()));
      }
      if (std::ranges::find(reader.columns_, *place) != reader.columns_.end()) {
        return source->ErrorAtLine(Quoted(cell) + " has two columns; remove one");
      }
      reader.columns_.push_back(*place);
      names_joint = true;
    }
    if (!reader.columns_.empty()) break;
  }
  if (!source->status().ok()) return source->status();
  if (!names_joint) {
    return absl::InvalidArgumentError(
        absl::StrCat(source->name(), ": no header with joint names; start the file with one"));
  }
  HULLD_RETURN_IF_ERROR(CheckRotations(*source, robot, variables, reader.columns_));
  return reader;
}

absl::StatusOr<bool> WaypointReader::Next(std::vector<double>* free_values) {
  std::string_view line;
  while (source_->ReadLine(&line)) {
    const std::vector<std::string_view> cells = CellsOf(line);
    if (cells.empty()) continue;
    if (cells.size() != columns_.size()) {
      return source_->ErrorAtLine(absl::StrCat("the header has ",
                                               Counted(columns_.size(), "column"),
                                               ", but this row has ", cells.size()));
    }
    *free_values = rest_;
    for (size_t i = 0; i < cells.size(); ++i) {
      if (columns_[i] < 0) continue;
      const auto value = ParseFinite(cells[i]);
      if (!value.ok()) return source_->ErrorAtLine(std::string(value.status().message()));
      (*free_values)[static_cast<size_t>(columns_[i])] = *value;
    }
    const std::string joint = JointWithoutRotation(*robot_, *free_values);
    if (joint.empty()) return true;
    return source_->ErrorAtLine(
        absl::StrCat("the quaternion of ", joint, " is 0 0 0 0, which is not a rotation"));
  }
  if (!source_->status().ok()) return source_->status();
  return false;
}

}  // namespace hulld
