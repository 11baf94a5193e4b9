#include <absl/strings/str_cat.h>

#include <memory>
#include <unordered_map>

#include "client/formats/byte_source.h"
#include "client/hullctl/commands/commands.h"
#include "client/hullctl/printing/answer_row.h"
#include "client/hullctl/printing/json.h"

namespace hulld {
namespace {

// Prints the pairs of a scene as they come.
class SceneRun {
 public:
  SceneRun(const Invocation& run, const v1::FindCollisionsRequest& request)
      : run_(run), request_(request) {}

  absl::Status Run() {
    if (run_.json) run_.out << "{\"collisions\":[";
    absl::Status status = run_.MakeClient().FindCollisions(
        request_, [this](const v1::FindCollisionsResponse& part) { return Take(part); });
    if (status.ok() && !complete_) {
      status = absl::InternalError("the answers end without their totals");
    }
    PrintEnd(status.ok());
    return status;
  }

  // Placements and pairs without answer.
  uint64_t failed() const { return totals_.failed() + placement_problems_; }

 private:
  absl::Status Take(const v1::FindCollisionsResponse& part) {
    for (const v1::PlacementProblem& problem : part.placement_problems()) {
      ++placement_problems_;
      run_.err << "hullctl: placement " << problem.placement() << ": " << problem.message() << "\n";
    }
    std::unordered_map<uint64_t, std::string> problems;
    for (const v1::PairProblem& problem : part.columns().pair_problems()) {
      problems[problem.row()] = problem.message();
    }
    const int count = part.pairs_size() / 2;
    if (part.pairs_size() % 2 != 0 || !AreParallel(part.columns(), static_cast<size_t>(count))) {
      return absl::InternalError("the answer's columns and pairs disagree");
    }
    for (int i = 0; i < count; ++i) {
      const auto problem = problems.find(static_cast<uint64_t>(i));
      const std::string* const cause = problem == problems.end() ? nullptr : &problem->second;
      const uint32_t a = part.pairs(2 * i);
      const uint32_t b = part.pairs(2 * i + 1);
      if (HullIdOf(a) == nullptr || HullIdOf(b) == nullptr) {
        return absl::InternalError("the answer names a placement that there is not");
      }
      Print(a, b, RowAt(part.columns(), i), cause);
    }
    if (part.has_totals()) {
      totals_ = part.totals();
      complete_ = true;
    }
    return absl::OkStatus();
  }

  void Print(uint32_t a, uint32_t b, const AnswerRow& row, const std::string* cause) {
    if (run_.json) {
      JsonObject object;
      object.AddJson("a", std::to_string(a)).AddJson("b", std::to_string(b));
      AddRow(row, &object);
      if (cause != nullptr) object.Add("problem", *cause);
      run_.out << (printed_++ > 0 ? ",\n" : "\n") << object.Close();
      return;
    }
    run_.out << Name(a) << "\t" << Name(b) << "\t"
             << (cause != nullptr ? "FAILED\t" + *cause : RowText(row)) << "\n";
  }

  // Null where there is no such placement.
  const std::string* HullIdOf(uint32_t placement) const {
    const v1::PackedPlacements& packed = request_.packed_placements();
    if (placement < static_cast<uint32_t>(request_.placements_size())) {
      return &request_.placements(static_cast<int>(placement)).hull_id();
    }
    if (placement >= static_cast<uint32_t>(packed.hulls_size())) return nullptr;
    const uint32_t hull = packed.hulls(static_cast<int>(placement));
    if (hull >= static_cast<uint32_t>(packed.hull_ids_size())) return nullptr;
    return &packed.hull_ids(static_cast<int>(hull));
  }

  std::string Name(uint32_t placement) const {
    return absl::StrCat(placement, ":", *HullIdOf(placement));
  }

  void PrintEnd(bool ok) {
    if (run_.json) {
      run_.out << "],\n\"complete\":" << (ok ? "true" : "false")
               << ",\n\"totals\":" << MessageJson(totals_) << "}\n";
      return;
    }
    if (!ok) return;
    run_.out << "# touching " << totals_.touching() << " overlapping " << totals_.overlapping();
    if (request_.tolerance() > 0) run_.out << " within_tolerance " << totals_.within_tolerance();
    if (request_.wanted().has_clearance()) run_.out << " separated " << totals_.separated();
    run_.out << " failed " << totals_.failed() << "\n";
  }

  const Invocation& run_;
  const v1::FindCollisionsRequest& request_;
  v1::SceneTotals totals_;
  bool complete_ = false;
  uint64_t printed_ = 0;
  uint64_t placement_problems_ = 0;
};

ExitCode Scene(const Invocation& run, const std::string& path) {
  const absl::StatusOr<std::string> text = ReadText(path);
  if (!text.ok()) return run.FailUsage(text.status());
  v1::FindCollisionsRequest request;
  const absl::Status parsed = ParseJson(*text, UnknownFields::kRefuse, &request);
  if (!parsed.ok()) {
    return run.FailUsage(absl::InvalidArgumentError(absl::StrCat(path, ": ", parsed.message())));
  }
  SceneRun scene(run, request);
  if (absl::Status status = scene.Run(); !status.ok()) return run.Fail(status);
  if (scene.failed() == 0) return ExitCode::kDone;
  run.err << "hullctl: " << scene.failed() << " placements or pairs have no answer\n";
  return ExitCode::kSomeFailed;
}

}  // namespace

void AddSceneCommand(Command program, Invocation* invocation) {
  auto path = std::make_shared<std::string>();
  Command command = program.AddCommand("scene", "Find all pairs of a scene that collide");
  command.AddText("FILE", path.get(), "The scene as JSON; - is standard input").Required();
  command.SetFooter(
      "FILE is a FindCollisionsRequest of the contract as JSON. Placements are named by their\n"
      "index. Optional: a group for each placement, and which groups never collide; movers N, to\n"
      "ask only about pairs with one of the first N; tolerance; and what is wanted, such\n"
      "as a clearance, within which pairs are found although they are separated. For example:\n"
      "  {\"placements\":[{\"hullId\":\"arm\"},\n"
      "                 {\"hullId\":\"box\",\"pose\":{\"translation\":{\"x\":2}}},\n"
      "                 {\"hullId\":\"box\",\"pose\":{\"rotation\":{\"w\":1,\"z\":1}}}],\n"
      "   \"groups\":[0,1,1], \"ignoreSameGroup\":true, \"wanted\":{\"clearance\":0.1}}\n"
      "Many placements are read faster as packedPlacements: the IDs of the hulls, the index of\n"
      "each placement's hull, and its pose in seven numbers, w x y z and x y z:\n"
      "  {\"packedPlacements\":{\"hullIds\":[\"arm\",\"box\"], \"hulls\":[0,1],\n"
      "                       \"poses\":[1,0,0,0, 0,0,0,  1,0,0,0, 2,0,0]}}");
  command.OnGiven([=] { invocation->action = [=] { return Scene(*invocation, *path); }; });
}

}  // namespace hulld
