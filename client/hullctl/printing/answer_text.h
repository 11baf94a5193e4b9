#ifndef HULLD_CLIENT_HULLCTL_PRINTING_ANSWER_TEXT_H_
#define HULLD_CLIENT_HULLCTL_PRINTING_ANSWER_TEXT_H_

#include <string>

#include "client/hullctl/printing/painter.h"
#include "client/verify/answer_check.h"
#include "hulld/v1/collision.pb.h"

namespace hulld {

// Formats the fields of a collision answer for people.

// "SEPARATED", "TOUCHING", "OVERLAPPING"; "-" if unspecified.
std::string RelationText(v1::Relation relation);
std::string PaintedRelation(v1::Relation relation, const Painter& paint);
// "FACET_A" and so on.
std::string AxisKindText(v1::AxisKind kind);
std::string RungText(v1::Rung rung);
// "1.5 ms", with three digits.
std::string DurationText(const google::protobuf::Duration& duration);
// "8 vertices, 12 edges, 6 facets".
std::string HullSizeText(const v1::HullSize& size);
// "FACET_B, axis 7 of 30", or "nowhere".
std::string StageText(const v1::Analysis& analysis);
// "0.1 0.2 0.3".
std::string VectorText(double x, double y, double z);
inline std::string VectorText(const v1::Vector3& v) { return VectorText(v.x(), v.y(), v.z()); }
// "n = 0 0 1; A 3 with B 5, A 0 with B 2"; long integers by their number of digits.
std::string CertificateText(const v1::Certificate& certificate);
// "-0.25 within 1e-16".
std::string SeparationText(const v1::Separation& separation);
// "0 1 0 within 1e-15 rad".
std::string NormalText(const v1::Normal& normal);
// "valid", or the verdict and the reason.
std::string VerificationText(const Verification& verification, const Painter& paint);
// {"verdict":"INVALID","reason":...}
std::string VerificationJson(const Verification& verification);

}  // namespace hulld

#endif  // HULLD_CLIENT_HULLCTL_PRINTING_ANSWER_TEXT_H_
