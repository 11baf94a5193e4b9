#ifndef HULLD_CLIENT_ROBOT_PACKAGE_PATH_H_
#define HULLD_CLIENT_ROBOT_PACKAGE_PATH_H_

#include <absl/status/statusor.h>

#include <map>
#include <string>
#include <vector>

namespace hulld {

// Where the files that a robot description names are.
struct PackagePaths {
  // The description; its folder and those above it are searched, and relative names start there.
  std::string description;
  // Packages that were named: name to folder.
  std::map<std::string, std::string> named;
  // Folders of packages, as in ROS_PACKAGE_PATH, and prefixes with a share/ of packages, as in
  // AMENT_PREFIX_PATH.
  std::vector<std::string> ros_package_path;
  std::vector<std::string> ament_prefix_path;
};

// "a:b" in parts, without empty ones.
std::vector<std::string> SplitPath(const std::string& path);

// The file that `name` stands for: package://PACKAGE/FILE, model://PACKAGE/FILE, file://FILE, or a
// path, which is relative to the description's folder. A package is, the first that there is:
//   1. the folder that it was named with;
//   2. DIR/PACKAGE, or DIR where it is called PACKAGE, for each DIR of ROS_PACKAGE_PATH, and
//      packages at most three folders below it;
//   3. DIR/share/PACKAGE for each DIR of AMENT_PREFIX_PATH;
//   4. the nearest folder above the description that is called PACKAGE or holds one.
// A folder that lacks the file is passed over. NOT_FOUND lists where it was looked for.
absl::StatusOr<std::string> ResolveFile(const PackagePaths& paths, const std::string& name);

}  // namespace hulld

#endif  // HULLD_CLIENT_ROBOT_PACKAGE_PATH_H_
