#ifndef HULLD_CLIENT_HULLCTL_HULLCTL_H_
#define HULLD_CLIENT_HULLCTL_HULLCTL_H_

#include <ostream>
#include <string>
#include <vector>

namespace hulld {

// Runs hullctl with the arguments after its name; returns the exit code.
int RunHullctl(const std::vector<std::string>& arguments, std::ostream& out, std::ostream& err);

}  // namespace hulld

#endif  // HULLD_CLIENT_HULLCTL_HULLCTL_H_
