#include <absl/strings/str_cat.h>

#include <algorithm>
#include <map>
#include <memory>
#include <utility>

#include "client/base/status_macros.h"
#include "client/enclosure/coverage.h"
#include "client/formats/text_number.h"
#include "client/hullctl/command_line/commands.h"
#include "client/hullctl/printing/answer_text.h"
#include "client/hullctl/printing/json.h"
#include "client/hullctl/printing/progress_bar.h"
#include "client/packed_placements.h"

namespace hulld {
namespace {

// Default maximum number of listed uncovered triangles, farthest first.
constexpr uint64_t kDefaultLimit = 10;

struct CoverArguments {
  // Hulls, then the mesh.
  std::vector<std::string> words;
  uint64_t limit = kDefaultLimit;
};

// Collects pieces; fetches each hull once.
class PieceFetcher {
 public:
  explicit PieceFetcher(const Client& client) : client_(client) {}

  // Adds a hull, the pieces of a body, or, for a word that ends with a slash, all hulls with that
  // prefix.
  absl::Status Add(const std::string& word) {
    if (word.back() == '/') return AddAll(word);
    const absl::Status added = AddHull(word, kNoMotion);
    if (!absl::IsNotFound(added)) return added;
    const auto body = client_.GetBody(word);
    // An unknown ID is reported as a missing hull.
    if (absl::IsNotFound(body.status())) return added;
    if (!body.ok()) return body.status();
    for (int i = 0; i < body->pieces_size(); ++i) {
      const v1::Placement& piece = body->pieces(i);
      if (piece.radius() > 0) {
        return absl::InvalidArgumentError(
            absl::StrCat("body ", Quoted(word), ": piece ", i,
                         " has a radius; 'cover' supports only pieces without one"));
      }
      const absl::Status taken = AddHull(piece.hull_id(), NumbersOf(piece.pose()));
      if (absl::IsNotFound(taken)) {
        return absl::NotFoundError(
            absl::StrCat("body ", Quoted(word), ": piece ", i, ": ", taken.message()));
      }
      if (!taken.ok()) return taken;
    }
    return absl::OkStatus();
  }

  std::vector<CoveringPiece> Take() { return std::move(pieces_); }

 private:
  absl::Status AddAll(const std::string& prefix) {
    HULLD_ASSIGN_OR_RETURN(const auto list, client_.ListAllHulls(prefix));
    if (list.hulls().empty()) {
      return absl::NotFoundError(absl::StrCat("no hull ID starts with ", Quoted(prefix)));
    }
    for (const v1::HullInfo& hull : list.hulls()) {
      HULLD_RETURN_IF_ERROR(AddHull(hull.hull_id(), kNoMotion));
    }
    return absl::OkStatus();
  }

  absl::Status AddHull(const std::string& id, const RigidPose& X_WH) {
    std::shared_ptr<const HullMesh>& mesh = meshes_[id];
    if (mesh == nullptr) {
      HULLD_ASSIGN_OR_RETURN(auto fetched, client_.GetHullMesh(id));
      mesh = std::make_shared<const HullMesh>(std::move(fetched));
    }
    pieces_.push_back({mesh, X_WH});
    return absl::OkStatus();
  }

  const Client& client_;
  std::map<std::string, std::shared_ptr<const HullMesh>> meshes_;
  std::vector<CoveringPiece> pieces_;
};

void PrintCoverageJson(const Invocation& run, const TriangleMesh& mesh, const Coverage& coverage) {
  JsonObject object;
  object.AddJson("enclosed", coverage.uncovered.empty() ? "true" : "false")
      .Add("triangles", uint64_t{mesh.triangles.size()})
      .Add("outside", uint64_t{coverage.uncovered.size()});
  std::vector<std::string> outside;
  for (const UncoveredTriangle& found : coverage.uncovered) {
    outside.push_back(
        JsonObject()
            .Add("triangle", uint64_t{found.triangle})
            .AddJson("distance", ShortestText(found.distance))
            .AddJson("area", ShortestText(found.area))
            .AddJson("point", JsonArray({ShortestText(found.point[0]), ShortestText(found.point[1]),
                                         ShortestText(found.point[2])}))
            .Close());
  }
  run.out << object.AddJson("trianglesOutside", JsonArray(outside)).Close() << "\n";
}

void PrintCoverage(const Invocation& run, const CoverArguments& arguments, const TriangleMesh& mesh,
                   size_t pieces, const Coverage& coverage) {
  if (run.names()) {
    run.out << (coverage.uncovered.empty() ? "ENCLOSED" : "OUTSIDE") << "\n";
    return;
  }
  if (coverage.uncovered.empty()) {
    run.out << "ENCLOSED: each of the " << mesh.triangles.size() << " triangles is in the "
            << (pieces == 1 ? "hull" : "hulls together") << " (exact)\n";
    return;
  }
  double area = 0;
  for (const UncoveredTriangle& found : coverage.uncovered) area += found.area;
  run.out << "OUTSIDE: " << coverage.uncovered.size() << " of " << mesh.triangles.size()
          << " triangles stick out (exact), " << (pieces == 1 ? "by " : "at least by ")
          << ShortestText(coverage.distance) << ", with an area of " << ShortestText(area) << "\n";
  uint64_t listed = 0;
  for (const UncoveredTriangle& found : coverage.uncovered) {
    if (listed++ == arguments.limit) break;
    run.out << "triangle " << found.triangle << "\tby " << ShortestText(found.distance) << "\tat "
            << VectorText(found.point[0], found.point[1], found.point[2]) << "\n";
  }
  if (coverage.uncovered.size() > arguments.limit) {
    run.out << "# " << coverage.uncovered.size() - arguments.limit
            << " more; raise --limit to list them\n";
  }
}

ExitCode AnswerCover(const Invocation& run, const CoverArguments& arguments) {
  if (arguments.words.size() < 2) {
    return run.FailUsage(
        "pass IDs of hulls or bodies, then the mesh file: hullctl cover ID... FILE");
  }
  std::vector<std::string> hulls = arguments.words;
  const std::string file = hulls.back();
  hulls.pop_back();
  HULLD_ASSIGN_OR_FAIL(run.FailUsage, const auto mesh, ReadMesh(file));
  if (mesh.triangles.empty()) {
    return run.FailUsage(file + ": contains no triangles");
  }
  const Client client = run.MakeClient();
  PieceFetcher fetcher(client);
  for (const std::string& hull : hulls) {
    if (absl::Status added = fetcher.Add(hull); !added.ok()) return run.Fail(added);
  }
  const std::vector<CoveringPiece> pieces = fetcher.Take();
  ProgressBar bar(run.err, run.shows_progress, "triangles", mesh.triangles.size());
  auto coverage = CoverMesh(pieces, mesh, [&bar](uint64_t done) { bar.Update(done); });
  bar.Clear();
  if (!coverage.ok()) return run.Fail(coverage.status());
  std::ranges::stable_sort(coverage->uncovered, std::greater(), &UncoveredTriangle::distance);
  if (run.json()) {
    PrintCoverageJson(run, mesh, *coverage);
  } else {
    PrintCoverage(run, arguments, mesh, pieces.size(), *coverage);
  }
  return ExitCode::kDone;
}

}  // namespace

void AddCoverCommand(Command program, Invocation* invocation) {
  auto arguments = std::make_shared<CoverArguments>();
  Command command = program.AddCommand("cover", "Check whether hulls or a body enclose a mesh");
  command
      .AddTexts("ID", &arguments->words,
                "IDs of hulls or bodies, then the mesh (obj, off, ply, stl, gltf, dae)")
      .ValueName("ID... FILE")
      .Required()
      .Completes(ValueKind::kShape);
  command.AddNumber(
      "--limit", 0, kAnyNumber,
      absl::StrCat("Triangles to list, the farthest first (default ", kDefaultLimit, ")"),
      &arguments->limit);
  command.SetDetails(
      "Checks that each point of each triangle of the mesh is in one of the hulls, boundaries\n"
      "included. A body stands for its pieces at their exact poses. The decision is exact:\n"
      "triangles are cut in integers of any length, so the list is complete and has no false\n"
      "entries. Distances are computed in floating point: the largest distance for one hull, a\n"
      "lower bound of it for several. Only the surface is checked: a hull that contains it also\n"
      "contains the interior; several hulls may leave a cavity in a solid. An ID that ends with /\n"
      "stands for all hulls with this prefix. Triangles count from 0, in the order of the file;\n"
      "polygons are fans of triangles. Triangles that stick out are an answer: exit code 0.");
  command.SetExamples({{"", "hullctl cover bracket bracket.stl"},
                       {"The pieces of a body together", "hullctl cover chair chair.obj"},
                       {"All hulls with a prefix", "hullctl cover chair/ chair.obj"}});
  OnGiven(command, invocation, arguments, AnswerCover);
}

}  // namespace hulld
