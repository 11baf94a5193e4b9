#ifndef HULLD_CLIENT_HULLCTL_BODY_HULL_SEGMENT_H_
#define HULLD_CLIENT_HULLCTL_BODY_HULL_SEGMENT_H_

#include <set>
#include <string>

namespace hulld {

// `name` as a segment of a hull's ID: at most 100 bytes of [A-Za-z0-9._-] that start with a letter
// or digit. Any other byte becomes "_", and "x" goes in front where the name starts with neither.
std::string HullSegment(std::string name);

// The same, unlike all in `taken`, to which it is added: "-2", "-3" and so on follow where names
// are alike.
std::string UniqueHullSegment(const std::string& name, std::set<std::string>* taken);

}  // namespace hulld

#endif  // HULLD_CLIENT_HULLCTL_BODY_HULL_SEGMENT_H_
