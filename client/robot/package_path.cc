#include "client/robot/package_path.h"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_join.h>
#include <absl/strings/str_replace.h>
#include <absl/strings/str_split.h>

#include <algorithm>
#include <filesystem>
#include <optional>
#include <system_error>

#include "client/formats/text_number.h"

namespace hulld {
namespace {

namespace fs = std::filesystem;

constexpr int kPackageDepth = 3;
constexpr size_t kMaxFolders = 10000;

bool IsFile(const fs::path& path) {
  std::error_code ignored;
  return fs::is_regular_file(path, ignored);
}

// Returns the file `folder`/`name`. URIs may contain escapes such as %20, and so may file names.
// Exporters on Windows may write its separator.
std::optional<std::string> FileIn(const fs::path& folder, const std::string& name) {
  for (const std::string& spelled :
       {name, PercentDecoded(name), absl::StrReplaceAll(name, {{"\\", "/"}})}) {
    if (IsFile(folder / spelled)) return (folder / spelled).string();
  }
  return std::nullopt;
}

// Returns the folders named `package` below `folder`, level by level, each level in order of names.
std::vector<fs::path> PackagesBelow(const fs::path& folder, const std::string& package) {
  std::vector<fs::path> found;
  std::vector<fs::path> level = {folder};
  size_t seen = 0;
  for (int depth = 0; depth < kPackageDepth && !level.empty(); ++depth) {
    std::vector<fs::path> next;
    for (const fs::path& at : level) {
      std::error_code failed;
      for (fs::directory_iterator entry(at, failed), end; !failed && entry != end;
           entry.increment(failed)) {
        std::error_code ignored;
        if (!entry->is_directory(ignored) || entry->path().filename().string()[0] == '.') continue;
        if (++seen > kMaxFolders) return found;
        if (entry->path().filename() == package) found.push_back(entry->path());
        next.push_back(entry->path());
      }
    }
    std::sort(next.begin(), next.end());
    level = std::move(next);
  }
  std::stable_sort(found.begin(), found.end());
  return found;
}

// Returns the candidate folders of the package, most likely first.
std::vector<fs::path> FoldersOf(const PackagePaths& paths, const std::string& package) {
  if (const auto named = paths.named.find(package); named != paths.named.end()) {
    return {named->second};
  }
  std::vector<fs::path> folders;
  for (const std::string& entry : paths.ros_package_path) {
    const fs::path folder = fs::path(entry).lexically_normal();
    if (folder.filename() == package) folders.push_back(folder);
    folders.push_back(folder / package);
  }
  for (const std::string& entry : paths.ros_package_path) {
    for (fs::path& folder : PackagesBelow(entry, package)) folders.push_back(std::move(folder));
  }
  for (const std::string& entry : paths.ament_prefix_path) {
    folders.push_back(fs::path(entry) / "share" / package);
  }
  std::error_code failed;
  const fs::path description = fs::absolute(paths.description, failed).lexically_normal();
  for (fs::path folder = description.parent_path(); !folder.empty();
       folder = folder.parent_path()) {
    if (folder.filename() == package) folders.push_back(folder);
    folders.push_back(folder / package);
    if (folder == folder.root_path()) break;
  }
  return folders;
}

}  // namespace

std::vector<std::string> SplitPath(const std::string& path) {
  return absl::StrSplit(path, ':', absl::SkipEmpty());
}

absl::StatusOr<std::string> ResolveFile(const PackagePaths& paths, const std::string& name) {
  std::string rest = name;
  bool in_package = false;
  for (const char* scheme : {"package://", "model://"}) {
    if (name.rfind(scheme, 0) != 0) continue;
    rest = name.substr(std::string(scheme).size());
    in_package = true;
  }
  // Exporters write no name for the package of the description itself.
  const bool has_name = in_package && (rest.empty() || rest[0] != '/');
  if (!has_name) {
    if (in_package) rest = rest.substr(1);
    for (const std::string scheme : {"file://localhost/", "file:///", "file://", "file:"}) {
      if (name.rfind(scheme, 0) != 0) continue;
      rest = (scheme.size() > 7 ? "/" : "") + name.substr(scheme.size());
      break;
    }
    // An absolute path replaces the folder.
    const fs::path folder = fs::path(paths.description).parent_path();
    if (auto file = FileIn(folder, rest); file.has_value()) return *file;
    return absl::NotFoundError(absl::StrCat("no such file: ", (folder / rest).string()));
  }
  const size_t slash = rest.find('/');
  const std::string package = rest.substr(0, slash);
  if (package.empty() || slash == std::string::npos || slash + 1 == rest.size()) {
    return absl::NotFoundError(
        absl::StrCat(Quoted(name), " is not a package file; write package://PACKAGE/FILE"));
  }
  std::vector<std::string> tried;
  for (const fs::path& folder : FoldersOf(paths, package)) {
    if (auto file = FileIn(folder, rest.substr(slash + 1)); file.has_value()) return *file;
    if (std::find(tried.begin(), tried.end(), folder.string()) == tried.end()) {
      tried.push_back(folder.string());
    }
  }
  constexpr size_t kMaxNamed = 8;
  const size_t more = tried.size() > kMaxNamed ? tried.size() - kMaxNamed : 0;
  tried.resize(tried.size() - more);
  return absl::NotFoundError(absl::StrCat(
      "no folder of the package ", Quoted(package), " contains ", rest.substr(slash + 1),
      "; set its folder with --package ", package, "=DIR (looked in ", absl::StrJoin(tried, ", "),
      more > 0 ? absl::StrCat(" and ", more, " more") : "", ")"));
}

}  // namespace hulld
