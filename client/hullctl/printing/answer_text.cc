#include "client/hullctl/printing/answer_text.h"

#include <absl/strings/strip.h>

#include <cstdio>

#include "client/formats/text_number.h"
#include "client/hullctl/printing/json.h"

namespace hulld {
namespace {

std::string IntegerText(const std::string& digits) {
  constexpr size_t kShown = 24;
  if (digits.size() <= kShown) return digits;
  return digits.substr(0, 8) + "...(" + std::to_string(digits.size()) + " digits)";
}

}  // namespace

std::string RelationText(v1::Relation relation) {
  if (relation == v1::RELATION_UNSPECIFIED) return "-";
  return std::string(absl::StripPrefix(v1::Relation_Name(relation), "RELATION_"));
}

std::string PaintedRelation(v1::Relation relation, const Painter& paint) {
  const std::string text = RelationText(relation);
  switch (relation) {
    case v1::RELATION_SEPARATED:
      return paint(Hue::kGood, text);
    case v1::RELATION_TOUCHING:
    case v1::RELATION_WITHIN_TOLERANCE:
      return paint(Hue::kNotable, text);
    case v1::RELATION_OVERLAPPING:
      return paint(Hue::kBad, text);
    default:
      return text;
  }
}

std::string AxisKindText(v1::AxisKind kind) {
  return std::string(absl::StripPrefix(v1::AxisKind_Name(kind), "AXIS_KIND_"));
}

std::string RungText(v1::Rung rung) {
  switch (rung) {
    case v1::RUNG_BOUNDS:
      return "bounding boxes";
    case v1::RUNG_CACHED:
      return "result of the previous step";
    case v1::RUNG_FLOATING_POINT:
      return "floating point with a proven bound";
    case v1::RUNG_EXACT:
      return "exact arithmetic";
    default:
      return std::string(absl::StripPrefix(v1::Rung_Name(rung), "RUNG_"));
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

std::string VectorText(double x, double y, double z) {
  return ShortestText(x) + " " + ShortestText(y) + " " + ShortestText(z);
}

std::string CertificateText(const v1::Certificate& certificate) {
  std::string text;
  if (certificate.has_direction()) text = "n = " + VectorText(certificate.direction());
  if (certificate.has_integer_direction()) {
    const v1::IntegerDirection& n = certificate.integer_direction();
    text = "n = " + IntegerText(n.x()) + " " + IntegerText(n.y()) + " " + IntegerText(n.z());
  }
  for (int i = 0; i < certificate.pairs_size(); ++i) {
    if (!text.empty()) text += i == 0 ? "; " : ", ";
    text += "A " + std::to_string(certificate.pairs(i).index_a()) + " with B " +
            std::to_string(certificate.pairs(i).index_b());
  }
  return text.empty() ? "none" : text;
}

std::string SeparationText(const v1::Separation& separation) {
  return ShortestText(separation.value()) + " within " + ShortestText(separation.bound());
}

std::string NormalText(const v1::Normal& normal) {
  return VectorText(normal.direction()) + " within " + ShortestText(normal.angle_bound()) + " rad";
}

std::string VerificationText(const Verification& verification, const Painter& paint) {
  switch (verification.verdict) {
    case Verdict::kValid:
      return paint(Hue::kGood, "valid");
    case Verdict::kInvalid:
      return paint(Hue::kBad, "INVALID") + ": " + verification.reason;
    case Verdict::kCannotCheck:
    case Verdict::kMoved:
      break;
  }
  return paint(Hue::kNotable, "cannot check") + ": " + verification.reason;
}

std::string VerificationJson(const Verification& verification) {
  const char* const verdict = verification.verdict == Verdict::kValid     ? "VALID"
                              : verification.verdict == Verdict::kInvalid ? "INVALID"
                                                                          : "CANNOT_CHECK";
  return JsonObject().Add("verdict", verdict).Add("reason", verification.reason).Close();
}

}  // namespace hulld
