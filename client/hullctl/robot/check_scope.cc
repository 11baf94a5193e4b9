#include "client/hullctl/robot/check_scope.h"

#include <absl/strings/str_cat.h>

#include <utility>

#include "client/formats/text_number.h"

namespace hulld {

CheckScope MakeCheckScope(const RobotModel& model, const Surroundings& around,
                          std::vector<uint32_t> pairs) {
  CheckScope scope;
  scope.parts = static_cast<uint32_t>(model.parts.size());
  scope.fixed_poses = around.poses;
  scope.pairs = std::move(pairs);
  const auto add_id = [&scope](const std::string& id, double radius) {
    scope.hull_of.push_back(static_cast<uint32_t>(scope.hulls.hull_ids_size()));
    scope.hulls.add_hull_ids(id);
    scope.radii.push_back(radius);
  };
  // Either all parts have IDs, or none has. Inline shapes are numbered after all IDs.
  auto next_shape = static_cast<uint32_t>(around.hulls.size());
  for (const RobotPart& part : model.parts) {
    if (!part.hull_id.empty()) {
      add_id(part.hull_id, part.hull.radius);
      continue;
    }
    scope.hull_of.push_back(next_shape++);
    scope.radii.push_back(part.hull.radius);
    scope.hulls.add_shape_sizes(static_cast<uint32_t>(part.hull.xyz.size() / 3));
    scope.hulls.mutable_shape_points()->mutable_xyz()->Add(part.hull.xyz.begin(),
                                                           part.hull.xyz.end());
  }
  for (size_t i = 0; i < around.hulls.size(); ++i) add_id(around.hulls[i], around.radii[i]);
  return scope;
}

absl::Status RemoveIgnored(const std::vector<std::string>& ignored, const RobotModel& model,
                           const std::vector<std::string>& names, std::vector<uint32_t>* pairs) {
  const auto is = [&](uint32_t part, const std::string& name) {
    return names[part] == name ||
           (part < model.parts.size() &&
            model.robot.links[static_cast<size_t>(model.parts[part].link)].name == name);
  };
  for (const std::string& entry : ignored) {
    const size_t comma = entry.find(',');
    const std::string one = entry.substr(0, comma);
    const std::string other = comma == std::string::npos ? "" : entry.substr(comma + 1);
    std::vector<uint32_t> kept;
    for (size_t i = 0; i < pairs->size(); i += 2) {
      const uint32_t a = (*pairs)[i];
      const uint32_t b = (*pairs)[i + 1];
      if ((is(a, one) && is(b, other)) || (is(a, other) && is(b, one))) continue;
      kept.insert(kept.end(), {a, b});
    }
    if (kept.size() == pairs->size()) {
      return absl::InvalidArgumentError(
          absl::StrCat("--ignore: ", Quoted(entry), " is not a checked pair; pass two ",
                       "names of links or placements, such as forearm_link,table"));
    }
    *pairs = std::move(kept);
  }
  return absl::OkStatus();
}

}  // namespace hulld
