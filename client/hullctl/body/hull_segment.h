#ifndef HULLD_CLIENT_HULLCTL_BODY_HULL_SEGMENT_H_
#define HULLD_CLIENT_HULLCTL_BODY_HULL_SEGMENT_H_

#include <set>
#include <string>

namespace hulld {

// Returns `name` as a segment of a hull ID: at most 100 bytes of [A-Za-z0-9._-], starting with a
// letter or digit. Any other byte becomes "_"; "x" is prepended if the name starts with neither.
std::string HullSegment(std::string name);

// Returns a segment that differs from all in `taken`, and adds it there: duplicates get the
// suffixes "-2", "-3", and so on.
std::string UniqueHullSegment(const std::string& name, std::set<std::string>* taken);

}  // namespace hulld

#endif  // HULLD_CLIENT_HULLCTL_BODY_HULL_SEGMENT_H_
