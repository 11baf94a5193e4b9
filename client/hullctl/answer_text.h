#ifndef HULLD_CLIENT_HULLCTL_ANSWER_TEXT_H_
#define HULLD_CLIENT_HULLCTL_ANSWER_TEXT_H_

#include <string>

#include "hulld/v1/collision.pb.h"

namespace hulld {

// Words for people, for the fields of a collision's answer.

// "SEPARATED", "TOUCHING", "OVERLAPPING"; "-" when there is none.
std::string RelationText(v1::Relation relation);
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
std::string DirectionText(const v1::Vector3& direction);

}  // namespace hulld

#endif  // HULLD_CLIENT_HULLCTL_ANSWER_TEXT_H_
