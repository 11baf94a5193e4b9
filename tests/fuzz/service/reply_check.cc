#include "tests/fuzz/service/reply_check.h"

#include <absl/strings/str_cat.h>
#include <grpcpp/support/status_code_enum.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>
#include <utility>

namespace hulld::fuzz {
namespace {

std::string CheckCounts(const v1::PointCounts& counts) {
  if (counts.outside() + counts.duplicate() + counts.inside() == counts.received()) return {};
  return "the counts of points do not add up: " + counts.ShortDebugString();
}

std::string CheckSeparation(v1::Relation relation, double value, double bound) {
  const bool sign_agrees = relation == v1::RELATION_SEPARATED  ? value > 0
                           : relation == v1::RELATION_TOUCHING ? value == 0
                                                               : value < 0;
  if (!sign_agrees || !(bound >= 0)) {
    return absl::StrCat("separation ", value, " within ", bound, " contradicts ",
                        v1::Relation_Name(relation));
  }
  return {};
}

// Checks the clearance against the relation.
std::string CheckClearance(v1::Relation relation, bool within) {
  const bool colliding = relation == v1::RELATION_TOUCHING || relation == v1::RELATION_OVERLAPPING;
  return colliding && !within ? "a colliding pair is not within its clearance" : "";
}

bool IsProblemCode(int code) {
  return code == grpc::INVALID_ARGUMENT || code == grpc::NOT_FOUND ||
         code == grpc::RESOURCE_EXHAUSTED;
}

// Returns the number of placements of a request, in either form.
template <typename Request>
int PlacementCount(const Request& request) {
  return request.placements_size() + request.packed_placements().hulls_size();
}

// Returns the number of entries of its table of hulls.
template <typename Request>
int HullCount(const Request& request) {
  return request.placements_size() + request.packed_placements().hull_ids_size();
}

// Checks the placements reported as problems, and collects them.
template <typename Problems>
std::string CheckProblems(const Problems& problems, int placements, std::set<uint32_t>* found) {
  for (const v1::PlacementProblem& problem : problems) {
    if (problem.placement() >= static_cast<uint32_t>(placements) || problem.message().empty() ||
        !IsProblemCode(problem.code()) || !found->insert(problem.placement()).second) {
      return "a malformed problem: " + problem.ShortDebugString();
    }
  }
  return {};
}

bool IsParallel(int size, bool wanted, int rows) { return size == (wanted ? rows : 0); }

// Returns true if each column has its required length.
bool AreParallel(const v1::Wanted& wanted, const v1::AnswerColumns& columns, int rows) {
  return IsParallel(columns.relations_size(), true, rows) &&
         IsParallel(columns.rungs_size(), true, rows) &&
         IsParallel(columns.axes_size(), wanted.axis(), rows) &&
         IsParallel(columns.analyses_size(), wanted.analysis(), rows) &&
         IsParallel(columns.certificates_size(), wanted.certificate(), rows) &&
         IsParallel(columns.separations_size(), wanted.separation(), rows) &&
         IsParallel(columns.separation_bounds_size(), wanted.separation(), rows) &&
         IsParallel(columns.witness_xyz_size(), wanted.witness(), 6 * rows) &&
         IsParallel(columns.witness_errors_size(), wanted.witness(), rows) &&
         IsParallel(columns.normal_xyz_size(), wanted.normal(), 3 * rows) &&
         IsParallel(columns.normal_angle_bounds_size(), wanted.normal(), rows) &&
         IsParallel(columns.within_clearance_size(), wanted.has_clearance(), rows);
}

// Checks the numbers of a row against its relation.
std::string CheckRow(const v1::Wanted& wanted, double tolerance, const v1::AnswerColumns& columns,
                     int row) {
  const v1::Relation relation = columns.relations(row);
  if (!v1::Relation_IsValid(relation) || !v1::Rung_IsValid(columns.rungs(row))) {
    return "an unknown relation or rung";
  }
  if (relation == v1::RELATION_WITHIN_TOLERANCE && !(tolerance > 0)) {
    return "WITHIN_TOLERANCE without a tolerance";
  }
  if (relation == v1::RELATION_UNSPECIFIED) return {};
  std::string finding;
  if (wanted.separation()) {
    finding = CheckSeparation(relation, columns.separations(row), columns.separation_bounds(row));
  }
  if (finding.empty() && wanted.has_clearance()) {
    finding = CheckClearance(relation, columns.within_clearance(row));
  }
  return finding;
}

// Checks the rows of a message. `has_problem(row)`: true if a placement of the row's pair has a
// problem.
template <typename HasProblem>
std::string CheckColumns(const v1::Wanted& wanted, double tolerance,
                         const v1::AnswerColumns& columns, int rows,
                         const HasProblem& has_problem) {
  if (!AreParallel(wanted, columns, rows)) return "columns are not parallel";
  std::set<uint64_t> causes;
  for (const v1::PairProblem& problem : columns.pair_problems()) {
    if (!causes.insert(problem.row()).second || problem.message().empty() ||
        !IsProblemCode(problem.code())) {
      return "a malformed problem: " + problem.ShortDebugString();
    }
  }
  for (int row = 0; row < rows; ++row) {
    const bool has_cause = has_problem(row) || causes.erase(static_cast<uint64_t>(row)) > 0;
    if (has_cause != (columns.relations(row) == v1::RELATION_UNSPECIFIED)) {
      return absl::StrCat("row ", row, " has an answer and a problem, or neither");
    }
    std::string finding = CheckRow(wanted, tolerance, columns, row);
    if (!finding.empty()) return finding;
  }
  return causes.empty() ? "" : "a problem names a row that is not in the message";
}

// Checks that facets name existing vertices.
std::string CheckFacets(const v1::MeshFacets& facets, uint64_t vertices) {
  uint64_t corners = 0;
  for (const uint32_t size : facets.sizes()) {
    if (size < 3) return "a facet has fewer than three corners";
    corners += size;
  }
  if (corners != static_cast<uint64_t>(facets.indices_size()))
    return "the sizes of the facets do not sum to the number of indices";
  for (const uint32_t index : facets.indices()) {
    if (index >= vertices) return "a facet names a nonexistent vertex";
  }
  return {};
}

std::string CheckSceneTotals(const v1::SceneTotals& totals, const v1::SceneTotals& counted) {
  if (totals.separated() != counted.separated() || totals.touching() != counted.touching() ||
      totals.overlapping() != counted.overlapping() ||
      totals.within_tolerance() != counted.within_tolerance() ||
      totals.failed() != counted.failed() || totals.candidates() > totals.pairs()) {
    return "the totals do not match the rows: " + totals.ShortDebugString() +
           " but the rows have " + counted.ShortDebugString();
  }
  return {};
}

// With a limit, the rows are a subset of the pairs that the totals count.
std::string CheckLimitedTotals(uint32_t limit, const v1::SceneTotals& totals,
                               const v1::SceneTotals& counted) {
  const uint64_t answered = counted.separated() + counted.touching() + counted.overlapping();
  if (answered > limit || counted.separated() > totals.separated() ||
      counted.touching() > totals.touching() || counted.overlapping() > totals.overlapping() ||
      counted.failed() > totals.failed() || totals.candidates() > totals.pairs()) {
    return absl::StrCat("a scene with limit ", limit,
                        " has more rows than its totals count: ", totals.ShortDebugString(),
                        " but the rows have ", counted.ShortDebugString());
  }
  return {};
}

// Position of a row in a scene: by pair or, with a limit or first_only, by separation or time, rows
// without an answer last.
using SceneKey = std::tuple<bool, double, int64_t, int64_t>;

SceneKey KeyOf(const v1::FindCollisionsRequest& request, const v1::FindCollisionsResponse& part,
               int row) {
  SceneKey key(false, 0, part.pairs(2 * row), part.pairs(2 * row + 1));
  const v1::AnswerColumns& columns = part.columns();
  const bool is_ranked = request.has_limit() || request.first_only();
  if (!is_ranked || row >= columns.relations_size()) return key;
  const auto& ranks = request.has_limit() ? columns.separations() : columns.separated_until();
  std::get<0>(key) = columns.relations(row) == v1::RELATION_UNSPECIFIED;
  if (!std::get<0>(key) && row < ranks.size()) std::get<1>(key) = ranks[row];
  return key;
}

void Count(v1::Relation relation, v1::SceneTotals* totals) {
  switch (relation) {
    case v1::RELATION_SEPARATED:
      return totals->set_separated(totals->separated() + 1);
    case v1::RELATION_TOUCHING:
      return totals->set_touching(totals->touching() + 1);
    case v1::RELATION_OVERLAPPING:
      return totals->set_overlapping(totals->overlapping() + 1);
    case v1::RELATION_WITHIN_TOLERANCE:
      return totals->set_within_tolerance(totals->within_tolerance() + 1);
    default:
      return totals->set_failed(totals->failed() + 1);
  }
}

}  // namespace

std::string CheckHullInfo(const v1::HullInfo& hull) {
  if (hull.hull_id().empty() || hull.create_revision() == 0 ||
      hull.revision() < hull.create_revision() || hull.dimension() < -1 || hull.dimension() > 3 ||
      hull.vertex_count() < static_cast<uint64_t>(hull.dimension() + 1) ||
      hull.vertex_count() > hull.counts().received()) {
    return "a malformed hull: " + hull.ShortDebugString();
  }
  return CheckCounts(hull.counts());
}

std::string CheckHull(const v1::GetHullRequest& request, const v1::GetHullResponse& response) {
  std::string finding = CheckHullInfo(response.hull());
  if (!finding.empty()) return finding;
  if (response.hull().hull_id() != request.hull_id()) return "the reply is about a different hull";
  const bool empty = response.hull().dimension() < 0;
  if (response.has_box_min() == empty || response.has_box_max() == empty) {
    return "an empty hull has a box, or a nonempty hull has none";
  }
  if (response.has_audit() != request.audit())
    return "an audit was returned without a request, or is missing";
  if (request.audit() && !response.audit().ok()) return "audit: " + response.audit().finding();
  return {};
}

std::string CheckPage(const v1::ListHullsRequest& request, const v1::ListHullsResponse& response) {
  const uint32_t most = request.page_size() == 0 ? 100 : std::min(request.page_size(), 1000u);
  if (static_cast<uint32_t>(response.hulls_size()) > most) return "a page is longer than requested";
  const std::string* before = nullptr;
  for (const v1::HullInfo& hull : response.hulls()) {
    if (before != nullptr && *before >= hull.hull_id()) return "a page is out of order";
    if (hull.hull_id().rfind(request.prefix(), 0) != 0)
      return "a page contains an ID outside its prefix";
    before = &hull.hull_id();
    if (std::string finding = CheckHullInfo(hull); !finding.empty()) return finding;
  }
  return {};
}

std::string CheckMesh(const v1::GetHullMeshRequest& request,
                      std::span<const v1::GetHullMeshResponse> parts) {
  if (parts.empty() || !parts.front().has_header()) return "a mesh does not start with its header";
  const v1::MeshHeader& header = parts.front().header();
  std::string finding = CheckHullInfo(header.hull());
  if (!finding.empty()) return finding;
  if (header.has_error() != request.has_simplification() || !(header.error() >= 0)) {
    return "the error of a simplification is missing, unexpected, or invalid: " +
           header.ShortDebugString();
  }
  uint64_t vertices = 0;
  uint64_t facets = 0;
  for (const v1::GetHullMeshResponse& part : parts.subspan(1)) {
    if (part.has_header()) return "a mesh has two headers";
    vertices += static_cast<uint64_t>(part.vertices().xyz_size());
    facets += static_cast<uint64_t>(part.facets().sizes_size());
    finding = CheckFacets(part.facets(), header.vertex_count());
    if (!finding.empty()) return finding;
    const auto& xyz = part.vertices().xyz();
    if (!std::all_of(xyz.begin(), xyz.end(), [](double x) { return std::isfinite(x); })) {
      return "a vertex is not finite";
    }
  }
  if (vertices != 3 * header.vertex_count() || facets != header.facet_count()) {
    return "the size of a mesh does not match its header: " + header.ShortDebugString();
  }
  if (!request.has_simplification() && header.vertex_count() != header.hull().vertex_count()) {
    return "a mesh does not have the vertex count of its hull: " + header.ShortDebugString();
  }
  return {};
}

std::string CheckPair(const v1::CheckCollisionRequest& request,
                      const v1::CheckCollisionResponse& response) {
  const v1::Wanted& wanted = request.wanted();
  const v1::Relation relation = response.relation();
  if (!v1::Relation_IsValid(relation) || relation == v1::RELATION_UNSPECIFIED ||
      (relation == v1::RELATION_WITHIN_TOLERANCE && !(request.tolerance() > 0))) {
    return absl::StrCat("unexpected relation ", v1::Relation_Name(relation));
  }
  if (response.hull_a().hull_id() != request.a().hull_id() ||
      response.hull_b().hull_id() != request.b().hull_id()) {
    return "the answer is about different hulls";
  }
  if (response.has_analysis() != wanted.analysis() ||
      response.has_separation() != wanted.separation() ||
      response.has_within_clearance() != wanted.has_clearance() ||
      (response.has_axis() && !wanted.axis()) || (response.has_witness() && !wanted.witness()) ||
      (response.has_normal() && !wanted.normal()) ||
      (response.has_certificate() && !wanted.certificate())) {
    return "the fields of the answer do not match the requested ones";
  }
  if (wanted.separation()) {
    std::string finding =
        CheckSeparation(relation, response.separation().value(), response.separation().bound());
    if (!finding.empty()) return finding;
  }
  if (wanted.has_clearance()) return CheckClearance(relation, response.within_clearance());
  return {};
}

std::string CheckBatch(const v1::BatchCheckCollisionsRequest& request,
                       std::span<const v1::BatchCheckCollisionsResponse> parts) {
  if (parts.empty()) return "a batch has no answer";
  std::set<uint32_t> problems;
  uint64_t next = 0;
  for (const v1::BatchCheckCollisionsResponse& part : parts) {
    const bool first = &part == &parts.front();
    if (part.has_header() != first || part.hulls_size() != (first ? HullCount(request) : 0)) {
      return "the table of hulls is not in the first message only";
    }
    std::string finding =
        CheckProblems(part.placement_problems(), PlacementCount(request), &problems);
    if (!finding.empty()) return finding;
    if (part.first_pair() != next) return "the ranges of pairs are not consecutive";
    const auto pair_of = [&](int row) { return next + static_cast<uint64_t>(row); };
    const auto has_problem = [&](int row) {
      const int pair = static_cast<int>(pair_of(row));
      return problems.count(request.pairs(2 * pair)) + problems.count(request.pairs(2 * pair + 1)) >
             0;
    };
    if (2 * pair_of(part.columns().relations_size()) >
        static_cast<uint64_t>(request.pairs_size())) {
      return "more answers than pairs";
    }
    finding = CheckColumns(request.wanted(), request.tolerance(), part.columns(),
                           part.columns().relations_size(), has_problem);
    if (!finding.empty()) return finding;
    next += static_cast<uint64_t>(part.columns().relations_size());
  }
  return 2 * next == static_cast<uint64_t>(request.pairs_size()) ? "" : "pairs without an answer";
}

std::string CheckScene(const v1::FindCollisionsRequest& request,
                       std::span<const v1::FindCollisionsResponse> parts) {
  if (parts.empty() || !parts.back().has_totals()) return "a scene ends without its totals";
  if (!parts.front().has_header() || parts.front().pairs_size() > 0 ||
      parts.front().hulls_size() != HullCount(request)) {
    return "the first message of a scene is not its table of hulls";
  }
  std::set<uint32_t> problems;
  std::string finding =
      CheckProblems(parts.front().placement_problems(), PlacementCount(request), &problems);
  if (!finding.empty()) return finding;
  v1::SceneTotals counted;
  SceneKey before(false, -std::numeric_limits<double>::infinity(), -1, -1);
  for (const v1::FindCollisionsResponse& part : parts.subspan(1)) {
    if (part.pairs_size() % 2 != 0) return "a pair is incomplete";
    for (int row = 0; 2 * row < part.pairs_size(); ++row) {
      const SceneKey key = KeyOf(request, part, row);
      const auto [unanswered, separation, a, b] = key;
      const bool repeats = request.every_piece() && key == before;
      if ((key <= before && !repeats) || a >= b || b >= PlacementCount(request)) {
        return "pairs of a scene are out of order or out of range";
      }
      before = key;
    }
    const auto has_problem = [&](int row) {
      return problems.count(part.pairs(2 * row)) + problems.count(part.pairs(2 * row + 1)) > 0;
    };
    finding = CheckColumns(request.wanted(), request.tolerance(), part.columns(),
                           part.pairs_size() / 2, has_problem);
    if (!finding.empty()) return finding;
    for (const int relation : part.columns().relations()) {
      Count(static_cast<v1::Relation>(relation), &counted);
    }
  }
  const v1::SceneTotals& totals = parts.back().totals();
  return request.has_limit() ? CheckLimitedTotals(request.limit(), totals, counted)
                             : CheckSceneTotals(totals, counted);
}

std::vector<v1::Relation> RelationsOf(std::span<const v1::BatchCheckCollisionsResponse> parts) {
  std::vector<v1::Relation> relations;
  for (const v1::BatchCheckCollisionsResponse& part : parts) {
    for (const int relation : part.columns().relations()) {
      relations.push_back(static_cast<v1::Relation>(relation));
    }
  }
  return relations;
}

void ReplaceCheck::Sent(const v1::ReplaceHullRequest& request) {
  const bool opens = request.has_open();
  if (opens == opened_ || (!opens && !request.has_points())) well_formed_ = false;
  if (opens && !opened_) hull_id_ = request.open().hull_id();
  opened_ = opened_ || opens;
  const v1::PointBlock& block = request.points();
  ends_ = request.has_points() && block.xyz().empty() && block.xyz_float().empty();
  points_ += static_cast<uint64_t>(block.xyz_size() + block.xyz_float_size()) / 3;
}

std::string ReplaceCheck::EndedOk(const v1::ReplaceHullResponse& response) const {
  if (!is_whole()) return "an incomplete stream replaced a hull";
  const v1::HullInfo& hull = response.hull();
  if (hull.hull_id() != hull_id_) return "a different hull was replaced";
  if (hull.create_revision() != hull.revision()) return "a replacement is not a new incarnation";
  if (hull.counts().received() != points_) {
    return absl::StrCat("a hull of ", points_, " points has received ", hull.counts().received());
  }
  if (response.durability() == v1::DURABILITY_UNSPECIFIED)
    return "a replacement without durability";
  return CheckHullInfo(hull);
}

void AppendCheck::Sent(const v1::AppendPointsRequest& request) {
  if (!request.has_chunk()) return;
  const v1::PointBlock& points = request.chunk().points();
  chunks_.push_back({request.chunk().sequence(),
                     static_cast<uint64_t>(points.xyz_size() + points.xyz_float_size()) / 3});
}

std::string AppendCheck::Received(const v1::AppendPointsResponse& response) {
  if (!open_) {
    if (!response.has_opened()) return "an append stream does not start with `opened`";
    open_ = true;
    opened_ = response.opened();
    hull_ = opened_.hull();
    revision_ = opened_.hull().revision();
    if (opened_.writer_id().empty()) return "the server assigned no writer ID";
    return CheckHullInfo(opened_.hull());
  }
  if (!response.has_ack()) return "`opened` is received twice";
  const v1::AppendAck& ack = response.ack();
  const bool was_sent = std::any_of(chunks_.begin(), chunks_.end(), [&](const SentChunk& chunk) {
    return chunk.sequence == ack.sequence();
  });
  if (!was_sent) return "an ack names a sequence that was not sent";
  if (ack.outcome() == v1::APPEND_OUTCOME_UNSPECIFIED ||
      ack.durability() == v1::DURABILITY_UNSPECIFIED) {
    return "an ack without outcome or durability";
  }
  if (ack.hull_revision() < revision_) return "the revision of a hull decreased";
  revision_ = ack.hull_revision();
  received_ += ack.counts().received();
  hull_.set_revision(ack.hull_revision());
  hull_.set_vertex_count(ack.vertex_count());
  v1::PointCounts& sums = *hull_.mutable_counts();
  sums.set_received(sums.received() + ack.counts().received());
  sums.set_outside(sums.outside() + ack.counts().outside());
  sums.set_duplicate(sums.duplicate() + ack.counts().duplicate());
  sums.set_inside(sums.inside() + ack.counts().inside());
  return CheckCounts(ack.counts());
}

std::string AppendCheck::Ended(bool ok, bool is_certain) const {
  if (!open_) return ok && !chunks_.empty() ? "a stream ends OK without `opened`" : "";
  uint64_t last = opened_.last_sequence();
  uint64_t points = 0;
  for (const SentChunk& chunk : chunks_) {
    if (chunk.sequence <= last) continue;
    if (chunk.sequence != last + 1) {
      return ok ? "a stream with a gap in its sequences ends OK" : "";
    }
    ++last;
    points += chunk.points;
  }
  if (received_ > points || (ok && is_certain && received_ < points)) {
    return absl::StrCat("acks report ", received_, " points, but ", points, " were new");
  }
  return {};
}

CollisionStreamCheck::CollisionStreamCheck(const v1::CollisionStreamOpen& open)
    : open_(open), relations_(static_cast<size_t>(open.pairs_size() / 2)) {}

void CollisionStreamCheck::Sent(const v1::CollisionStreamUpdate& update) {
  ++sent_;
  MovePlacements(update, open_.mutable_placements());
}

std::string CollisionStreamCheck::Received(const v1::StreamCollisionsResponse& response) {
  if (response.update() != answering_ || answering_ > sent_) return "answers are out of order";
  if (response.has_header() != starts_) return "the header is not in the first message only";
  const int rows = response.pairs_size();
  if (starts_) any_pair_ = false;
  for (int row = 0; row < rows; ++row) {
    const uint32_t pair = response.pairs(row);
    if (pair >= relations_.size() || (any_pair_ && pair <= last_pair_)) {
      return "pairs are out of order or out of range";
    }
    last_pair_ = pair;
    any_pair_ = true;
    if (row >= response.columns().relations_size()) return "columns are not parallel";
    relations_[pair] = static_cast<v1::Relation>(response.columns().relations(row));
  }
  if (!AreParallel(open_.wanted(), response.columns(), rows)) return "columns are not parallel";
  for (int row = 0; row < rows; ++row) {
    std::string finding = CheckRow(open_.wanted(), open_.tolerance(), response.columns(), row);
    if (!finding.empty()) return finding;
  }
  starts_ = response.last();
  if (response.last()) ++answering_;
  return {};
}

v1::BatchCheckCollisionsRequest CollisionStreamCheck::AsBatch() const {
  v1::BatchCheckCollisionsRequest request;
  *request.mutable_placements() = open_.placements();
  *request.mutable_pairs() = open_.pairs();
  return request;
}

}  // namespace hulld::fuzz
