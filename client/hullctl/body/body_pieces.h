#ifndef HULLD_CLIENT_HULLCTL_BODY_BODY_PIECES_H_
#define HULLD_CLIENT_HULLCTL_BODY_BODY_PIECES_H_

#include <absl/status/status.h>
#include <absl/status/statusor.h>
#include <google/protobuf/repeated_field.h>

#include <string>

#include "hulld/v1/collision.pb.h"
#include "hulld/v1/geometry.pb.h"

namespace hulld {

using Pieces = google::protobuf::RepeatedPtrField<v1::Placement>;

// Parses "HULL[@POSE][:RADIUS]", with a pose as in ParsePose.
absl::StatusOr<v1::Placement> ParsePiece(const std::string& text);

// Adds the pieces of a JSON file, as written by 'hullctl body get --output json': {"pieces":[...]};
// "-" is standard input. INVALID_ARGUMENT and NOT_FOUND name the file.
absl::Status ReadPieces(const std::string& path, Pieces* pieces);

// Returns a pose in the form of ParsePose, with as few numbers as possible; empty for the
// identity.
std::string PoseText(const v1::Pose& pose);

}  // namespace hulld

#endif  // HULLD_CLIENT_HULLCTL_BODY_BODY_PIECES_H_
