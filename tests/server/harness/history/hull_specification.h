#ifndef HULLD_TESTS_SERVER_HARNESS_HISTORY_HULL_SPECIFICATION_H_
#define HULLD_TESTS_SERVER_HARNESS_HISTORY_HULL_SPECIFICATION_H_

#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "tests/server/harness/history/hull_history.h"

namespace hulld::server {

// Sequential specification of a hull (hull.proto) or a body (body.proto).
struct SpecifiedHull {
  bool exists = false;
  uint64_t create_revision = 0;
  // Revision of the last change, including deletion. If unknown, a change with a lost answer raised
  // it, and the next answer reveals it.
  uint64_t revision = 0;
  bool revision_known = true;
  bool create_revision_known = true;
  // True if vertices were added, or the body was put again, since creation. Until then both
  // revisions are equal.
  bool grown = false;
  PointSet points = 0;
  uint64_t received = 0;
  uint64_t outside = 0;
  uint64_t duplicate = 0;
  std::map<std::string, uint64_t> writers;
  // Hull of each piece of a body.
  std::vector<std::string> pieces;

  uint64_t LastSequence(const std::string& writer) const {
    const auto found = writers.find(writer);
    return found == writers.end() ? 0 : found->second;
  }

  // Equal for equal states.
  std::string Key() const;
};

// Applies an operation to `hull`. Returns false if the specification forbids its answer. Not for
// pairs, batches, or queries about a body.
bool Step(SpecifiedHull& hull, const Operation& operation);
// Like Step, but for joint operations. `find` returns the other hulls that the operation names and
// the hulls of the body's pieces, by ID.
using FindSpecified = std::function<SpecifiedHull&(const std::string& hull_id)>;
bool StepJoint(SpecifiedHull& hull, const Operation& operation, const FindSpecified& find);
// Returns true if the operation never changes state.
bool IsRead(const Operation& operation);

}  // namespace hulld::server

#endif  // HULLD_TESTS_SERVER_HARNESS_HISTORY_HULL_SPECIFICATION_H_
