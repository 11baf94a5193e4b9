#ifndef HULLD_CLIENT_HULLCTL_PAIRS_JUDGED_TABLE_H_
#define HULLD_CLIENT_HULLCTL_PAIRS_JUDGED_TABLE_H_

#include <absl/status/statusor.h>

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "client/hullctl/printing/answer_row.h"
#include "hulld/v1/collision.pb.h"

namespace hulld {

// An answer from another program.
struct JudgedAnswer {
  uint64_t line = 0;
  // IDs of hulls or bodies, or files with points.
  std::array<std::string, 2> names;
  // Quaternion w x y z, translation x y z.
  std::array<std::array<double, 7>, 2> poses;
  // True if the pair moves; then its poses at the end.
  bool moves = false;
  std::array<std::array<double, 7>, 2> end_poses;
  // The parts of the answer that the program gave. `colliding` is for programs that do not
  // distinguish TOUCHING from OVERLAPPING.
  std::optional<bool> colliding;
  std::optional<v1::Relation> relation;
  std::optional<double> distance;
  std::optional<double> depth;
  // Time at which a moving pair meets, from 0 to 1.
  std::optional<double> contact_time;
  // Duration of the call of the other program, in microseconds.
  std::optional<double> microseconds;
};

// Reads a table: a header of column names, then a row for each answer, separated by commas,
// semicolons, tabs, or spaces. Columns: a and b; for each of them a pose, as in a_x a_y a_z a_qw
// a_qx a_qy a_qz (default: identity), and the pose at the end of a motion, as in a_to_x (default:
// the pose); and at least one of relation, colliding, distance, depth, and contact_time, with empty
// cells for answers that are not given. `ignored` receives the names of all other columns except
// `us`. INVALID_ARGUMENT names the line and the column.
absl::StatusOr<std::vector<JudgedAnswer>> ReadJudgedTable(const std::string& path,
                                                          std::vector<std::string>* ignored);

enum class Fault {
  // Separated hulls are reported as colliding.
  kFalseContact,
  // Overlapping hulls are reported as separated.
  kMiss,
  // Touching hulls are reported with another relation, or overlapping hulls as touching.
  kTouching,
  // The distance or the depth is wrong.
  kDistance,
  kDepth,
  // The time of the first contact is wrong.
  kTime,
};
inline constexpr int kFaults = 6;
// "false contact" and so on.
const char* FaultName(Fault fault);

struct Judgement {
  std::vector<Fault> faults;
  // The length by which the answer is wrong, or the time for a pair in motion; 0 if only the
  // relation of a touching pair is wrong.
  double error = 0;
  // |answer - separation| of a distance, and of a depth; 0 if the answer has none.
  double distance_error = 0;
  double depth_error = 0;
  // The distance of a contact time from the proven bracket; 0 inside.
  double time_error = 0;
};

// Maximum errors of an answer that is not wrong.
struct Allowed {
  double error = 0;
  double time_error = 0;
};

// Judges an answer by the relation and separation, or the first contact, of `row`. A negative
// distance is minus a depth. A distance or depth is wrong if its error exceeds allowed.error for
// certain, by the proven bound. For a motion, TOUCHING and OVERLAPPING count as the same, and no
// contact counts as a contact at the end. Requires a proven answer: not WITHIN_TOLERANCE.
Judgement Judge(const JudgedAnswer& answer, const AnswerRow& row, const Allowed& allowed);

}  // namespace hulld

#endif  // HULLD_CLIENT_HULLCTL_PAIRS_JUDGED_TABLE_H_
