#ifndef HULLD_TESTS_SERVER_HARNESS_HISTORY_HULL_SPECIFICATION_H_
#define HULLD_TESTS_SERVER_HARNESS_HISTORY_HULL_SPECIFICATION_H_

#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "tests/server/harness/history/hull_history.h"

namespace hulld::server {

// One hull as the specification (hull.proto) has it, or one body (body.proto), doing one thing at a
// time.
struct SpecifiedHull {
  bool exists = false;
  uint64_t create_revision = 0;
  // The revision of the last change, a deletion included. When not known: a change whose answer was
  // lost gave it a greater one, which the next answer tells.
  uint64_t revision = 0;
  bool revision_known = true;
  bool create_revision_known = true;
  // Whether vertices came since its creation, or a body was put again: until then both revisions
  // are the same.
  bool grown = false;
  PointSet points = 0;
  uint64_t received = 0;
  uint64_t outside = 0;
  uint64_t duplicate = 0;
  std::map<std::string, uint64_t> writers;
  // The hull of each piece of a body.
  std::vector<std::string> pieces;

  uint64_t LastSequence(const std::string& writer) const {
    const auto found = writers.find(writer);
    return found == writers.end() ? 0 : found->second;
  }

  // The same text for the same state.
  std::string Key() const;
};

// Whether the hull may answer an operation so; if it may, `hull` is what it is after that.
// Not for a pair or a batch, nor for what is asked about a body.
bool Step(SpecifiedHull& hull, const Operation& operation);
// The same for these; `find` has the others that the operation names, and those of the pieces of
// the body, by ID.
using FindSpecified = std::function<SpecifiedHull&(const std::string& hull_id)>;
bool StepJoint(SpecifiedHull& hull, const Operation& operation, const FindSpecified& find);
// Whether an operation changes nothing.
bool IsRead(const Operation& operation);

}  // namespace hulld::server

#endif  // HULLD_TESTS_SERVER_HARNESS_HISTORY_HULL_SPECIFICATION_H_
