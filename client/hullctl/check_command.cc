#include <CLI/CLI.hpp>
#include <memory>

#include "client/hullctl/answer_text.h"
#include "client/hullctl/arguments.h"
#include "client/hullctl/commands.h"
#include "client/hullctl/json.h"
#include "client/hullctl/table.h"

namespace hulld {
namespace {

struct CheckArguments {
  v1::CheckCollisionRequest request;
  bool textbook = false;
};

std::string VersionText(const v1::HullVersion& hull) {
  return hull.hull_id() + "  (revision " + std::to_string(hull.revision()) + ")";
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

ExitCode Check(const Invocation& run, const CheckArguments& arguments) {
  const auto response = run.MakeClient().CheckCollision(arguments.request);
  if (!response.ok()) return run.Fail(response.status());
  if (run.json) {
    run.out << MessageJson(*response) << "\n";
    return ExitCode::kDone;
  }
  Table table;
  table.Row({"relation", RelationText(response->relation())})
      .Row({"A", VersionText(response->hull_a())})
      .Row({"B", VersionText(response->hull_b())})
      .Row({"decided by", RungText(response->rung())});
  if (response->has_axis()) {
    const v1::Axis& axis = response->axis();
    table.Row({"axis", DirectionText(axis.direction()) + "  (" + AxisKindText(axis.kind()) + ")"})
        .Row({"A reaches", FeatureText(axis.feature_a())})
        .Row({"B reaches", FeatureText(axis.feature_b())});
  } else if (arguments.request.wanted().axis()) {
    table.Row({"axis", "none separates or touches"});
  }
  if (response->has_analysis()) {
    const bool textbook = arguments.request.method() == v1::METHOD_TEXTBOOK_SAT;
    table.Row({"method", textbook ? "textbook SAT" : "certified search"});
    AddAnalysis(response->analysis(), &table);
  }
  table.Print(run.out);
  return ExitCode::kDone;
}

void AddPoseOption(CLI::App* command, const std::string& name, v1::Placement* placement) {
  command
      ->add_option_function<std::string>(
          name,
          [name, placement](const std::string& text) {
            const auto pose = ParsePose(text);
            if (!pose.ok()) {
              throw CLI::ValidationError(name, std::string(pose.status().message().data(),
                                                           pose.status().message().size()));
            }
            *placement->mutable_pose() = *pose;
          },
          "Where it stands: quaternion and translation, or translation alone (default: as built)")
      ->type_name("[w,x,y,z,]tx,ty,tz");
}

}  // namespace

void AddCheckCommand(CLI::App* app, Invocation* invocation) {
  auto arguments = std::make_shared<CheckArguments>();
  v1::CheckCollisionRequest* const request = &arguments->request;
  CLI::App* command = app->add_subcommand("check", "Ask whether two hulls collide");
  command->add_option("A", *request->mutable_a()->mutable_hull_id(), "Name of a hull")->required();
  command->add_option("B", *request->mutable_b()->mutable_hull_id(), "Name of a hull")->required();
  AddPoseOption(command, "--pose-a", request->mutable_a());
  AddPoseOption(command, "--pose-b", request->mutable_b());
  command->add_flag_callback(
      "--textbook", [request] { request->set_method(v1::METHOD_TEXTBOOK_SAT); },
      "Use the textbook's separating-axis test instead of the certified search");
  command->add_flag_callback(
      "--axis", [request] { request->mutable_wanted()->set_axis(true); },
      "Also show the separating or touching axis and the features on it");
  command->add_flag_callback(
      "--report", [request] { request->mutable_wanted()->set_analysis(true); },
      "Also show time, sizes, axes tested and where separation was found");
  command->callback([=] { invocation->action = [=] { return Check(*invocation, *arguments); }; });
}

}  // namespace hulld
