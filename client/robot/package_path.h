#ifndef HULLD_CLIENT_ROBOT_PACKAGE_PATH_H_
#define HULLD_CLIENT_ROBOT_PACKAGE_PATH_H_

#include <absl/status/statusor.h>

#include <map>
#include <string>
#include <vector>

namespace hulld {

// Search paths for the files that a robot description names.
struct PackagePaths {
  // Path of the description. Its folder and the folders above it are searched; relative names start
  // there.
  std::string description;
  // Explicitly given packages: name to folder.
  std::map<std::string, std::string> named;
  // Folders of packages, as in ROS_PACKAGE_PATH, and prefixes with a share/ folder of packages, as
  // in AMENT_PREFIX_PATH.
  std::vector<std::string> ros_package_path;
  std::vector<std::string> ament_prefix_path;
};

// Splits "a:b" at colons; drops empty parts.
std::vector<std::string> SplitPath(const std::string& path);

// Resolves `name`: package://PACKAGE/FILE, model://PACKAGE/FILE, file://FILE, or a path relative to
// the description's folder. If no file has the name, its escapes such as %20 are decoded. A package
// is the first existing folder of:
//   1. the folder given for its name;
//   2. DIR/PACKAGE, or DIR itself if named PACKAGE, for each DIR of ROS_PACKAGE_PATH, and
//      packages at most three folders below it;
//   3. DIR/share/PACKAGE for each DIR of AMENT_PREFIX_PATH;
//   4. the nearest folder above the description that is named PACKAGE or contains one.
// Folders without the file are skipped. NOT_FOUND lists the searched paths.
absl::StatusOr<std::string> ResolveFile(const PackagePaths& paths, const std::string& name);

}  // namespace hulld

#endif  // HULLD_CLIENT_ROBOT_PACKAGE_PATH_H_
