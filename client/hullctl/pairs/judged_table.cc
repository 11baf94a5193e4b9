#include "client/hullctl/pairs/judged_table.h"

#include <absl/strings/ascii.h>
#include <absl/strings/str_cat.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <string_view>
#include <utility>

#include "client/base/status_macros.h"
#include "client/formats/byte_source.h"
#include "client/formats/text_number.h"
#include "client/pose/rigid_pose.h"
#include "client/robot/joint_file.h"

namespace hulld {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

absl::StatusOr<double> NumberOf(std::string_view cell) {
  double number = 0;
  const NumberText kind = ParseDouble(cell, &number);
  if (kind != NumberText::kNumber) return absl::InvalidArgumentError(NumberProblem(kind, cell));
  if (std::isnan(number)) {
    return absl::InvalidArgumentError("nan is not an answer; leave the cell empty");
  }
  return number;
}

absl::Status ReadFinite(std::string_view cell, double* number) {
  HULLD_ASSIGN_OR_RETURN(const auto read, NumberOf(cell));
  if (std::isinf(read))
    return absl::InvalidArgumentError(absl::StrCat(std::string(cell), " is not finite"));
  *number = read;
  return absl::OkStatus();
}

absl::Status ReadName(std::string_view cell, std::string* name) {
  *name = cell;
  return absl::OkStatus();
}

absl::Status ReadRelation(std::string_view cell, std::optional<v1::Relation>* relation) {
  for (const v1::Relation one :
       {v1::RELATION_SEPARATED, v1::RELATION_TOUCHING, v1::RELATION_OVERLAPPING}) {
    const std::string name = v1::Relation_Name(one).substr(std::string_view("RELATION_").size());
    if (absl::AsciiStrToUpper(std::string(cell)) != name) continue;
    *relation = one;
    return absl::OkStatus();
  }
  return absl::InvalidArgumentError(
      absl::StrCat(Quoted(cell), " is not one of SEPARATED, TOUCHING, OVERLAPPING"));
}

absl::Status ReadColliding(std::string_view cell, std::optional<bool>* colliding) {
  const std::string word = absl::AsciiStrToLower(std::string(cell));
  const bool is_true = word == "1" || word == "true";
  if (!is_true && word != "0" && word != "false") {
    return absl::InvalidArgumentError(
        absl::StrCat(Quoted(cell), " is not one of 0, 1, false, true"));
  }
  *colliding = is_true;
  return absl::OkStatus();
}

absl::Status ReadDistance(std::string_view cell, std::optional<double>* distance) {
  const auto read = NumberOf(cell);
  if (read.ok()) *distance = *read;
  return read.status();
}

// Reads a number from 0 to `max`, called `what`.
absl::Status ReadUpTo(double max, const char* what, std::string_view cell,
                      std::optional<double>* value) {
  HULLD_ASSIGN_OR_RETURN(const auto read, NumberOf(cell));
  if (read < 0 || read > max) {
    return absl::InvalidArgumentError(
        absl::StrCat(std::string(cell), " is not a ", what, "; leave the cell empty"));
  }
  *value = read;
  return absl::OkStatus();
}

using EndCells = std::array<std::array<std::optional<double>, 7>, 2>;

// Reads a cell into its field. Empty cells are not read.
using CellReader =
    std::function<absl::Status(std::string_view cell, JudgedAnswer* answer, EndCells* ends)>;

std::map<std::string, CellReader, std::less<>> MakeReaders() {
  std::map<std::string, CellReader, std::less<>> readers;
  constexpr const char* kPoseColumns[] = {"_qw", "_qx", "_qy", "_qz", "_x", "_y", "_z"};
  for (const size_t side : {size_t{0}, size_t{1}}) {
    const std::string name = side == 0 ? "a" : "b";
    readers[name] = [side](std::string_view cell, JudgedAnswer* answer, EndCells*) {
      return ReadName(cell, &answer->names[side]);
    };
    for (size_t i = 0; i < 7; ++i) {
      readers[name + kPoseColumns[i]] = [side, i](std::string_view cell, JudgedAnswer* answer,
                                                  EndCells*) {
        return ReadFinite(cell, &answer->poses[side][i]);
      };
      readers[name + "_to" + kPoseColumns[i]] = [side, i](std::string_view cell, JudgedAnswer*,
                                                          EndCells* ends) {
        return ReadFinite(cell, &(*ends)[side][i].emplace());
      };
    }
  }
  readers["relation"] = [](std::string_view cell, JudgedAnswer* answer, EndCells*) {
    return ReadRelation(cell, &answer->relation);
  };
  readers["colliding"] = [](std::string_view cell, JudgedAnswer* answer, EndCells*) {
    return ReadColliding(cell, &answer->colliding);
  };
  readers["distance"] = [](std::string_view cell, JudgedAnswer* answer, EndCells*) {
    return ReadDistance(cell, &answer->distance);
  };
  readers["depth"] = [](std::string_view cell, JudgedAnswer* answer, EndCells*) {
    return ReadUpTo(kInfinity, "depth, a length of at least 0", cell, &answer->depth);
  };
  readers["contact_time"] = [](std::string_view cell, JudgedAnswer* answer, EndCells*) {
    return ReadUpTo(1, "time from 0 to 1", cell, &answer->contact_time);
  };
  readers["us"] = [](std::string_view cell, JudgedAnswer* answer, EndCells*) {
    return ReadUpTo(kInfinity, "duration of at least 0", cell, &answer->microseconds);
  };
  return readers;
}

// Reads the rows of a table whose header was read.
class TableReader {
 public:
  // INVALID_ARGUMENT: a column is missing or repeated.
  absl::Status ReadHeader(const std::vector<std::string_view>& cells,
                          std::vector<std::string>* ignored) {
    static const auto* const kReaders = new auto(MakeReaders());
    for (const std::string_view cell : cells) {
      const std::string name = absl::AsciiStrToLower(std::string(cell));
      if (std::find(columns_.begin(), columns_.end(), name) != columns_.end()) {
        return absl::InvalidArgumentError(
            absl::StrCat("the header names ", Quoted(name), " twice"));
      }
      columns_.push_back(name);
      const auto reader = kReaders->find(name);
      readers_.push_back(reader == kReaders->end() ? nullptr : &reader->second);
      if (readers_.back() == nullptr) ignored->push_back(name);
    }
    for (const char* name : {"a", "b"}) {
      if (!Has(name)) {
        return absl::InvalidArgumentError(absl::StrCat(
            "the header has no column ", name, "; it must contain an ID or a file in each row"));
      }
      for (const std::string& first : {absl::StrCat(name, "_q"), absl::StrCat(name, "_to_q")}) {
        const auto given = std::count_if(columns_.begin(), columns_.end(), [&](const auto& column) {
          return column.size() == first.size() + 1 && column.starts_with(first);
        });
        if (given == 0 || given == 4) continue;
        return absl::InvalidArgumentError(absl::StrCat("a quaternion has four columns: ", first,
                                                       "w ", first, "x ", first, "y ", first, "z"));
      }
    }
    for (const char* name : {"relation", "colliding", "distance", "depth", "contact_time"}) {
      if (Has(name)) return absl::OkStatus();
    }
    return absl::InvalidArgumentError(
        "the header has no column with answers; it needs relation, colliding, distance, depth, or "
        "contact_time");
  }

  absl::StatusOr<JudgedAnswer> ReadRow(const std::vector<std::string_view>& cells) const {
    if (cells.size() != columns_.size()) {
      return absl::InvalidArgumentError(absl::StrCat(
          "the row has ", cells.size(), " cells, but the header has ", columns_.size()));
    }
    JudgedAnswer answer;
    answer.poses[0] = answer.poses[1] = kNoMotion;
    EndCells ends;
    for (size_t i = 0; i < cells.size(); ++i) {
      if (cells[i].empty() || readers_[i] == nullptr) continue;
      const absl::Status read = (*readers_[i])(cells[i], &answer, &ends);
      if (!read.ok()) {
        return absl::InvalidArgumentError(absl::StrCat(columns_[i], ": ", read.message()));
      }
    }
    for (const size_t side : {size_t{0}, size_t{1}}) {
      const char* const name = side == 0 ? "a" : "b";
      if (answer.names[side].empty()) {
        return absl::InvalidArgumentError(
            absl::StrCat(name, " is empty; it must be an ID or a file"));
      }
      absl::Status rotates = CheckRotation(answer.poses[side], name);
      if (!rotates.ok()) return rotates;
      rotates = SetEnd(ends[side], side, absl::StrCat(name, "_to"), &answer);
      if (!rotates.ok()) return rotates;
    }
    if (answer.moves && (answer.distance || answer.depth)) {
      return absl::InvalidArgumentError(
          "distance and depth apply only to pairs at rest; leave them empty for a motion");
    }
    if (!answer.moves && answer.contact_time) {
      return absl::InvalidArgumentError(
          "contact_time needs a motion: an end pose, as in a_to_x, a_to_y, a_to_z");
    }
    return answer;
  }

 private:
  static absl::Status CheckRotation(const RigidPose& pose, const std::string& name) {
    if (std::any_of(pose.begin(), pose.begin() + 4, [](double part) { return part != 0; })) {
      return absl::OkStatus();
    }
    return absl::InvalidArgumentError(
        absl::StrCat(name, "_qw, ", name, "_qx, ", name, "_qy, ", name,
                     "_qz are all 0; use 1, 0, 0, 0 for no rotation"));
  }

  // Sets the end pose of a side: the pose, with the cells that are given, on the shorter path.
  static absl::Status SetEnd(const std::array<std::optional<double>, 7>& cells, size_t side,
                             const std::string& name, JudgedAnswer* answer) {
    RigidPose end = answer->poses[side];
    for (size_t i = 0; i < cells.size(); ++i) {
      answer->moves = answer->moves || cells[i].has_value();
      end[i] = cells[i].value_or(end[i]);
    }
    HULLD_RETURN_IF_ERROR(CheckRotation(end, name));
    answer->end_poses[side] = OnShorterPath(answer->poses[side], end);
    return absl::OkStatus();
  }

  bool Has(std::string_view name) const {
    return std::find(columns_.begin(), columns_.end(), name) != columns_.end();
  }

  std::vector<std::string> columns_;
  // Null for columns that are ignored.
  std::vector<const CellReader*> readers_;
};

// |claimed - truth|; equal infinities agree.
double Difference(double claimed, double truth) {
  return claimed == truth ? 0 : std::abs(claimed - truth);
}

std::optional<Fault> FaultOfRelation(const JudgedAnswer& answer, v1::Relation truth) {
  const bool touching = truth == v1::RELATION_TOUCHING;
  const bool separated = truth == v1::RELATION_SEPARATED;
  const auto wrong = [&](bool said_contact) {
    return touching                    ? Fault::kTouching
           : separated && said_contact ? Fault::kFalseContact
           : said_contact              ? Fault::kTouching
                                       : Fault::kMiss;
  };
  if (answer.relation && *answer.relation != truth) {
    return wrong(*answer.relation != v1::RELATION_SEPARATED);
  }
  if (answer.colliding && *answer.colliding == separated) return wrong(*answer.colliding);
  return std::nullopt;
}

Judgement JudgeMotion(const JudgedAnswer& answer, const AnswerRow& row, double max_error) {
  Judgement judgement;
  const v1::FirstContact& truth = *row.first_contact;
  const bool touches = truth.has_contact_time();
  // A program may state its answer in several columns; each must be correct.
  const bool claims_contact =
      answer.contact_time || answer.colliding.value_or(false) ||
      answer.relation.value_or(v1::RELATION_SEPARATED) != v1::RELATION_SEPARATED;
  const bool claims_no_contact =
      (answer.colliding && !*answer.colliding) || answer.relation == v1::RELATION_SEPARATED;
  const double said = answer.contact_time.value_or(1);
  // The end of the bracket; 1 without contact.
  const double contact = touches ? truth.contact_time() : 1;
  if (touches ? claims_no_contact : claims_contact) {
    judgement.faults.push_back(touches ? Fault::kMiss : Fault::kFalseContact);
    judgement.error = touches ? 1 - contact : 1 - said;
  }
  if (!touches || !answer.contact_time) return judgement;
  judgement.time_error = std::max({0.0, truth.separated_until() - said, said - contact});
  if (judgement.time_error <= max_error) return judgement;
  judgement.faults.push_back(Fault::kTime);
  judgement.error = std::max(judgement.error, judgement.time_error);
  return judgement;
}

}  // namespace

absl::StatusOr<std::vector<JudgedAnswer>> ReadJudgedTable(const std::string& path,
                                                          std::vector<std::string>* ignored) {
  HULLD_ASSIGN_OR_RETURN(const auto source, ByteSource::Open(path));
  TableReader reader;
  std::vector<JudgedAnswer> answers;
  bool has_header = false;
  std::string_view line;
  while (source->ReadLine(&line)) {
    const std::vector<std::string_view> cells = CellsOf(line);
    if (cells.empty()) continue;
    if (!std::exchange(has_header, true)) {
      const absl::Status read = reader.ReadHeader(cells, ignored);
      if (!read.ok()) return source->ErrorAtLine(std::string(read.message()));
      continue;
    }
    auto answer = reader.ReadRow(cells);
    if (!answer.ok()) return source->ErrorAtLine(std::string(answer.status().message()));
    answer->line = source->line();
    answers.push_back(*std::move(answer));
  }
  HULLD_RETURN_IF_ERROR(source->status());
  if (!answers.empty()) return answers;
  return absl::InvalidArgumentError(absl::StrCat(path, ": the table contains no answers"));
}

const char* FaultName(Fault fault) {
  // In the order of Fault.
  static constexpr const char* kNames[] = {"false contact", "miss",  "touching",
                                           "distance",      "depth", "time"};
  return kNames[static_cast<size_t>(fault)];
}

Judgement Judge(const JudgedAnswer& answer, const AnswerRow& row, const Allowed& allowed) {
  if (answer.moves) return JudgeMotion(answer, row, allowed.time_error);
  Judgement judgement;
  const double separation = row.separation->value();
  if (const std::optional<Fault> fault = FaultOfRelation(answer, row.relation)) {
    judgement.faults.push_back(*fault);
    judgement.error = std::abs(separation);
  }
  const auto judge = [&](double claimed, double truth, Fault fault) {
    const double error = Difference(claimed, truth);
    if (error <= allowed.error + row.separation->bound()) return error;
    judgement.faults.push_back(fault);
    judgement.error = std::max(judgement.error, error);
    return error;
  };
  if (answer.distance) {
    const double truth = *answer.distance < 0 ? separation : std::max(separation, 0.0);
    judgement.distance_error = judge(*answer.distance, truth, Fault::kDistance);
  }
  if (answer.depth) {
    judgement.depth_error = judge(*answer.depth, std::max(-separation, 0.0), Fault::kDepth);
  }
  return judgement;
}

}  // namespace hulld
