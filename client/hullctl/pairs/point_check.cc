#include "client/hullctl/pairs/point_check.h"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "client/formats/point_file.h"
#include "client/formats/text_number.h"
#include "client/hullctl/command_line/point_input.h"
#include "client/hullctl/pairs/batch_answers.h"
#include "client/hullctl/printing/answer_text.h"
#include "client/hullctl/printing/json.h"
#include "client/hullctl/printing/progress_bar.h"
#include "client/hullctl/printing/table.h"
#include "client/packed_placements.h"

namespace hulld {
namespace {

// About 4 MiB.
constexpr uint64_t kPointsPerCall = uint64_t{1} << 16;

const char* SideName(v1::Relation relation) {
  return relation == v1::RELATION_OVERLAPPING ? "inside"
         : relation == v1::RELATION_TOUCHING  ? "on"
                                              : "outside";
}

// Sends points block by block and prints their answers.
class PointCheck {
 public:
  PointCheck(const Invocation& run, const v1::Placement& hull, const v1::Wanted& wanted)
      : run_(run),
        client_(run.MakeClient()),
        bar_(run.err, run.shows_progress, "points", 0),
        base_(RequestFor(hull, wanted)) {}

  ExitCode Run(ReadRequest file) {
    HULLD_ASSIGN_OR_FAIL(run_.Fail, const auto status, client_.GetStatus());
    file.options.points_per_block =
        std::min({kPointsPerCall, status.limits().max_pairs_per_batch(),
                  std::max<uint64_t>(status.limits().max_placements(), 2) - 1});
    const auto read = ReadPoints(file, [this](const PointChunk& block) { return Query(block); });
    bar_.Clear();
    if (!answered_.ok()) return run_.Fail(answered_);
    if (!read.ok()) return run_.FailUsage(read.status());
    if (!run_.json() && !run_.names()) PrintTotals();
    if (failed_ == 0) return ExitCode::kDone;
    run_.err << "hullctl: " << Counted(failed_, "point") << " failed; each line gives the reason\n";
    return ExitCode::kSomeFailed;
  }

 private:
  // Returns a request without points: the hull, and the shape of a point, which is the origin. Each
  // point is that shape at an exact translation.
  static v1::BatchCheckCollisionsRequest RequestFor(const v1::Placement& hull,
                                                    const v1::Wanted& wanted) {
    v1::BatchCheckCollisionsRequest request;
    *request.mutable_wanted() = wanted;
    google::protobuf::RepeatedPtrField<v1::Placement> placements;
    *placements.Add() = hull;
    v1::PackedPlacements& packed = *request.mutable_packed_placements();
    packed = PackPlacements(placements);
    packed.add_shape_sizes(1);
    for (int axis = 0; axis < 3; ++axis) packed.mutable_shape_points()->add_xyz(0);
    return request;
  }

  absl::Status Query(const PointChunk& block) {
    std::vector<double> xyz = block.xyz;
    xyz.insert(xyz.end(), block.xyz_float.begin(), block.xyz_float.end());
    v1::BatchCheckCollisionsRequest request = base_;
    v1::PackedPlacements& packed = *request.mutable_packed_placements();
    for (size_t i = 0; i < xyz.size(); i += 3) {
      packed.add_hulls(1);
      for (const double number : {1.0, 0.0, 0.0, 0.0, xyz[i], xyz[i + 1], xyz[i + 2]}) {
        packed.add_poses(number);
      }
      request.add_pairs(0);
      request.add_pairs(static_cast<uint32_t>(i / 3 + 1));
    }
    answered_ = QueryBatch(
        client_, request,
        [](const v1::BatchCheckCollisionsResponse& part) {
          // Only the hull can be missing, and then no point has an answer.
          if (part.placement_problems().empty()) return absl::OkStatus();
          const v1::PlacementProblem& problem = part.placement_problems(0);
          return absl::Status(static_cast<absl::StatusCode>(problem.code()), problem.message());
        },
        [&](size_t point, const AnswerRow& row, const std::string* problem) {
          Print(std::span(xyz).subspan(3 * point, 3), row, problem);
          return absl::OkStatus();
        });
    bar_.Update(queried_ += xyz.size() / 3);
    return answered_;
  }

  void Print(std::span<const double> point, const AnswerRow& row, const std::string* problem) {
    bar_.Clear();
    if (problem != nullptr) ++failed_;
    const char* const side = problem != nullptr ? "FAILED" : SideName(row.relation);
    ++counts_[row.relation];
    if (run_.names()) {
      run_.out << side << "\n";
    } else if (run_.json()) {
      JsonObject object;
      object.AddJson("point", absl::StrCat("[", ShortestText(point[0]), ",", ShortestText(point[1]),
                                           ",", ShortestText(point[2]), "]"));
      object.Add("side", side);
      if (problem != nullptr) object.Add("problem", *problem);
      AddRow(row, &object);
      run_.out << object.Close() << "\n";
    } else {
      run_.out << VectorText(point[0], point[1], point[2]) << "\t" << side;
      if (problem != nullptr) run_.out << "\t" << *problem;
      if (row.separation) run_.out << "\t" << SeparationText(*row.separation);
      run_.out << "\n";
    }
  }

  void PrintTotals() {
    run_.out << "# inside " << counts_[v1::RELATION_OVERLAPPING] << " on "
             << counts_[v1::RELATION_TOUCHING] << " outside " << counts_[v1::RELATION_SEPARATED]
             << " failed " << failed_ << "\n";
  }

  const Invocation& run_;
  const Client client_;
  ProgressBar bar_;
  const v1::BatchCheckCollisionsRequest base_;
  absl::Status answered_;
  uint64_t queried_ = 0;
  uint64_t counts_[v1::Relation_ARRAYSIZE] = {};
  uint64_t failed_ = 0;
};

}  // namespace

ExitCode CheckPoints(const Invocation& run, const v1::Placement& hull, const std::string& file,
                     const v1::Wanted& wanted) {
  PointInput input;
  input.files = {file};
  uint64_t bytes = 0;
  HULLD_ASSIGN_OR_FAIL(run.FailUsage, auto plan, PlanReads(input, &bytes));
  return PointCheck(run, hull, wanted).Run(std::move(plan.front()));
}

}  // namespace hulld
