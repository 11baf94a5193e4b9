#include "client/robot/urdf_file.h"

#include <absl/strings/str_cat.h>
#include <console_bridge/console.h>
#include <urdf_model/model.h>
#include <urdf_parser/urdf_parser.h>

#include <algorithm>
#include <cmath>
#include <exception>
#include <map>
#include <memory>
#include <set>
#include <utility>

#include "client/formats/byte_source.h"
#include "client/formats/text_number.h"
#include "client/robot/xml_document.h"

namespace hulld {
namespace {

constexpr const char* kShapes[] = {"box", "cylinder", "sphere", "capsule", "mesh"};
constexpr const char* kJoints[] = {"fixed",     "revolute", "continuous",
                                   "prismatic", "planar",   "floating"};

// Captures the first error that liburdfdom logs, in place of its output.
class FirstError final : public console_bridge::OutputHandler {
 public:
  FirstError() { console_bridge::useOutputHandler(this); }
  ~FirstError() override { console_bridge::restorePreviousOutputHandler(); }
  FirstError(const FirstError&) = delete;
  FirstError& operator=(const FirstError&) = delete;

  void log(const std::string& text, console_bridge::LogLevel level, const char* /*file*/,
           int /*line*/) override {
    if (level >= console_bridge::CONSOLE_BRIDGE_LOG_ERROR && text_.empty()) text_ = text;
  }
  const std::string& text() const { return text_; }

 private:
  std::string text_;
};

// Checks a description before liburdfdom parses it, for defects that the library accepts or reports
// without a line.
class UrdfCheck {
 public:
  explicit UrdfCheck(const XmlDocument& document) : document_(document) {}

  absl::Status Run() {
    const TiXmlElement& root = *document_.tree.RootElement();
    if (AttributeOf(root, "name").empty()) {
      return document_.ErrorAt(root, "<robot> lacks name=\"...\"");
    }
    for (const TiXmlElement* link : ChildrenOf(root, "link")) {
      if (absl::Status good = TakeLink(*link); !good.ok()) return good;
    }
    if (links_.empty()) return document_.ErrorAt(root, "<robot> has no <link>");
    const std::vector<const TiXmlElement*> joints = ChildrenOf(root, "joint");
    for (const TiXmlElement* joint : joints) {
      if (absl::Status good = TakeJoint(*joint); !good.ok()) return good;
    }
    for (const TiXmlElement* joint : joints) {
      if (absl::Status good = CheckMimic(*joint); !good.ok()) return good;
    }
    return CheckTree();
  }

 private:
  absl::StatusOr<std::string> NameOf(const TiXmlElement& element) const {
    std::string name = AttributeOf(element, "name");
    if (!name.empty()) return name;
    return document_.ErrorAt(element,
                             absl::StrCat("<", element.ValueStr(), "> lacks name=\"...\""));
  }

  absl::Status TakeLink(const TiXmlElement& link) {
    const auto name = NameOf(link);
    if (!name.ok()) return name.status();
    const auto [other, is_new] = links_.emplace(*name, &link);
    if (!is_new) {
      return document_.ErrorAt(link, absl::StrCat("link ", Quoted(*name),
                                                  " is defined twice; the first definition is in ",
                                                  "line ", other->second->Row()));
    }
    for (const TiXmlElement* collision : ChildrenOf(link, "collision")) {
      if (absl::Status good = CheckCollision(*collision); !good.ok()) return good;
    }
    return absl::OkStatus();
  }

  absl::Status CheckOrigin(const TiXmlElement& parent) const {
    const TiXmlElement* const origin = parent.FirstChildElement("origin");
    if (origin == nullptr) return absl::OkStatus();
    for (const char* attribute : {"xyz", "rpy"}) {
      if (origin->Attribute(attribute) == nullptr) continue;
      const auto numbers = NumbersOf(document_, *origin, attribute, 3);
      if (!numbers.ok()) return numbers.status();
    }
    return absl::OkStatus();
  }

  absl::Status CheckCollision(const TiXmlElement& collision) const {
    if (absl::Status good = CheckOrigin(collision); !good.ok()) return good;
    const TiXmlElement* const geometry = collision.FirstChildElement("geometry");
    if (geometry == nullptr) return document_.ErrorAt(collision, "<collision> lacks <geometry>");
    const TiXmlElement* const shape = geometry->FirstChildElement();
    const std::string kind = shape == nullptr ? "" : shape->ValueStr();
    if (std::find(std::begin(kShapes), std::end(kShapes), kind) == std::end(kShapes)) {
      return document_.ErrorAt(
          shape == nullptr ? *geometry : *shape,
          absl::StrCat("<geometry> contains ", shape == nullptr ? "nothing" : Quoted(kind),
                       "; it must contain a box, cylinder, sphere, capsule or mesh"));
    }
    if (kind == "mesh") return CheckMesh(*shape);
    if (kind == "box") return CheckSizes(*shape, "size", 3);
    absl::Status good = CheckSizes(*shape, "radius", 1);
    if (good.ok() && kind != "sphere") good = CheckSizes(*shape, "length", 1);
    return good;
  }

  absl::Status CheckMesh(const TiXmlElement& mesh) const {
    if (AttributeOf(mesh, "filename").empty()) {
      return document_.ErrorAt(mesh, "<mesh> lacks filename=\"...\"");
    }
    if (mesh.Attribute("scale") == nullptr) return absl::OkStatus();
    const auto scale = NumbersOf(document_, mesh, "scale", 3);
    if (!scale.ok()) return scale.status();
    const bool is_flat = std::count(scale->begin(), scale->end(), 0) > 0;
    return is_flat ? document_.ErrorAt(mesh, "<mesh> scale must not be 0") : absl::OkStatus();
  }

  absl::Status CheckSizes(const TiXmlElement& shape, const char* attribute, size_t count) const {
    const auto sizes = NumbersOf(document_, shape, attribute, count);
    if (!sizes.ok()) return sizes.status();
    for (const double size : *sizes) {
      if (size > 0) continue;
      return document_.ErrorAt(
          shape, absl::StrCat("<", shape.ValueStr(), "> ", attribute, " must be above 0"));
    }
    return absl::OkStatus();
  }

  absl::StatusOr<std::string> LinkOf(const TiXmlElement& joint, const char* end) const {
    const TiXmlElement* const element = joint.FirstChildElement(end);
    const std::string joint_name = Quoted(AttributeOf(joint, "name"));
    if (element == nullptr || AttributeOf(*element, "link").empty()) {
      return document_.ErrorAt(joint,
                               absl::StrCat("joint ", joint_name, " lacks <", end, " link=\"\">"));
    }
    std::string link = AttributeOf(*element, "link");
    if (links_.contains(link)) return link;
    return document_.ErrorAt(*element, absl::StrCat("joint ", joint_name, " has a ", end,
                                                    " that does not exist: ", Quoted(link)));
  }

  absl::Status TakeJoint(const TiXmlElement& joint) {
    const auto name = NameOf(joint);
    if (!name.ok()) return name.status();
    const auto [other, is_new] = joints_.emplace(*name, &joint);
    if (!is_new) {
      return document_.ErrorAt(joint, absl::StrCat("joint ", Quoted(*name),
                                                   " is defined twice; the first definition is ",
                                                   "in line ", other->second->Row()));
    }
    const std::string kind = AttributeOf(joint, "type");
    if (std::find(std::begin(kJoints), std::end(kJoints), kind) == std::end(kJoints)) {
      return document_.ErrorAt(
          joint, absl::StrCat("joint ", Quoted(*name), " has type ", Quoted(kind),
                              "; types are fixed, revolute, continuous, prismatic, planar and "
                              "floating"));
    }
    absl::Status good = CheckOrigin(joint);
    if (good.ok()) good = CheckAxisAndLimits(joint, kind);
    if (!good.ok()) return good;
    const auto parent = LinkOf(joint, "parent");
    if (!parent.ok()) return parent.status();
    const auto child = LinkOf(joint, "child");
    if (!child.ok()) return child.status();
    if (!parent_of_.emplace(*child, *parent).second) {
      return document_.ErrorAt(
          joint, absl::StrCat("link ", Quoted(*child),
                              " is the child of two joints; the second is ", Quoted(*name)));
    }
    return absl::OkStatus();
  }

  absl::Status CheckAxisAndLimits(const TiXmlElement& joint, const std::string& kind) const {
    if (kind == "fixed" || kind == "floating") return absl::OkStatus();
    if (const TiXmlElement* const axis = joint.FirstChildElement("axis"); axis != nullptr) {
      const auto xyz = NumbersOf(document_, *axis, "xyz", 3);
      if (!xyz.ok()) return xyz.status();
      if ((*xyz)[0] == 0 && (*xyz)[1] == 0 && (*xyz)[2] == 0) {
        return document_.ErrorAt(*axis, "<axis> xyz must not be 0 0 0");
      }
    } else if (kind == "planar") {
      // URDF's default, x, is rarely intended.
      return document_.ErrorAt(joint, absl::StrCat("joint ", Quoted(AttributeOf(joint, "name")),
                                                   " lacks <axis xyz=\"0 0 1\"/>, the normal of "
                                                   "its plane"));
    }
    if (kind == "continuous" || kind == "planar") return absl::OkStatus();
    const TiXmlElement* const limit = joint.FirstChildElement("limit");
    // A mimic joint needs no limits of its own.
    if (limit == nullptr && joint.FirstChildElement("mimic") != nullptr) return absl::OkStatus();
    if (limit == nullptr) {
      return document_.ErrorAt(joint, absl::StrCat("joint ", Quoted(AttributeOf(joint, "name")),
                                                   " lacks <limit lower=\"\" upper=\"\" ...>"));
    }
    for (const char* attribute : {"lower", "upper"}) {
      if (limit->Attribute(attribute) == nullptr) continue;
      const auto value = NumbersOf(document_, *limit, attribute, 1);
      if (!value.ok()) return value.status();
    }
    return absl::OkStatus();
  }

  absl::Status CheckMimic(const TiXmlElement& joint) const {
    std::string name = AttributeOf(joint, "name");
    // A chain with more steps than joints proves a cycle.
    for (size_t step = 0; step <= joints_.size(); ++step) {
      const TiXmlElement* const at = joints_.at(name);
      const TiXmlElement* const mimic = at->FirstChildElement("mimic");
      if (mimic == nullptr) return absl::OkStatus();
      for (const char* attribute : {"multiplier", "offset"}) {
        if (mimic->Attribute(attribute) == nullptr) continue;
        const auto value = NumbersOf(document_, *mimic, attribute, 1);
        if (!value.ok()) return value.status();
      }
      std::string leader = AttributeOf(*mimic, "joint");
      if (!joints_.contains(leader)) {
        return document_.ErrorAt(
            *mimic, absl::StrCat("joint ", Quoted(name),
                                 " mimics a joint that does not exist: ", Quoted(leader)));
      }
      for (const std::string& one : {name, leader}) {
        const std::string kind = AttributeOf(*joints_.at(one), "type");
        if (kind != "planar" && kind != "floating") continue;
        return document_.ErrorAt(
            *mimic, absl::StrCat("joint ", Quoted(one), " is ", kind,
                                 "; a mimic joint and its leader must have one value each"));
      }
      name = std::move(leader);
    }
    return document_.ErrorAt(joint, absl::StrCat("joint ", Quoted(AttributeOf(joint, "name")),
                                                 " mimics itself through other joints"));
  }

  absl::Status CheckTree() const {
    const TiXmlElement* root = nullptr;
    for (const auto& [name, element] : links_) {
      if (parent_of_.contains(name)) {
        std::string up = name;
        size_t steps = 0;
        for (auto parent = parent_of_.find(up); parent != parent_of_.end();
             parent = parent_of_.find(up)) {
          up = parent->second;
          if (++steps <= links_.size()) continue;
          return document_.ErrorAt(
              *element, absl::StrCat("link ", Quoted(name), " is part of a cycle of joints"));
        }
        continue;
      }
      if (root != nullptr) {
        const TiXmlElement& later = root->Row() < element->Row() ? *element : *root;
        return document_.ErrorAt(
            later,
            absl::StrCat("link ", Quoted(AttributeOf(later, "name")), " has no parent joint, like ",
                         Quoted(AttributeOf(root == &later ? *element : *root, "name")),
                         "; exactly one link may be the root"));
      }
      root = element;
    }
    return absl::OkStatus();
  }

  const XmlDocument& document_;
  std::map<std::string, const TiXmlElement*> links_;
  std::map<std::string, const TiXmlElement*> joints_;
  // Keyed by child.
  std::map<std::string, std::string> parent_of_;
};

// Properties of a shape that the library does not read.
struct ShapePlace {
  int line = 0;
  bool is_capsule = false;
  // For a mesh: the exact text, because the library rounds it to doubles.
  std::array<LengthScale, 3> scale;
};

// Parts of the document that the library does not read.
struct Extras {
  // Shapes by link.
  std::map<std::string, std::vector<ShapePlace>> shapes;
  // Joints without <limit>, which the library requires.
  std::set<std::string> unlimited;
};

// Requires an attribute that CheckMesh accepted, or none.
std::array<LengthScale, 3> ScaleOf(const TiXmlElement& shape) {
  std::array<LengthScale, 3> scale;
  const std::string text = AttributeOf(shape, "scale");
  std::string_view rest = text;
  for (LengthScale& factor : scale) {
    factor = LengthScale::FromText(NextToken(&rest)).value_or(LengthScale());
  }
  return scale;
}

// Reduces the document to the elements that the library is to read. Capsules become cylinders.
Extras PrepareForLibrary(TiXmlElement* root) {
  Extras extras;
  for (TiXmlElement* child = root->FirstChildElement(); child != nullptr;) {
    TiXmlElement* const next = child->NextSiblingElement();
    if (child->ValueStr() != "link" && child->ValueStr() != "joint") {
      root->RemoveChild(child);
    } else if (child->ValueStr() == "joint") {
      // The library requires forces and speeds, which are not used here.
      for (const char* name : {"dynamics", "safety_controller", "calibration"}) {
        while (TiXmlElement* const part = child->FirstChildElement(name)) child->RemoveChild(part);
      }
      if (TiXmlElement* const limit = child->FirstChildElement("limit"); limit != nullptr) {
        limit->SetAttribute("effort", "0");
        limit->SetAttribute("velocity", "0");
      } else {
        extras.unlimited.insert(AttributeOf(*child, "name"));
        child->InsertEndChild(TiXmlElement("limit"))->ToElement()->SetAttribute("effort", "0");
        child->FirstChildElement("limit")->SetAttribute("velocity", "0");
      }
    } else {
      std::vector<ShapePlace>& shapes = extras.shapes[AttributeOf(*child, "name")];
      for (TiXmlElement* part = child->FirstChildElement(); part != nullptr;) {
        TiXmlElement* const after = part->NextSiblingElement();
        if (part->ValueStr() != "collision") {
          child->RemoveChild(part);
        } else {
          TiXmlElement* const shape = part->FirstChildElement("geometry")->FirstChildElement();
          const bool is_capsule = shape->ValueStr() == "capsule";
          if (is_capsule) shape->SetValue("cylinder");
          shapes.push_back({part->Row(), is_capsule, ScaleOf(*shape)});
        }
        part = after;
      }
    }
    child = next;
  }
  return extras;
}

RigidPose PoseOf(const urdf::Pose& pose) {
  const urdf::Rotation& q = pose.rotation;
  return {q.w, q.x, q.y, q.z, pose.position.x, pose.position.y, pose.position.z};
}

CollisionShape ShapeOf(const urdf::Collision& collision, const ShapePlace& place) {
  CollisionShape shape;
  shape.X_LS = PoseOf(collision.origin);
  shape.line = place.line;
  switch (collision.geometry->type) {
    case urdf::Geometry::BOX: {
      const urdf::Vector3& size = static_cast<const urdf::Box&>(*collision.geometry).dim;
      shape.kind = ShapeKind::kBox;
      shape.size = {size.x, size.y, size.z};
      break;
    }
    case urdf::Geometry::SPHERE:
      shape.kind = ShapeKind::kSphere;
      shape.radius = static_cast<const urdf::Sphere&>(*collision.geometry).radius;
      break;
    case urdf::Geometry::CYLINDER: {
      const auto& cylinder = static_cast<const urdf::Cylinder&>(*collision.geometry);
      shape.kind = place.is_capsule ? ShapeKind::kCapsule : ShapeKind::kCylinder;
      shape.radius = cylinder.radius;
      shape.length = cylinder.length;
      break;
    }
    default: {
      const auto& mesh = static_cast<const urdf::Mesh&>(*collision.geometry);
      shape.kind = ShapeKind::kMesh;
      shape.mesh = mesh.filename;
      shape.scale = place.scale;
    }
  }
  return shape;
}

RobotJoint JointOf(const urdf::Joint& from, const Extras& extras) {
  RobotJoint joint;
  joint.name = from.name;
  joint.kind = from.type == urdf::Joint::REVOLUTE     ? JointKind::kRevolute
               : from.type == urdf::Joint::CONTINUOUS ? JointKind::kContinuous
               : from.type == urdf::Joint::PRISMATIC  ? JointKind::kPrismatic
               : from.type == urdf::Joint::PLANAR     ? JointKind::kPlanar
               : from.type == urdf::Joint::FLOATING   ? JointKind::kFloating
                                                      : JointKind::kFixed;
  joint.X_PJ = PoseOf(from.parent_to_joint_origin_transform);
  if (joint.kind == JointKind::kFixed || joint.kind == JointKind::kFloating) return joint;
  const double length = std::hypot(from.axis.x, from.axis.y, from.axis.z);
  joint.axis = {from.axis.x, from.axis.y, from.axis.z};
  // The travel of a prismatic joint is its value, regardless of the length of the axis.
  if (length != 1) {
    for (double& x : joint.axis) x /= length;
  }
  const bool limited =
      (joint.kind == JointKind::kRevolute || joint.kind == JointKind::kPrismatic) &&
      from.limits != nullptr && !extras.unlimited.contains(joint.name);
  if (limited) joint.limits = {from.limits->lower, from.limits->upper};
  return joint;
}

// Converts the model, parents before their children.
absl::StatusOr<Robot> RobotOf(const urdf::ModelInterface& model, const Extras& extras,
                              const std::string& file) {
  Robot robot;
  robot.name = model.getName();
  std::vector<std::pair<const urdf::Link*, int>> pending = {{model.getRoot().get(), -1}};
  std::map<std::string, int> index_of;
  while (!pending.empty()) {
    const auto [from, parent] = pending.back();
    pending.pop_back();
    const int index = static_cast<int>(robot.links.size());
    RobotLink link;
    link.name = from->name;
    // A name with characters that XML cannot represent may not survive the round trip.
    const auto known = extras.shapes.find(from->name);
    if (known == extras.shapes.end() || known->second.size() != from->collision_array.size()) {
      return absl::InvalidArgumentError(absl::StrCat(
          file, ": liburdfdom reads link ", Quoted(from->name), " differently; use a plain name"));
    }
    const std::vector<ShapePlace>& lines = known->second;
    for (size_t i = 0; i < lines.size(); ++i) {
      link.shapes.push_back(ShapeOf(*from->collision_array[i], lines[i]));
    }
    if (from->parent_joint != nullptr) {
      RobotJoint joint = JointOf(*from->parent_joint, extras);
      joint.parent = parent;
      joint.child = index;
      link.parent_joint = static_cast<int>(robot.joints.size());
      index_of[joint.name] = link.parent_joint;
      robot.joints.push_back(std::move(joint));
    }
    robot.links.push_back(std::move(link));
    // Pushed in reverse, so that the order is the file's, as far as the library preserves it.
    for (auto child = from->child_links.rbegin(); child != from->child_links.rend(); ++child) {
      pending.push_back({child->get(), index});
    }
  }
  for (RobotJoint& joint : robot.joints) {
    const urdf::JointMimicSharedPtr mimic = model.getJoint(joint.name)->mimic;
    if (mimic == nullptr || joint.kind == JointKind::kFixed) continue;
    const auto leader = index_of.find(mimic->joint_name);
    if (leader == index_of.end()) {
      return absl::InvalidArgumentError(absl::StrCat(
          file, ": liburdfdom reads joint ", Quoted(joint.name), " differently; use plain names"));
    }
    joint.mimics = leader->second;
    joint.multiplier = mimic->multiplier;
    joint.offset = mimic->offset;
  }
  return robot;
}

}  // namespace

absl::StatusOr<Robot> ParseUrdf(const std::string& text, const std::string& name) {
  auto document = ParseXml(text, name, "robot");
  if (!document.ok()) return document.status();
  if (absl::Status good = UrdfCheck(**document).Run(); !good.ok()) return good;
  const Extras extras = PrepareForLibrary((*document)->tree.RootElement());
  TiXmlPrinter printer;
  (*document)->tree.Accept(&printer);
  const FirstError error;
  urdf::ModelInterfaceSharedPtr model;
  std::string problem;
  try {
    model = urdf::parseURDF(printer.Str());
    problem = error.text();
  } catch (const std::exception& exception) {
    problem = exception.what();
  }
  if (model == nullptr || model->getRoot() == nullptr) {
    return absl::InvalidArgumentError(absl::StrCat(name, ": liburdfdom refuses it: ", problem));
  }
  return RobotOf(*model, extras, name);
}

absl::StatusOr<Robot> ReadUrdf(const std::string& path) {
  const auto text = ReadText(path);
  if (!text.ok()) return text.status();
  return ParseUrdf(*text, path == "-" ? "standard input" : path);
}

}  // namespace hulld
