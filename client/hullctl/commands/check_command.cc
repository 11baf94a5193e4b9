#include <absl/strings/str_cat.h>

#include <algorithm>
#include <filesystem>
#include <functional>
#include <initializer_list>
#include <memory>
#include <optional>
#include <string>
#include <system_error>
#include <utility>

#include "client/formats/point_file.h"
#include "client/formats/text_number.h"
#include "client/hullctl/command_line/arguments.h"
#include "client/hullctl/command_line/commands.h"
#include "client/hullctl/command_line/query_options.h"
#include "client/hullctl/local/file_shape.h"
#include "client/hullctl/pairs/point_check.h"
#include "client/hullctl/printing/answer_text.h"
#include "client/hullctl/printing/json.h"
#include "client/hullctl/printing/table.h"
#include "client/verify/answer_check.h"

namespace hulld {
namespace {

struct PairArguments {
  // IDs, or files with points.
  std::string a;
  std::string b;
  // Without IDs.
  v1::CheckCollisionRequest request;
  QueryDetails details;
  std::string record;
  // End poses of motions, as parsed.
  std::optional<v1::Pose> to_a;
  std::optional<v1::Pose> to_b;
  // A file with points that replaces B.
  std::string points;
};

std::string VersionText(const v1::HullVersion& hull) {
  return hull.hull_id() + "  (revision " + std::to_string(hull.revision()) + ")";
}

// Returns the name of the hull, body, or file of a side.
std::string SideText(const v1::Placement& placement, const v1::HullVersion& hull,
                     const std::string& argument) {
  if (!placement.has_points()) return VersionText(hull);
  return argument + "  (" +
         Counted(static_cast<uint64_t>(placement.points().xyz_size()) / 3, "point") + ")";
}

// Appends the radius of a side, if it has one.
std::string WithRadius(const std::string& side, const v1::Placement& placement) {
  return placement.radius() == 0 ? side : side + ", radius " + ShortestText(placement.radius());
}

std::string PieceText(const v1::DecidingPiece& piece) {
  return std::to_string(piece.index()) + ": " + VersionText(piece.hull());
}

// Adds the deciding pieces of bodies.
void AddPieces(const v1::CheckCollisionResponse& response, Table* table) {
  if (response.has_piece_a()) table->Row({"piece of A", PieceText(response.piece_a())});
  if (response.has_piece_b()) table->Row({"piece of B", PieceText(response.piece_b())});
}

// Returns the proof of the relation. For bodies it is a list intended for programs.
std::string ProofText(const v1::CheckCollisionResponse& response) {
  if (!response.piece_hulls().empty()) {
    const int count = response.piece_certificates_size();
    const std::string pairs = count == 1 ? " pair of pieces" : " pairs of pieces";
    const bool by_boxes =
        response.relation() != v1::RELATION_OVERLAPPING && !response.has_first_contact();
    return "of " + std::to_string(count) + pairs +
           (by_boxes ? "; bounding boxes decide the rest" : "");
  }
  if (!response.has_first_contact()) return CertificateText(response.certificate());
  const auto count = static_cast<uint64_t>(response.first_contact().intervals_size());
  const std::string separated = Counted(count, "interval");
  if (!response.has_certificate()) return separated;
  return separated + "; contact: " + CertificateText(response.certificate());
}

std::string FeatureText(const v1::Feature& feature) {
  constexpr int kShown = 8;
  std::string text = feature.vertex_indices_size() == 1 ? "vertex" : "vertices";
  for (int i = 0; i < feature.vertex_indices_size() && i < kShown; ++i) {
    text += " " + std::to_string(feature.vertex_indices(i));
  }
  if (feature.vertex_indices_size() > kShown) {
    text += " ... (" + std::to_string(feature.vertex_indices_size()) + " in all)";
  }
  if (feature.has_facet_index()) text += ", facet " + std::to_string(feature.facet_index());
  return text;
}

void AddAnalysis(const v1::Analysis& analysis, Table* table) {
  std::string axes = std::to_string(analysis.axes_tested());
  if (analysis.axes_total() > 0) axes += " of " + std::to_string(analysis.axes_total());
  table->Row({"time", DurationText(analysis.time())})
      .Row({"size of A", HullSizeText(analysis.size_a())})
      .Row({"size of B", HullSizeText(analysis.size_b())})
      .Row({"axes tested", axes})
      .Row({"found at", StageText(analysis)});
}

void AddAxis(const v1::CheckCollisionResponse& response, Table* table) {
  if (!response.has_axis()) {
    table->Row({"axis", "no separating or touching axis"});
    return;
  }
  const v1::Axis& axis = response.axis();
  table->Row({"axis", VectorText(axis.direction()) + "  (" + AxisKindText(axis.kind()) + ")"})
      .Row({"A reaches", FeatureText(axis.feature_a())})
      .Row({"B reaches", FeatureText(axis.feature_b())});
}

void AddMeasures(const v1::CheckCollisionRequest& request,
                 const v1::CheckCollisionResponse& response, Table* table) {
  if (response.has_separation()) {
    table->Row({"separation", SeparationText(response.separation())});
  }
  if (response.has_witness()) {
    const v1::Witness& witness = response.witness();
    table->Row({"point of A", VectorText(witness.point_a())})
        .Row({"point of B", VectorText(witness.point_b())})
        .Row({"points within", ShortestText(witness.error())});
  }
  if (response.has_normal()) {
    table->Row({"normal", NormalText(response.normal())});
  }
  if (response.has_within_clearance()) {
    const std::string clearance = ShortestText(request.wanted().clearance());
    table->Row({"clearance", (response.within_clearance() ? "within " : "more than ") + clearance});
  }
}

void AddFirstContact(const v1::FirstContact& contact, Table* table) {
  table->Row({"separated until", ShortestText(contact.separated_until())});
  if (contact.has_contact_time()) {
    table->Row({"first contact", ShortestText(contact.contact_time())});
  }
}

void PrintAnswerTable(const Invocation& run, const PairArguments& arguments,
                      const v1::CheckCollisionRequest& request,
                      const v1::CheckCollisionResponse& response,
                      const Verification* verification) {
  Table table;
  table.Row({"relation", PaintedRelation(response.relation(), run.paint)})
      .Row({"A", WithRadius(SideText(request.a(), response.hull_a(), arguments.a), request.a())})
      .Row({"B", WithRadius(SideText(request.b(), response.hull_b(), arguments.b), request.b())});
  if (response.has_first_contact()) {
    AddFirstContact(response.first_contact(), &table);
  } else {
    table.Row({"decided by", RungText(response.rung())});
  }
  AddPieces(response, &table);
  AddMeasures(request, response, &table);
  if (request.wanted().axis()) AddAxis(response, &table);
  if (request.wanted().certificate()) {
    table.Row({"certificate", ProofText(response)});
  }
  if (verification != nullptr) table.Row({"verified", VerificationText(*verification, run.paint)});
  if (response.has_analysis()) {
    const bool textbook = request.method() == v1::METHOD_TEXTBOOK_SAT;
    table.Row({"method", textbook ? "textbook SAT" : "certified search"});
    AddAnalysis(response.analysis(), &table);
  }
  if (run.wide()) {
    table.Row({"store", response.header().store_id()})
        .Row({"store revision", std::to_string(response.header().revision())});
    if (response.header().has_staleness()) {
      table.Row({"stale by at most", DurationText(response.header().staleness())});
    }
  }
  table.Print(run.out);
}

// Returns the query and its answer, the input of `hullctl verify`.
std::string RecordJson(const v1::CheckCollisionRequest& request,
                       const v1::CheckCollisionResponse& response) {
  return JsonObject()
      .AddJson("request", MessageJson(request))
      .AddJson("response", MessageJson(response))
      .Close();
}

void PrintAnswer(const Invocation& run, const PairArguments& arguments,
                 const v1::CheckCollisionRequest& request,
                 const v1::CheckCollisionResponse& response, const Verification* verification) {
  if (!run.PrintForPrograms(response, RelationText(response.relation()))) {
    PrintAnswerTable(run, arguments, request, response, verification);
  }
}

// Sets the shape of a placement from an ID or a file.
absl::Status SetSide(const Invocation& run, const std::string& argument, v1::Placement* placement) {
  placement->set_hull_id(argument);
  return IsShapeFile(argument) ? SetShape(run, argument, placement) : absl::OkStatus();
}

// The name of an option or argument, and true if it is given.
using Given = std::pair<bool, const char*>;

// Returns the name of the first one that is given, or null.
const char* FirstGiven(std::initializer_list<Given> options) {
  const auto found = std::ranges::find(options, true, &Given::first);
  return found == options.end() ? nullptr : found->second;
}

// INVALID_ARGUMENT: an option that applies only to pairs is combined with --points.
absl::Status CheckPointOptions(const PairArguments& arguments) {
  const v1::Wanted& wanted = arguments.details.wanted;
  const char* const name =
      FirstGiven({{!arguments.b.empty(), "B"},
                  {arguments.request.b().has_pose(), "--pose-b"},
                  {arguments.to_a.has_value(), "--to-a"},
                  {arguments.to_b.has_value(), "--to-b"},
                  {arguments.request.b().radius() > 0, "--radius-b"},
                  {arguments.details.verify, "--verify"},
                  {!arguments.record.empty(), "--record"},
                  {wanted.axis(), "--axis"},
                  {wanted.analysis(), "--report"},
                  {wanted.certificate(), "--certificate"},
                  {wanted.witness(), "--witness"},
                  {wanted.normal(), "--normal"},
                  {wanted.has_clearance(), "--clearance"},
                  {arguments.details.tolerance.has_value(), "--tolerance"},
                  {arguments.details.method != v1::METHOD_UNSPECIFIED, "--textbook"},
                  {wanted.has_max_time_error(), "--max-time-error"},
                  {wanted.has_resolution(), "--resolution"}});
  if (name == nullptr) return absl::OkStatus();
  return absl::InvalidArgumentError(
      absl::StrCat("--points can be combined only with --pose-a, --radius-a, --separation, and "
                   "--max-error; remove ",
                   name));
}

// INVALID_ARGUMENT: two options exclude each other. The server refuses them as well, but names the
// fields of the contract.
absl::Status CheckConflicts(const PairArguments& arguments) {
  const v1::Wanted& wanted = arguments.details.wanted;
  const Given textbook = {arguments.details.method == v1::METHOD_TEXTBOOK_SAT, "--textbook"};
  const Given tolerance = {arguments.details.tolerance.value_or(0) > 0, "--tolerance"};
  const Given max_error = {wanted.has_max_error(), "--max-error"};
  const Given separation = {wanted.separation(), "--separation"};
  const Given witness = {wanted.witness(), "--witness"};
  const Given normal = {wanted.normal(), "--normal"};
  const Given clearance = {wanted.has_clearance(), "--clearance"};
  const auto error = [](const std::string& problem) { return absl::InvalidArgumentError(problem); };
  const bool moves = arguments.to_a.has_value() || arguments.to_b.has_value();
  const char* const measure = FirstGiven({{wanted.axis(), "--axis"},
                                          {wanted.analysis(), "--report"},
                                          max_error,
                                          separation,
                                          witness,
                                          normal,
                                          clearance,
                                          tolerance,
                                          textbook});
  if (moves && measure != nullptr) {
    return error(
        absl::StrCat(measure,
                     " applies to a pose, but --to-a and --to-b define a motion; query the "
                     "first contact, then query again at its pose"));
  }
  const char* const limit = FirstGiven({{wanted.has_max_time_error(), "--max-time-error"},
                                        {wanted.has_resolution(), "--resolution"}});
  if (!moves && limit != nullptr) {
    return error(absl::StrCat(limit, " applies to a motion; add --to-a or --to-b"));
  }
  const char* const exact = FirstGiven({textbook,
                                        {arguments.details.verify, "--verify"},
                                        {!arguments.record.empty(), "--record"},
                                        {wanted.certificate(), "--certificate"},
                                        max_error,
                                        separation,
                                        witness,
                                        normal,
                                        clearance});
  if (tolerance.first && exact != nullptr) {
    return error(absl::StrCat(exact, " needs the exact relation; remove it or --tolerance"));
  }
  const char* const radius = FirstGiven({{arguments.request.a().radius() > 0, "--radius-a"},
                                         {arguments.request.b().radius() > 0, "--radius-b"}});
  if (textbook.first && radius != nullptr) {
    return error(absl::StrCat("--textbook does not support radii; remove it or ", radius));
  }
  return absl::OkStatus();
}

// Returns the error. If an unknown ID looks like a file name, adds an explanation why no file of
// that name was read.
absl::Status WithFileHint(const absl::Status& error, const PairArguments& arguments) {
  for (const std::string& name : {arguments.a, arguments.b}) {
    const std::string missing = absl::StrCat("hull ", Quoted(name), " not found");
    if (!absl::IsNotFound(error) || error.message() != missing || IsShapeFile(name)) continue;
    const auto format = PointFormatOfPath(name);
    std::error_code ignored;
    if (format.ok()) return absl::NotFoundError(missing + ", and no such file");
    if (!std::filesystem::is_regular_file(name, ignored)) continue;
    return absl::NotFoundError(absl::StrCat(missing, "; ", format.status().message()));
  }
  return error;
}

ExitCode CheckPointsOfFile(const Invocation& run, const PairArguments& arguments) {
  absl::Status status = CheckPointOptions(arguments);
  v1::Placement hull = arguments.request.a();
  if (status.ok()) status = SetSide(run, arguments.a, &hull);
  if (!status.ok()) return run.FailUsage(status);
  return CheckPoints(run, hull, arguments.points, arguments.details.wanted);
}

ExitCode CheckPair(const Invocation& run, const PairArguments& arguments) {
  if (absl::Status status = CheckConflicts(arguments); !status.ok()) return run.FailUsage(status);
  v1::CheckCollisionRequest request = arguments.request;
  if (arguments.to_a) SetMotion(*arguments.to_a, request.mutable_a());
  if (arguments.to_b) SetMotion(*arguments.to_b, request.mutable_b());
  absl::Status status = SetSide(run, arguments.a, request.mutable_a());
  if (status.ok()) status = SetSide(run, arguments.b, request.mutable_b());
  if (!status.ok()) return run.FailUsage(status);
  arguments.details.Apply(&request);
  request.set_method(arguments.details.method);
  const Client client = run.MakeClient();
  VerifiedResponse answer;
  const Verification* const verification =
      arguments.details.verify ? &answer.verification : nullptr;
  if (verification != nullptr) {
    auto verified = CheckCollisionVerified(client, request);
    if (!verified.ok()) return run.Fail(WithFileHint(verified.status(), arguments));
    answer = *std::move(verified);
  } else {
    auto response = client.CheckCollision(request);
    if (!response.ok()) return run.Fail(WithFileHint(response.status(), arguments));
    answer.response = *std::move(response);
  }
  // A record on standard output replaces the answer.
  if (arguments.record != "-") PrintAnswer(run, arguments, request, answer.response, verification);
  if (!arguments.record.empty()) {
    const ExitCode written = run.WriteFile(arguments.record, [&](std::ostream& out) {
      out << RecordJson(request, answer.response) << "\n";
    });
    if (written != ExitCode::kDone) return written;
  }
  return verification == nullptr ? ExitCode::kDone : run.Judge(*verification);
}

ExitCode Check(const Invocation& run, const PairArguments& arguments) {
  if (!arguments.points.empty()) return CheckPointsOfFile(run, arguments);
  if (!arguments.b.empty()) return CheckPair(run, arguments);
  return run.FailUsage("B is required: 'hullctl check A B', or 'hullctl check A --points FILE'");
}

void AddPoseOption(Command command, const std::string& name, const char* help,
                   const std::function<void(const v1::Pose&)>& take) {
  command
      .AddParsed(
          name,
          [take](const std::string& text) {
            const auto pose = ParsePose(text);
            if (pose.ok()) take(*pose);
            return pose.status();
          },
          help)
      .ValueName("[w,x,y,z,]tx,ty,tz");
}

void AddPoseOptions(Command command, PairArguments* arguments) {
  v1::CheckCollisionRequest* const request = &arguments->request;
  constexpr char kPoseHelp[] =
      "Pose: quaternion and translation, or translation alone (default: no motion)";
  AddPoseOption(command, "--pose-a", kPoseHelp,
                [=](const v1::Pose& pose) { *request->mutable_a()->mutable_pose() = pose; });
  AddPoseOption(command, "--pose-b", kPoseHelp,
                [=](const v1::Pose& pose) { *request->mutable_b()->mutable_pose() = pose; });
  constexpr char kEndHelp[] =
      "Move to this pose, and find the first contact; a translation alone keeps the rotation";
  AddPoseOption(command, "--to-a", kEndHelp, [=](const v1::Pose& pose) { arguments->to_a = pose; });
  AddPoseOption(command, "--to-b", kEndHelp, [=](const v1::Pose& pose) { arguments->to_b = pose; });
}

void AddMotionOptions(Command command, v1::Wanted* wanted) {
  command
      .AddLength(
          "--max-time-error",
          "Maximum width of the bracket around the first contact, in units of the whole motion "
          "(default 2^-30)",
          [wanted](double width) { wanted->set_max_time_error(width); })
      .ValueName("TIME");
  command.AddLength(
      "--resolution",
      "Allow the answer WITHIN_TOLERANCE if a rotating motion comes this close without a proven "
      "contact (default: 1e-9 times the sizes)",
      [wanted](double length) { wanted->set_resolution(length); });
}

}  // namespace

void AddCheckCommand(Command program, Invocation* invocation) {
  auto arguments = std::make_shared<PairArguments>();
  v1::CheckCollisionRequest* const request = &arguments->request;
  Command command = program.AddCommand("check", "Check two hulls, bodies, or files for collision");
  constexpr char kSideHelp[] = "ID of a hull or body, or a file with points";
  command.AddText("A", &arguments->a, kSideHelp).Required().Completes(ValueKind::kShape);
  command.AddText("B", &arguments->b, kSideHelp).Completes(ValueKind::kShape);
  AddPoseOptions(command, arguments.get());
  command.AddLength("--radius-a", "Grow A by a ball of this radius: a point becomes a sphere",
                    [request](double radius) { request->mutable_a()->set_radius(radius); });
  command.AddLength("--radius-b", "Grow B by a ball of this radius",
                    [request](double radius) { request->mutable_b()->set_radius(radius); });
  command
      .AddText("--points", &arguments->points,
               "Instead of checking a pair, show which points of a file are inside A, on its "
               "boundary, or outside; - is standard input")
      .ValueName("FILE");
  AddQueryOptions(command, &arguments->details);
  AddMotionOptions(command, &arguments->details.wanted);
  AddFreshnessOptions(command, invocation);
  PairArguments* const checked = arguments.get();
  command
      .AddParsed(
          "--record",
          [checked](const std::string& path) {
            checked->record = path;
            checked->details.wanted.set_certificate(true);
            return absl::OkStatus();
          },
          "Record the request and the answer with its certificate, for 'hullctl verify'; - writes "
          "the record to standard output, in place of the answer")
      .ValueName("FILE");
  command.SetDetails(
      "The hull of a file is sent with the query and never stored; the formats are those of "
      "'hullctl\n"
      "append'. A file without an extension needs a path, such as ./part. Lengths are in the unit\n"
      "of the points. For a body ('hullctl body --help'), the answer names the deciding pieces,\n"
      "and its certificate has one part for each pair of pieces that bounding boxes do not\n"
      "decide; --output json shows them. --textbook supports neither bodies nor radii.\n"
      "\n"
      "--to-a and --to-b define a motion, from time 0 to time 1, with quaternion and translation\n"
      "linear in time. Of the two quaternions of the end rotation, hullctl picks the one with the\n"
      "shorter path. The relation covers all times, and no contact is missed.");
  command.SetExamples(
      {{"Do they collide?", "hullctl check arm box --pose-b 0.2,0,0"},
       {"How far apart are they, and where?",
        "hullctl check arm box --pose-b 0.2,0,0 --separation --witness"},
       {"Which way out is shortest?", "hullctl check arm box --separation --normal"},
       {"Are they within a centimeter?", "hullctl check arm box --clearance 0.01"},
       {"With a margin of 2 mm about the arm", "hullctl check arm box --radius-a 0.002"},
       {"Two files, without a server", "hullctl check a.stl b.stl --local"},
       {"When do they meet?", "hullctl check arm box --pose-b 2,0,0 --to-b 0.5,0,0"},
       {"Which points of a cloud are inside, and how deep?",
        "hullctl check arm --points cloud.ply --separation"},
       {"Prove it", "hullctl check arm box --verify"},
       {"Record the answer, and verify it later", "hullctl check arm box --record answer.json"},
       {"", "hullctl verify answer.json"}});
  OnGiven(command, invocation, arguments, Check);
}

}  // namespace hulld
