#include "client/robot/srdf_file.h"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_replace.h>

#include <algorithm>

#include "client/base/status_macros.h"
#include "client/formats/byte_source.h"
#include "client/formats/text_number.h"
#include "client/robot/xml_document.h"

namespace hulld {
namespace {

absl::StatusOr<int> LinkOf(const XmlDocument& document, pugi::xml_node element,
                           const char* attribute, const Robot& robot) {
  const std::string name = element.attribute(attribute).value();
  const int link = robot.FindLink(name);
  if (link >= 0) return link;
  return document.ErrorAt(
      element, name.empty() ? absl::StrCat("<", element.name(), "> lacks ", attribute, "=\"...\"")
                            : absl::StrCat("<", element.name(), "> names the link ", Quoted(name),
                                           ", which robot ", Quoted(robot.name), " does not have"));
}

absl::StatusOr<LinkPair> PairOf(const XmlDocument& document, pugi::xml_node element,
                                const Robot& robot) {
  HULLD_ASSIGN_OR_RETURN(const auto a, LinkOf(document, element, "link1", robot));
  HULLD_ASSIGN_OR_RETURN(const auto b, LinkOf(document, element, "link2", robot));
  return MakeLinkPair(a, b);
}

std::string Escaped(const std::string& text) {
  return absl::StrReplaceAll(text, {{"&", "&amp;"}, {"<", "&lt;"}, {"\"", "&quot;"}});
}

}  // namespace

LinkPair MakeLinkPair(int a, int b) { return {std::min(a, b), std::max(a, b)}; }

absl::StatusOr<std::set<LinkPair>> ParseDisabledPairs(const std::string& text,
                                                      const std::string& name, const Robot& robot) {
  HULLD_ASSIGN_OR_RETURN(const auto document, ParseXml(text, name, "robot"));
  const pugi::xml_node root = document->root();
  std::set<LinkPair> pairs;
  for (const pugi::xml_node element : root.children("disable_default_collisions")) {
    HULLD_ASSIGN_OR_RETURN(const auto link, LinkOf(*document, element, "link", robot));
    for (int other = 0; other < static_cast<int>(robot.links.size()); ++other) {
      if (other != link) pairs.insert(MakeLinkPair(link, other));
    }
  }
  for (const pugi::xml_node element : root.children("enable_collisions")) {
    HULLD_ASSIGN_OR_RETURN(const auto pair, PairOf(*document, element, robot));
    pairs.erase(pair);
  }
  for (const pugi::xml_node element : root.children("disable_collisions")) {
    HULLD_ASSIGN_OR_RETURN(const auto pair, PairOf(*document, element, robot));
    pairs.insert(pair);
  }
  return pairs;
}

absl::StatusOr<std::set<LinkPair>> ReadDisabledPairs(const std::string& path, const Robot& robot) {
  HULLD_ASSIGN_OR_RETURN(const auto text, ReadText(path));
  return ParseDisabledPairs(text, SourceName(path), robot);
}

std::set<LinkPair> AdjacentPairs(const Robot& robot) {
  // Two links with shapes are neighbors if the path between them has no other link with shapes. So
  // each link is a neighbor of its nearest ancestor with shapes, and all links directly below the
  // same group of links without shapes are neighbors of each other.
  std::set<LinkPair> pairs;
  const int count = static_cast<int>(robot.links.size());
  // Topmost of the links without shapes above a link, or its nearest ancestor with shapes.
  std::vector<int> group(robot.links.size(), 0);
  std::vector<std::vector<int>> members(robot.links.size());
  for (int i = 0; i < count; ++i) {
    const auto at = static_cast<size_t>(i);
    const int joint = robot.links[at].parent_joint;
    const bool bare = robot.links[at].shapes.empty();
    if (joint < 0 || robot.joints[static_cast<size_t>(joint)].is_loose()) {
      group[at] = i;
      if (!bare) members[at].push_back(i);
      continue;
    }
    const auto parent = static_cast<size_t>(robot.joints[static_cast<size_t>(joint)].parent);
    const bool parent_bare = robot.links[parent].shapes.empty();
    // Each branch of links without shapes below a link with shapes is a separate group.
    const int key = parent_bare ? group[parent] : i;
    group[at] = bare ? key : i;
    if (!parent_bare) members[static_cast<size_t>(key)].push_back(static_cast<int>(parent));
    if (!bare) members[static_cast<size_t>(key)].push_back(i);
  }
  for (const std::vector<int>& near : members) {
    for (const int a : near) {
      for (const int b : near) {
        if (a < b) pairs.insert({a, b});
      }
    }
  }
  return pairs;
}

void WriteSrdf(const Robot& robot, const std::vector<DisabledPair>& pairs,
               const std::string& comment, std::ostream& out) {
  out << "<?xml version=\"1.0\"?>\n<!-- " << comment << " -->\n<robot name=\""
      << Escaped(robot.name) << "\">\n";
  for (const DisabledPair& pair : pairs) {
    out << "  <disable_collisions link1=\""
        << Escaped(robot.links[static_cast<size_t>(pair.links.first)].name) << "\" link2=\""
        << Escaped(robot.links[static_cast<size_t>(pair.links.second)].name) << "\" reason=\""
        << pair.reason << "\"/>\n";
  }
  out << "</robot>\n";
}

}  // namespace hulld
