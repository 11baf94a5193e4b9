#include "tests/fuzz/hulls/hull_check.h"

#include <absl/status/statusor.h>
#include <absl/strings/str_cat.h>

#include <algorithm>
#include <iterator>
#include <span>
#include <vector>

#include "core/hull/audit.h"
#include "core/hull/growth/hull_builder.h"
#include "tests/core/checks/oracle_bridge.h"
#include "tests/oracle/brute_force_hull.h"

namespace hulld::fuzz {
namespace {

std::vector<Vector> FiniteOf(std::span<const Vector> points) {
  std::vector<Vector> finite;
  std::copy_if(points.begin(), points.end(), std::back_inserter(finite),
               [](const Vector& p) { return p.allFinite(); });
  return finite;
}

// Adds the finite points of a block. Returns a finding, or empty.
std::string AddBlock(HullBuilder& builder, std::span<const Vector> block, size_t& refused) {
  const std::vector<Vector> finite = FiniteOf(block);
  if (finite.size() != block.size()) {
    ++refused;
    const Hull before = builder.Snapshot();
    const absl::StatusOr<PointCounts> counts = builder.Add(block);
    if (!absl::IsInvalidArgument(counts.status())) return "a non-finite point was accepted";
    if (!SameBits(builder.Snapshot(), before)) return "a refused block changed the hull";
  }
  const absl::StatusOr<PointCounts> counts = builder.Add(finite);
  if (!counts.ok()) return absl::StrCat("refused: ", counts.status().ToString());
  if (counts->received != finite.size() ||
      counts->outside + counts->duplicate + counts->inside != counts->received) {
    return "the counts of a block do not add up";
  }
  return {};
}

// Returns all points, or an evenly spread sample if testing all would take long.
std::vector<Vector> ContainmentSample(std::span<const Vector> points, size_t facets) {
  constexpr size_t kTests = 4000;
  const size_t stride = points.size() * facets / kTests + 1;
  std::vector<Vector> sample;
  for (size_t i = 0; i < points.size(); i += stride) sample.push_back(points[i]);
  return sample;
}

std::string CheckSnapshot(const Hull& hull, std::span<const Vector> finite, Verdict& verdict) {
  if (const absl::Status audit = AuditHull(hull); !audit.ok()) return audit.ToString();
  const std::vector<Vector> sample = ContainmentSample(finite, hull.facet_count());
  if (const absl::Status held = AuditContainment(hull, sample); !held.ok()) return held.ToString();
  if (finite.size() > kBruteForcePoints) return {};
  verdict.compared_with_brute_force = true;
  const testing::AssertionResult same = SameHull(hull, oracle::BruteForceHull(ToOracle(finite)));
  return same ? "" : same.message();
}

}  // namespace

Verdict CheckHullOf(const FuzzCloud& cloud) {
  Verdict verdict;
  const std::span<const Vector> points = cloud.points;
  const auto add = [&](HullBuilder& builder, std::span<const Vector> block) {
    if (!verdict.finding.empty()) return;
    verdict.finding = AddBlock(builder, block, verdict.refused);
  };

  HullBuilder one_by_one;
  for (size_t i = 0; i < points.size(); ++i) add(one_by_one, points.subspan(i, 1));

  HullBuilder in_blocks;
  size_t start = 0;
  for (const size_t n : cloud.block_sizes) {
    add(in_blocks, points.subspan(start, n));
    start += n;
  }

  HullBuilder backwards;
  add(backwards, std::vector<Vector>(points.rbegin(), points.rend()));
  if (!verdict.finding.empty()) return verdict;

  const Hull hull = one_by_one.Snapshot();
  verdict.dimension = hull.dimension();
  verdict.vertices = hull.vertices().size();
  verdict.finding = CheckSnapshot(hull, FiniteOf(points), verdict);
  if (verdict.finding.empty() && !SameBits(in_blocks.Snapshot(), hull)) {
    verdict.finding = "blocks produce a different hull than single points";
  }
  if (verdict.finding.empty() && !SameBits(backwards.Snapshot(), hull)) {
    verdict.finding = "the reverse order produces a different hull";
  }
  return verdict;
}

}  // namespace hulld::fuzz
