#include "client/hullctl/answer_text.h"

#include <cstdio>

#include "client/formats/text_number.h"

namespace hulld {
namespace {

std::string WithoutPrefix(const std::string& name, const std::string& prefix) {
  return name.rfind(prefix, 0) == 0 ? name.substr(prefix.size()) : name;
}

}  // namespace

std::string RelationText(v1::Relation relation) {
  if (relation == v1::RELATION_UNSPECIFIED) return "-";
  return WithoutPrefix(v1::Relation_Name(relation), "RELATION_");
}

std::string AxisKindText(v1::AxisKind kind) {
  return WithoutPrefix(v1::AxisKind_Name(kind), "AXIS_KIND_");
}

std::string RungText(v1::Rung rung) {
  switch (rung) {
    case v1::RUNG_FLOATING_POINT:
      return "floating point with a proven bound";
    case v1::RUNG_EXACT:
      return "exact arithmetic";
    default:
      return WithoutPrefix(v1::Rung_Name(rung), "RUNG_");
  }
}

std::string DurationText(const google::protobuf::Duration& duration) {
  double value = static_cast<double>(duration.seconds()) + 1e-9 * duration.nanos();
  const char* unit = "s";
  for (const char* smaller : {"ms", "us", "ns"}) {
    if (value >= 1 || value == 0) break;
    value *= 1000;
    unit = smaller;
  }
  char text[48];
  std::snprintf(text, sizeof(text), "%.3g %s", value, unit);
  return text;
}

std::string HullSizeText(const v1::HullSize& size) {
  return std::to_string(size.vertices()) + " vertices, " + std::to_string(size.edges()) +
         " edges, " + std::to_string(size.facets()) + " facets";
}

std::string StageText(const v1::Analysis& analysis) {
  if (analysis.stage() == v1::AXIS_KIND_UNSPECIFIED) return "nowhere";
  std::string text = AxisKindText(analysis.stage());
  if (analysis.has_axis_index()) text += ", axis " + std::to_string(analysis.axis_index());
  return text;
}

std::string DirectionText(const v1::Vector3& direction) {
  return ShortestText(direction.x()) + " " + ShortestText(direction.y()) + " " +
         ShortestText(direction.z());
}

}  // namespace hulld
