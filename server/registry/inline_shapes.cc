#include "server/registry/inline_shapes.h"

#include <memory>

#include "core/base/check.h"
#include "core/base/status_macros.h"
#include "core/hull/growth/hull_builder.h"
#include "server/contract/stopped_call.h"
#include "server/registry/memory/memory_budget.h"
#include "server/registry/memory/served_hull.h"

namespace hulld::server {
namespace {

// Bytes built between two checks of --memory-limit. A call that needs less is always answered.
constexpr size_t kUncheckedBytes = 256 << 10;

// The hull of a shape, and its charge.
struct InlineHull {
  ServedHull served;
  MemoryCharge charge;
};

std::shared_ptr<const InlineHull> BuildInlineHull(std::span<const Vector> points,
                                                  MemoryBudget& memory) {
  HullBuilder builder;
  HULLD_CHECK(builder.Add(points).ok());
  const auto canonical = std::make_shared<CanonicalHull>(builder.Snapshot());
  const std::shared_ptr<const QueryHull> version(canonical, &canonical->query_hull());
  Box box = {points.front(), points.front()};
  for (const Vector& vertex : canonical->hull()->vertices()) {
    box = {box.low.cwiseMin(vertex), box.high.cwiseMax(vertex)};
  }
  const size_t bytes = sizeof(InlineHull) + sizeof(CanonicalHull) + canonical->MemoryBytes();
  return std::make_shared<const InlineHull>(InlineHull{
      ServedHull(version, box, canonical), MemoryCharge(memory, MemoryUse::kReading, bytes)});
}

}  // namespace

absl::StatusOr<std::vector<HullView>> BuildInlineShapes(Registry& registry,
                                                        const InlineShapes& shapes,
                                                        const std::function<bool()>& should_stop) {
  std::vector<HullView> views;
  views.reserve(shapes.size());
  size_t unchecked_bytes = 0;
  for (size_t k = 0; k < shapes.size(); ++k) {
    if (Stopped(should_stop)) return Cancelled();
    if (unchecked_bytes > kUncheckedBytes) {
      HULLD_RETURN_IF_ERROR(registry.CheckMemory(MemoryUse::kReading));
      unchecked_bytes = 0;
    }
    const auto hull = BuildInlineHull(shapes.PointsOf(k), registry.memory());
    unchecked_bytes += hull->charge.bytes();
    views.push_back({{}, std::shared_ptr<const ServedHull>(hull, &hull->served)});
  }
  return views;
}

}  // namespace hulld::server
