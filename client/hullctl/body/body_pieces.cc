#include "client/hullctl/body/body_pieces.h"

#include <absl/strings/str_cat.h>

#include <cmath>
#include <memory>
#include <string_view>

#include "client/formats/byte_source.h"
#include "client/formats/text_number.h"
#include "client/hullctl/command_line/arguments.h"
#include "client/hullctl/printing/json.h"
#include "hulld/v1/body.pb.h"

namespace hulld {

absl::StatusOr<v1::Placement> ParsePiece(const std::string& text) {
  const size_t colon = text.find(':');
  const std::string placed = text.substr(0, colon);
  const size_t at = placed.find('@');
  v1::Placement piece;
  piece.set_hull_id(placed.substr(0, at));
  if (piece.hull_id().empty()) {
    return absl::InvalidArgumentError(absl::StrCat(
        Quoted(text), " names no hull; a piece is HULL[@[w,x,y,z,]tx,ty,tz][:RADIUS]"));
  }
  if (colon != std::string::npos) {
    double radius = 0;
    if (ParseDouble(text.substr(colon + 1), &radius) != NumberText::kNumber ||
        !std::isfinite(radius) || radius < 0) {
      return absl::InvalidArgumentError(
          absl::StrCat(Quoted(text), ": the radius after the colon is not a length of at least 0"));
    }
    piece.set_radius(radius);
  }
  if (at == std::string::npos) return piece;
  const absl::StatusOr<v1::Pose> pose = ParsePose(placed.substr(at + 1));
  if (!pose.ok()) {
    return absl::InvalidArgumentError(absl::StrCat(Quoted(text), ": ", pose.status().message()));
  }
  *piece.mutable_pose() = *pose;
  return piece;
}

absl::Status ReadPieces(const std::string& path, Pieces* pieces) {
  const absl::StatusOr<std::unique_ptr<ByteSource>> source = ByteSource::Open(path);
  if (!source.ok()) return source.status();
  std::string text;
  std::string_view line;
  while ((*source)->ReadLine(&line)) text.append(line).append("\n");
  if (absl::Status s = (*source)->status(); !s.ok()) return s;
  // Either the output of 'body get', or just its pieces.
  v1::GetBodyResponse body;
  if (absl::Status s = ParseJson(text, UnknownFields::kRefuse, &body); !s.ok()) {
    return absl::InvalidArgumentError(absl::StrCat((*source)->name(), ": ", s.message()));
  }
  if (body.pieces().empty()) {
    return absl::InvalidArgumentError(absl::StrCat(
        (*source)->name(), ": contains no pieces; write {\"pieces\":[{\"hullId\":\"arm\"}]}"));
  }
  pieces->MergeFrom(body.pieces());
  return absl::OkStatus();
}

std::string PoseText(const v1::Pose& pose) {
  const v1::Quaternion& q = pose.rotation();
  const v1::Vector3& t = pose.translation();
  const bool turns = q.x() != 0 || q.y() != 0 || q.z() != 0;
  const bool moves = t.x() != 0 || t.y() != 0 || t.z() != 0;
  if (!turns && !moves) return "";
  std::string text;
  if (turns) {
    for (const double number : {q.w(), q.x(), q.y(), q.z()}) {
      absl::StrAppend(&text, ShortestText(number), ",");
    }
  }
  return absl::StrCat(text, ShortestText(t.x()), ",", ShortestText(t.y()), ",",
                      ShortestText(t.z()));
}

}  // namespace hulld
