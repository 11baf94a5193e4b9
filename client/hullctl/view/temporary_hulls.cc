#include "client/hullctl/view/temporary_hulls.h"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <filesystem>

#include "client/base/status_macros.h"
#include "client/formats/point_file.h"
#include "client/hullctl/body/hull_segment.h"
#include "client/hullctl/command_line/point_input.h"
#include "client/hullctl/view/bridge/random_name.h"

namespace hulld {
namespace {

constexpr size_t kPrefixBytes = 6;

}  // namespace

TemporaryHulls::~TemporaryHulls() {
  // Ignores errors because no caller can handle them, and later runs do not depend on these hulls.
  for (const std::string& id : ids_) static_cast<void>(client_.DeleteHull(id));
}

absl::StatusOr<std::string> TemporaryHulls::AddFile(const std::string& path) {
  HULLD_ASSIGN_OR_RETURN(const auto format, PointFormatOfPath(path));
  ReadRequest request{path, format, {}, {}};
  request.options.skip_nonfinite = true;
  std::string name = std::filesystem::path(path).filename().string();
  for (const std::string& id : ids_) {
    if (id == prefix_ + HullSegment(name)) name = absl::StrCat(ids_.size(), "-", name);
  }
  return Add(name, [&request](const Client::PointSink& sink) {
    return ReadPoints(request, [&sink](const PointChunk& block) { return sink(ToProto(block)); })
        .status();
  });
}

absl::StatusOr<std::string> TemporaryHulls::Add(const std::string& name,
                                                const Client::PointFeed& feed) {
  if (prefix_.empty()) {
    HULLD_ASSIGN_OR_RETURN(const auto random, RandomHex(kPrefixBytes));
    prefix_ = absl::StrCat("view/", random, "/");
  }
  const std::string id = prefix_ + HullSegment(name);
  HULLD_RETURN_IF_ERROR(client_.PutHull(id, feed));
  if (std::find(ids_.begin(), ids_.end(), id) == ids_.end()) ids_.push_back(id);
  return id;
}

}  // namespace hulld
