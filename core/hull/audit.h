#ifndef HULLD_CORE_HULL_AUDIT_H_
#define HULLD_CORE_HULL_AUDIT_H_

#include <absl/status/status.h>

#include <functional>
#include <span>

#include "core/hull/hull.h"

namespace hulld {

// Checks a snapshot in rational arithmetic, independently of the builder: coordinates are finite,
// canonical, and in order; every vertex is used; facets are planar and strictly convex; the surface
// is a closed manifold with V - E + F = 2; and the hull is strictly convex at every edge and convex
// as a whole (Mehlhorn et al. 1996, Checking Geometric Programs). Returns OK, or INTERNAL with the
// first defect. CANCELLED: should_stop, which may be empty, returned true; polled every 1024 steps.
// Cost: O(V) exact operations, about 10 us each, regardless of the sizes of facets and the degrees
// of vertices.
absl::Status AuditHull(const Hull& hull, const std::function<bool()>& should_stop = {});

// Checks that every point is in the closed hull. Requires: finite points (checked). Returns OK, or
// INTERNAL with the first point outside. Cost: O(n F).
absl::Status AuditContainment(const Hull& hull, std::span<const Vector> points);

}  // namespace hulld

#endif  // HULLD_CORE_HULL_AUDIT_H_
