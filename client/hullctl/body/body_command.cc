#include <absl/strings/str_cat.h>
#include <absl/strings/str_join.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "client/formats/byte_source.h"
#include "client/formats/text_number.h"
#include "client/hullctl/command_line/arguments.h"
#include "client/hullctl/command_line/commands.h"
#include "client/hullctl/printing/json.h"
#include "client/hullctl/printing/table.h"

namespace hulld {
namespace {

struct BodyArguments {
  std::string body_id;
  std::vector<std::string> pieces;
  std::string file;
  std::string prefix;
  uint64_t limit = 0;
  bool if_exists = false;
  std::optional<uint64_t> if_revision;
};

// Parses "HULL[@POSE][:RADIUS]", with a pose as in ParsePose.
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

// Adds the pieces of a JSON file, as written by 'hullctl body get --output json': {"pieces":[...]}.
absl::Status ReadPieces(const std::string& path, v1::PutBodyRequest* request) {
  HULLD_ASSIGN_OR_RETURN(const auto text, ReadText(path));
  // Either the output of 'body get', or just its pieces.
  v1::GetBodyResponse body;
  if (absl::Status s = ParseJson(text, UnknownFields::kRefuse, &body); !s.ok()) {
    return absl::InvalidArgumentError(absl::StrCat(SourceName(path), ": ", s.message()));
  }
  if (body.pieces().empty()) {
    return absl::InvalidArgumentError(absl::StrCat(
        SourceName(path), ": contains no pieces; write {\"pieces\":[{\"hullId\":\"arm\"}]}"));
  }
  request->mutable_pieces()->MergeFrom(body.pieces());
  return absl::OkStatus();
}

// Returns a pose in the form of ParsePose, with as few numbers as possible; empty for the
// identity.
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

ExitCode PutBody(const Invocation& run, const BodyArguments& arguments) {
  v1::PutBodyRequest request;
  request.set_body_id(arguments.body_id);
  if (arguments.if_revision) request.set_if_revision(*arguments.if_revision);
  if (arguments.pieces.empty() == arguments.file.empty()) {
    return run.FailUsage(
        "pass the pieces as HULL[@POSE][:RADIUS] or with --pieces FILE, but not both");
  }
  for (const std::string& text : arguments.pieces) {
    HULLD_ASSIGN_OR_FAIL(run.FailUsage, const v1::Placement piece, ParsePiece(text));
    *request.add_pieces() = piece;
  }
  if (!arguments.file.empty()) {
    const absl::Status read = ReadPieces(arguments.file, &request);
    if (!read.ok()) return run.FailUsage(read);
  }
  HULLD_ASSIGN_OR_FAIL(run.Fail, const auto response, run.MakeClient().PutBody(request));
  if (!run.PrintForPrograms(response, response.body().body_id())) {
    run.out << response.body().body_id() << (response.created() ? " created" : " replaced")
            << " at revision " << response.body().revision() << ", "
            << Counted(response.body().piece_count(), "piece") << "\n";
  }
  return ExitCode::kDone;
}

ExitCode GetBody(const Invocation& run, const BodyArguments& arguments) {
  HULLD_ASSIGN_OR_FAIL(run.Fail, const auto response, run.MakeClient().GetBody(arguments.body_id));
  const auto ids = absl::StrJoin(
      response.pieces(), "\n",
      [](std::string* out, const v1::Placement& piece) { out->append(piece.hull_id()); });
  if (run.PrintForPrograms(response, ids)) return ExitCode::kDone;
  const v1::BodyInfo& body = response.body();
  run.out << body.body_id() << " at revision " << body.revision() << ", created at "
          << body.create_revision() << "\n";
  Table table;
  const bool has_radii = std::ranges::any_of(
      response.pieces(), [](const v1::Placement& piece) { return piece.radius() > 0; });
  std::vector<std::string> head = {"PIECE", "HULL", "POSE"};
  if (has_radii) head.push_back("RADIUS");
  table.Head(run.paint, head);
  for (int i = 0; i < response.pieces_size(); ++i) {
    const v1::Placement& piece = response.pieces(i);
    const std::string pose = PoseText(piece.pose());
    std::vector<std::string> row = {std::to_string(i), piece.hull_id(), pose.empty() ? "-" : pose};
    if (has_radii) row.push_back(ShortestText(piece.radius()));
    table.Row(row);
  }
  table.Print(run.out);
  return ExitCode::kDone;
}

ExitCode ListBodies(const Invocation& run, const BodyArguments& arguments) {
  HULLD_ASSIGN_OR_FAIL(run.Fail, const auto response,
                       run.MakeClient().ListAllBodies(arguments.prefix, arguments.limit));
  if (run.json()) {
    run.out << MessageJson(response) << "\n";
  } else if (run.names()) {
    for (const v1::BodyInfo& body : response.bodies()) run.out << body.body_id() << "\n";
  } else {
    Table table;
    table.Head(run.paint, {"BODY", "PIECES", "REVISION"});
    for (const v1::BodyInfo& body : response.bodies()) {
      table.Row({body.body_id(), body.damaged() ? "damaged" : std::to_string(body.piece_count()),
                 std::to_string(body.revision())});
    }
    table.Print(run.out);
  }
  if (!response.next_page_token().empty()) {
    run.err << "hullctl: there are more bodies; raise --limit to list them\n";
  }
  return ExitCode::kDone;
}

ExitCode DeleteBody(const Invocation& run, const BodyArguments& arguments) {
  const auto response = run.MakeClient().DeleteBody(arguments.body_id, arguments.if_revision);
  if (absl::IsNotFound(response.status()) && arguments.if_exists) return ExitCode::kDone;
  if (!response.ok()) return run.Fail(response.status());
  if (!run.PrintForPrograms(*response, arguments.body_id)) {
    run.out << arguments.body_id << " deleted at revision " << response->header().revision()
            << "\n";
  }
  return ExitCode::kDone;
}

using Arguments = std::shared_ptr<BodyArguments>;
void AddName(Command command, const Arguments& arguments) {
  command.AddText("ID", &arguments->body_id, "ID of the body")
      .Required()
      .Completes(ValueKind::kBody);
}

void AddIfRevision(Command command, const Arguments& arguments, const std::string& help) {
  command.AddNumber("--if-revision", 0, kAnyNumber, help, &arguments->if_revision);
}

void AddPut(Command body, Invocation* invocation, const Arguments& arguments) {
  Command put = body.AddCommand("put", "Create a body, or replace all of its pieces");
  AddName(put, arguments);
  put.AddTexts(
         "HULL[@POSE][:RADIUS]", &arguments->pieces,
         "Pieces: hulls, each at [w,x,y,z,]tx,ty,tz in the frame of the body (default: no motion), "
         "grown by a ball of the radius (default: 0)")
      .Completes(ValueKind::kHull);
  put.AddText("--pieces", &arguments->file,
              "JSON file of pieces, as 'body get --output json' writes it, instead of HULL; - "
              "is standard input")
      .ValueName("FILE");
  AddIfRevision(put, arguments,
                "Only if the body is at this revision; 0: only if it does not exist");
  put.SetExamples(
      {{"", "hullctl body put bracket plate rib@0,0.05,0 rib@0,-0.05,0"},
       {"Rotated by 90 degrees about z", "hullctl body put bracket plate rib@1,0,0,1,0,0,0"},
       {"With a margin", "hullctl body put bracket plate:0.002 rib@0,0.05,0:0.002"},
       {"A copy", "hullctl body get bracket --output json | hullctl body put copy --pieces -"}});
  OnGiven(put, invocation, arguments, PutBody);
}

}  // namespace

void AddBodyCommand(Command program, Invocation* invocation) {
  Command body =
      program.AddCommand("body", "Manage bodies: several hulls at fixed poses, treated as one");
  body.RequireCommand();
  const auto arguments = std::make_shared<BodyArguments>();
  body.SetDetails(
      "A body is a list of pieces, hulls at fixed poses, under one ID. Bodies and hulls share one\n"
      "namespace: 'check', 'batch', 'scene', 'stream', 'watch' and 'view' accept either. The\n"
      "relation of two bodies is the strongest over all pairs of pieces. A query uses the current\n"
      "version of each piece's hull.");
  AddPut(body, invocation, arguments);
  Command get = body.AddCommand("get", "Show the pieces of a body");
  AddName(get, arguments);
  AddFreshnessOptions(get, invocation);
  get.SetExamples({{"", "hullctl body get bracket"}});
  OnGiven(get, invocation, arguments, GetBody);
  Command list = body.AddCommand("list", "List the bodies");
  list.AddText("PREFIX", &arguments->prefix, "Only IDs with this prefix")
      .Completes(ValueKind::kBody);
  list.AddNumber("--limit", 1, 1000000000, "Stop after N bodies (default: all)", &arguments->limit);
  AddFreshnessOptions(list, invocation);
  list.SetExamples({{"", "hullctl body list cell-3/"}});
  OnGiven(list, invocation, arguments, ListBodies);
  Command remove = body.AddCommand("delete", "Delete a body; its hulls are kept");
  AddName(remove, arguments);
  remove.AddFlag("--if-exists", &arguments->if_exists, "Succeed if the body does not exist");
  AddIfRevision(remove, arguments, "Only if the body is at this revision");
  remove.SetExamples({{"", "hullctl body delete bracket"}});
  OnGiven(remove, invocation, arguments, DeleteBody);
}

}  // namespace hulld
