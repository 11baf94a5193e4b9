#include "client/robot/urdf_file.h"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <initializer_list>
#include <map>
#include <numeric>
#include <optional>
#include <span>
#include <string_view>
#include <utility>
#include <vector>

#include "client/base/status_macros.h"
#include "client/formats/byte_source.h"
#include "client/formats/text_number.h"
#include "client/robot/xml_document.h"

namespace hulld {
namespace {

constexpr std::pair<const char*, ShapeKind> kShapes[] = {{"box", ShapeKind::kBox},
                                                         {"cylinder", ShapeKind::kCylinder},
                                                         {"sphere", ShapeKind::kSphere},
                                                         {"capsule", ShapeKind::kCapsule},
                                                         {"mesh", ShapeKind::kMesh}};
constexpr std::pair<const char*, JointKind> kJoints[] = {
    {"fixed", JointKind::kFixed},           {"revolute", JointKind::kRevolute},
    {"continuous", JointKind::kContinuous}, {"prismatic", JointKind::kPrismatic},
    {"planar", JointKind::kPlanar},         {"floating", JointKind::kFloating}};

template <typename Kind, size_t n>
std::optional<Kind> KindOf(const std::pair<const char*, Kind> (&kinds)[n],
                           const std::string& name) {
  for (const auto& [known, kind] : kinds) {
    if (name == known) return kind;
  }
  return std::nullopt;
}

RigidPose Normalized(double x, double y, double z, double w) {
  const double length = std::sqrt(x * x + y * y + z * z + w * w);
  return {w / length, x / length, y / length, z / length, 0, 0, 0};
}

// Returns the rotation Rz(yaw) Ry(pitch) Rx(roll), in liburdfdom's order of operations, so that
// poses agree with it to the last bit.
RigidPose RotationOfUrdf(double roll, double pitch, double yaw) {
  const double cr = std::cos(roll / 2);
  const double sr = std::sin(roll / 2);
  const double cp = std::cos(pitch / 2);
  const double sp = std::sin(pitch / 2);
  const double cy = std::cos(yaw / 2);
  const double sy = std::sin(yaw / 2);
  const double x = sr * cp * cy - cr * sp * sy;
  const double y = cr * sp * cy + sr * cp * sy;
  const double z = cr * cp * sy - sr * sp * cy;
  const double w = cr * cp * cy + sr * sp * sy;
  return Normalized(x, y, z, w);
}

// Reads links and joints by name, and then the tree that they form.
class UrdfReader {
 public:
  explicit UrdfReader(const XmlDocument& document) : document_(document) {}

  absl::StatusOr<Robot> Run() {
    const pugi::xml_node root = document_.root();
    if (std::string_view(root.attribute("name").value()).empty()) {
      return document_.ErrorAt(root, "<robot> lacks name=\"...\"");
    }
    for (const pugi::xml_node link : root.children("link")) {
      HULLD_RETURN_IF_ERROR(TakeLink(link));
    }
    if (links_.empty()) return document_.ErrorAt(root, "<robot> has no <link>");
    for (const pugi::xml_node joint : root.children("joint")) {
      HULLD_RETURN_IF_ERROR(TakeJoint(joint));
    }
    for (auto& [name, joint] : joints_) {
      HULLD_RETURN_IF_ERROR(TakeMimic(&joint));
    }
    for (const auto& [name, joint] : joints_) {
      HULLD_RETURN_IF_ERROR(CheckMimicChain(joint));
    }
    HULLD_ASSIGN_OR_RETURN(const auto top, FindRoot());
    Robot robot = Assemble(top);
    robot.name = root.attribute("name").value();
    return robot;
  }

 private:
  struct Link {
    pugi::xml_node element;
    std::vector<CollisionShape> shapes;
  };
  struct Joint {
    pugi::xml_node element;
    // Without the indices of links and joints.
    RobotJoint joint;
    std::string parent;
    std::string child;
    // The joint that it mimics, or empty.
    std::string leader;
  };

  absl::StatusOr<std::string> NameOf(pugi::xml_node element) const {
    const std::string name = element.attribute("name").value();
    if (!name.empty()) return name;
    return document_.ErrorAt(element, absl::StrCat("<", element.name(), "> lacks name=\"...\""));
  }

  absl::Status DefinedTwice(pugi::xml_node element, pugi::xml_node first) const {
    return document_.ErrorAt(
        element, absl::StrCat(element.name(), " ", Quoted(element.attribute("name").value()),
                              " is defined twice; the first definition is in line ",
                              document_.LineOf(first)));
  }

  // Returns an error if a child occurs twice; a reader would have to choose one.
  absl::Status CheckUnique(pugi::xml_node element,
                           std::initializer_list<const char*> children) const {
    for (const char* const child : children) {
      const pugi::xml_node second = element.child(child).next_sibling(child);
      if (!second) continue;
      return document_.ErrorAt(second, absl::StrCat("<", element.name(), "> contains <", child,
                                                    "> twice; remove one of them"));
    }
    return absl::OkStatus();
  }

  // Sets `number` to an attribute, if it exists.
  absl::Status TakeNumber(pugi::xml_node element, const char* attribute, double* number) const {
    if (!element.attribute(attribute)) return absl::OkStatus();
    const auto value = NumbersOf(document_, element, attribute, 1);
    if (value.ok()) *number = value->front();
    return value.status();
  }

  absl::Status TakeLink(pugi::xml_node element) {
    HULLD_ASSIGN_OR_RETURN(const auto name, NameOf(element));
    const auto [entry, is_new] = links_.try_emplace(name);
    if (!is_new) return DefinedTwice(element, entry->second.element);
    entry->second.element = element;
    for (const pugi::xml_node collision : element.children("collision")) {
      CollisionShape& shape = entry->second.shapes.emplace_back();
      HULLD_RETURN_IF_ERROR(TakeCollision(collision, &shape));
    }
    return absl::OkStatus();
  }

  // Reads the pose of an element; no motion if it has no <origin>.
  absl::Status TakeOrigin(pugi::xml_node parent, RigidPose* pose) const {
    const pugi::xml_node origin = parent.child("origin");
    for (const pugi::xml_attribute attribute : origin.attributes()) {
      const std::string_view name = attribute.name();
      if (name == "xyz" || name == "rpy" || name == "quat_xyzw") continue;
      // An ignored attribute would result in another pose.
      return document_.ErrorAt(origin, absl::StrCat("<origin> has no attribute ", Quoted(name),
                                                    "; attributes are xyz, rpy, and quat_xyzw"));
    }
    if (origin.attribute("rpy")) {
      HULLD_ASSIGN_OR_RETURN(const auto rpy, NumbersOf(document_, origin, "rpy", 3));
      *pose = RotationOfUrdf(rpy[0], rpy[1], rpy[2]);
    }
    if (origin.attribute("quat_xyzw")) {
      if (origin.attribute("rpy")) {
        return document_.ErrorAt(origin, "<origin> has both rpy and quat_xyzw; remove one");
      }
      HULLD_ASSIGN_OR_RETURN(const auto q, NumbersOf(document_, origin, "quat_xyzw", 4));
      const double squared = std::inner_product(q.begin(), q.end(), q.begin(), 0.0);
      if (!(squared > 0 && std::isfinite(squared))) {
        return document_.ErrorAt(origin, "<origin> quat_xyzw is not a unit quaternion");
      }
      *pose = Normalized(q[0], q[1], q[2], q[3]);
    }
    if (!origin.attribute("xyz")) return absl::OkStatus();
    const auto xyz = NumbersOf(document_, origin, "xyz", 3);
    if (xyz.ok()) std::copy(xyz->begin(), xyz->end(), pose->begin() + 4);
    return xyz.status();
  }

  absl::Status TakeCollision(pugi::xml_node collision, CollisionShape* shape) const {
    shape->line = document_.LineOf(collision);
    HULLD_RETURN_IF_ERROR(CheckUnique(collision, {"origin", "geometry"}));
    HULLD_RETURN_IF_ERROR(TakeOrigin(collision, &shape->X_LS));
    const pugi::xml_node geometry = collision.child("geometry");
    if (!geometry) return document_.ErrorAt(collision, "<collision> lacks <geometry>");
    const auto is_element = [](pugi::xml_node child) { return child.type() == pugi::node_element; };
    const pugi::xml_node element = geometry.find_child(is_element);
    if (std::count_if(geometry.begin(), geometry.end(), is_element) > 1) {
      return document_.ErrorAt(
          geometry, "<geometry> contains several shapes; write one <collision> for each");
    }
    const std::string name = element.name();
    const std::optional<ShapeKind> kind = KindOf(kShapes, name);
    if (!kind) {
      return document_.ErrorAt(
          element ? element : geometry,
          absl::StrCat("<geometry> contains ", element ? Quoted(name) : "nothing",
                       "; it must contain a box, cylinder, sphere, capsule or mesh"));
    }
    shape->kind = *kind;
    if (*kind == ShapeKind::kMesh) return TakeMesh(element, shape);
    if (*kind == ShapeKind::kBox) return TakeSizes(element, "size", shape->size);
    HULLD_RETURN_IF_ERROR(TakeSizes(element, "radius", {&shape->radius, 1}));
    if (*kind == ShapeKind::kSphere) return absl::OkStatus();
    return TakeSizes(element, "length", {&shape->length, 1});
  }

  absl::Status TakeMesh(pugi::xml_node mesh, CollisionShape* shape) const {
    shape->mesh = mesh.attribute("filename").value();
    if (shape->mesh.empty()) return document_.ErrorAt(mesh, "<mesh> lacks filename=\"...\"");
    if (!mesh.attribute("scale")) return absl::OkStatus();
    HULLD_ASSIGN_OR_RETURN(const auto numbers, NumbersOf(document_, mesh, "scale", 3));
    const bool is_flat = std::count(numbers.begin(), numbers.end(), 0) > 0;
    if (is_flat) return document_.ErrorAt(mesh, "<mesh> scale must not be 0");
    // From the text, because a double would be rounded.
    std::string_view rest = mesh.attribute("scale").value();
    for (LengthScale& factor : shape->scale) {
      factor = LengthScale::FromText(NextToken(&rest)).value_or(LengthScale());
    }
    return absl::OkStatus();
  }

  absl::Status TakeSizes(pugi::xml_node shape, const char* attribute,
                         std::span<double> sizes) const {
    HULLD_ASSIGN_OR_RETURN(const auto numbers,
                           NumbersOf(document_, shape, attribute, sizes.size()));
    std::copy(numbers.begin(), numbers.end(), sizes.begin());
    if (std::ranges::all_of(sizes, [](double size) { return size >= 0; })) return absl::OkStatus();
    return document_.ErrorAt(
        shape, absl::StrCat("<", shape.name(), "> ", attribute, " must not be negative"));
  }

  absl::StatusOr<std::string> LinkOf(pugi::xml_node joint, const char* end) const {
    const pugi::xml_node element = joint.child(end);
    const std::string joint_name = Quoted(joint.attribute("name").value());
    const std::string link = element.attribute("link").value();
    if (link.empty()) {
      return document_.ErrorAt(joint,
                               absl::StrCat("joint ", joint_name, " lacks <", end, " link=\"\">"));
    }
    if (links_.contains(link)) return link;
    return document_.ErrorAt(element, absl::StrCat("joint ", joint_name, " has a ", end,
                                                   " that does not exist: ", Quoted(link)));
  }

  absl::Status TakeJoint(pugi::xml_node element) {
    HULLD_ASSIGN_OR_RETURN(const auto name, NameOf(element));
    const auto [entry, is_new] = joints_.try_emplace(name);
    Joint& joint = entry->second;
    if (!is_new) return DefinedTwice(element, joint.element);
    joint.element = element;
    joint.joint.name = name;
    const std::string type = element.attribute("type").value();
    const std::optional<JointKind> kind = KindOf(kJoints, type);
    if (!kind) {
      return document_.ErrorAt(
          element, absl::StrCat("joint ", Quoted(name), " has type ", Quoted(type),
                                "; types are fixed, revolute, continuous, prismatic, planar and "
                                "floating"));
    }
    joint.joint.kind = *kind;
    HULLD_RETURN_IF_ERROR(
        CheckUnique(element, {"origin", "parent", "child", "axis", "limit", "mimic"}));
    HULLD_RETURN_IF_ERROR(TakeOrigin(element, &joint.joint.X_PJ));
    HULLD_RETURN_IF_ERROR(TakeAxis(element, &joint.joint));
    HULLD_RETURN_IF_ERROR(TakeLimits(element, &joint.joint));
    for (const auto& [end, link] : {std::pair("parent", &joint.parent), {"child", &joint.child}}) {
      HULLD_ASSIGN_OR_RETURN(*link, LinkOf(element, end));
    }
    if (parent_of_.emplace(joint.child, joint.parent).second) return absl::OkStatus();
    return document_.ErrorAt(
        element, absl::StrCat("link ", Quoted(joint.child),
                              " is the child of two joints; the second is ", Quoted(name)));
  }

  absl::Status TakeAxis(pugi::xml_node element, RobotJoint* joint) const {
    if (joint->kind == JointKind::kFixed || joint->kind == JointKind::kFloating) {
      return absl::OkStatus();
    }
    const pugi::xml_node axis = element.child("axis");
    if (!axis) {
      if (joint->kind != JointKind::kPlanar) return absl::OkStatus();
      // URDF's default, x, is rarely intended.
      return document_.ErrorAt(element, absl::StrCat("joint ", Quoted(joint->name),
                                                     " lacks <axis xyz=\"0 0 1\"/>, the normal of "
                                                     "its plane"));
    }
    HULLD_ASSIGN_OR_RETURN(const auto xyz, NumbersOf(document_, axis, "xyz", 3));
    std::copy(xyz.begin(), xyz.end(), joint->axis.begin());
    const double length = std::hypot(xyz[0], xyz[1], xyz[2]);
    if (length == 0) return document_.ErrorAt(axis, "<axis> xyz must not be 0 0 0");
    // The travel of a prismatic joint is its value, regardless of the length of the axis.
    if (length != 1) {
      for (double& x : joint->axis) x /= length;
    }
    return absl::OkStatus();
  }

  absl::Status TakeLimits(pugi::xml_node element, RobotJoint* joint) const {
    if (joint->kind != JointKind::kRevolute && joint->kind != JointKind::kPrismatic) {
      return absl::OkStatus();
    }
    const pugi::xml_node limit = element.child("limit");
    // A mimic joint needs no limits of its own.
    if (!limit && element.child("mimic")) return absl::OkStatus();
    if (!limit) {
      return document_.ErrorAt(element, absl::StrCat("joint ", Quoted(joint->name),
                                                     " lacks <limit lower=\"\" upper=\"\" ...>"));
    }
    std::array<double, 2>& range = joint->limits.emplace();
    HULLD_RETURN_IF_ERROR(TakeNumber(limit, "lower", &range[0]));
    return TakeNumber(limit, "upper", &range[1]);
  }

  absl::Status TakeMimic(Joint* joint) const {
    const pugi::xml_node mimic = joint->element.child("mimic");
    if (!mimic) return absl::OkStatus();
    HULLD_RETURN_IF_ERROR(TakeNumber(mimic, "multiplier", &joint->joint.multiplier));
    HULLD_RETURN_IF_ERROR(TakeNumber(mimic, "offset", &joint->joint.offset));
    joint->leader = mimic.attribute("joint").value();
    const auto leader = joints_.find(joint->leader);
    if (leader == joints_.end()) {
      return document_.ErrorAt(
          mimic, absl::StrCat("joint ", Quoted(joint->joint.name),
                              " mimics a joint that does not exist: ", Quoted(joint->leader)));
    }
    for (const RobotJoint& one : {joint->joint, leader->second.joint}) {
      if (!one.is_loose()) continue;
      return document_.ErrorAt(
          mimic, absl::StrCat("joint ", Quoted(one.name), " is ",
                              one.kind == JointKind::kPlanar ? "planar" : "floating",
                              "; a mimic joint and its leader must have one value each"));
    }
    return absl::OkStatus();
  }

  absl::Status CheckMimicChain(const Joint& joint) const {
    const Joint* at = &joint;
    // A chain with more steps than joints proves a cycle.
    for (size_t step = 0; step <= joints_.size(); ++step) {
      if (at->leader.empty()) return absl::OkStatus();
      at = &joints_.at(at->leader);
    }
    return document_.ErrorAt(joint.element, absl::StrCat("joint ", Quoted(joint.joint.name),
                                                         " mimics itself through other joints"));
  }

  // Returns the only link that is no child. Otherwise, the links do not form a tree.
  absl::StatusOr<std::string> FindRoot() const {
    pugi::xml_node root;
    for (const auto& [name, link] : links_) {
      if (parent_of_.contains(name)) {
        std::string up = name;
        size_t steps = 0;
        for (auto parent = parent_of_.find(up); parent != parent_of_.end();
             parent = parent_of_.find(up)) {
          up = parent->second;
          if (++steps <= links_.size()) continue;
          return document_.ErrorAt(
              link.element, absl::StrCat("link ", Quoted(name), " is part of a cycle of joints"));
        }
        continue;
      }
      if (root) {
        const bool is_later = document_.LineOf(root) < document_.LineOf(link.element);
        const pugi::xml_node later = is_later ? link.element : root;
        const pugi::xml_node earlier = is_later ? root : link.element;
        return document_.ErrorAt(
            later,
            absl::StrCat("link ", Quoted(later.attribute("name").value()),
                         " has no parent joint, like ", Quoted(earlier.attribute("name").value()),
                         "; exactly one link may be the root"));
      }
      root = link.element;
    }
    return std::string(root.attribute("name").value());
  }

  // Returns the tree: parents before their children, and siblings in the order of their joints'
  // names.
  Robot Assemble(const std::string& root) {
    std::map<std::string, std::vector<Joint*>> below;
    for (auto& [name, joint] : joints_) below[joint.parent].push_back(&joint);
    Robot robot;
    std::vector<std::pair<std::string, Joint*>> pending = {{root, nullptr}};
    while (!pending.empty()) {
      const auto [name, above] = pending.back();
      pending.pop_back();
      const int index = static_cast<int>(robot.links.size());
      RobotLink& link = robot.links.emplace_back();
      link.name = name;
      link.shapes = std::move(links_.at(name).shapes);
      if (above != nullptr) {
        above->joint.child = index;
        link.parent_joint = static_cast<int>(robot.joints.size());
        robot.joints.push_back(above->joint);
      }
      std::vector<Joint*>& children = below[name];
      for (auto child = children.rbegin(); child != children.rend(); ++child) {
        (*child)->joint.parent = index;
        pending.emplace_back((*child)->child, *child);
      }
    }
    for (RobotJoint& joint : robot.joints) {
      const std::string& leader = joints_.at(joint.name).leader;
      if (!leader.empty() && joint.kind != JointKind::kFixed) {
        joint.mimics = robot.FindJoint(leader);
      }
    }
    return robot;
  }

  const XmlDocument& document_;
  std::map<std::string, Link> links_;
  std::map<std::string, Joint> joints_;
  // Links, keyed by child.
  std::map<std::string, std::string> parent_of_;
};

}  // namespace

absl::StatusOr<Robot> ParseUrdf(const std::string& text, const std::string& name) {
  HULLD_ASSIGN_OR_RETURN(const auto document, ParseXml(text, name, "robot"));
  return UrdfReader(*document).Run();
}

absl::StatusOr<Robot> ReadUrdf(const std::string& path) {
  HULLD_ASSIGN_OR_RETURN(const auto text, ReadText(path));
  return ParseUrdf(text, SourceName(path));
}

}  // namespace hulld
