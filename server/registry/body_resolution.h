#ifndef HULLD_SERVER_REGISTRY_BODY_RESOLUTION_H_
#define HULLD_SERVER_REGISTRY_BODY_RESOLUTION_H_

#include <absl/status/statusor.h>

#include <cstddef>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <unordered_map>
#include <vector>

#include "core/numeric/vector.h"
#include "server/registry/catalog/body.h"
#include "server/registry/registry.h"

namespace hulld::server {

// Points of the inline shapes of a call, by index.
class InlineShapes {
 public:
  // Requires: at least one point, all finite.
  void Add(std::span<const Vector> points) {
    points_.insert(points_.end(), points.begin(), points.end());
    ends_.push_back(points_.size());
  }

  bool empty() const { return ends_.empty(); }
  size_t size() const { return ends_.size(); }
  std::span<const Vector> PointsOf(size_t k) const {
    const size_t begin = k == 0 ? 0 : ends_[k - 1];
    return std::span(points_).subspan(begin, ends_[k] - begin);
  }
  size_t MemoryBytes() const {
    return points_.capacity() * sizeof(Vector) + ends_.capacity() * sizeof(size_t);
  }

 private:
  std::vector<Vector> points_;
  // Position in points_ after the last point of each shape.
  std::vector<size_t> ends_;
};

// Options of a lookup of hulls and bodies for queries.
struct PlacedLookup {
  // True if the answers name vertices (QueryOptions::WantsCanonical).
  bool canonical = false;
  // Required prefix of all IDs, including hulls of pieces; owned by the caller.
  std::string prefix;
  // Canonical snapshots need no preparation.
  ReadPlan plan;
  // Inline shapes; owned by the caller; null: none. Their hulls follow the hulls of the IDs.
  const InlineShapes* shapes = nullptr;
};

// Resolves the same hulls and bodies repeatedly. Not thread-safe.
class KnownPlaced {
 public:
  // for_one_lookup: as for KnownHulls.
  explicit KnownPlaced(bool for_one_lookup = false) : hulls_(for_one_lookup) {}

  // Like ResolvePlaced, but looks up only hulls that changed since the previous call. Requires the
  // IDs of the first call. The points of inline shapes are not needed after it.
  absl::StatusOr<Resolved> Resolve(Registry& registry, std::span<const std::string> ids,
                                   const PlacedLookup& lookup,
                                   const std::function<bool()>& should_stop);

  // Bytes used for bodies. Hulls use KnownHulls::kBytesEach per ID.
  size_t BodyBytes() const;

 private:
  using Bodies = std::vector<std::shared_ptr<const Body>>;

  // Returns true if `bodies` equals the previous bodies, at the same revisions.
  bool AreBodies(const Bodies& bodies) const;
  // Sets the bodies among the IDs. If they differ from the previous ones, all hulls become unknown.
  void SetBodies(std::span<const std::string> ids, Bodies bodies);
  bool has_bodies() const { return !bodies_.empty(); }
  void AddHull(const std::string& id);

  // Parallel to the IDs; null for the ID of a hull; empty if all IDs belong to hulls.
  Bodies bodies_;
  // If there are bodies: IDs of hulls, then IDs of the hulls of their pieces, without duplicates.
  std::vector<std::string> hull_ids_;
  std::unordered_map<std::string, size_t> index_of_;
  KnownHulls hulls_;
  // Hulls of the inline shapes, built by the first lookup.
  std::vector<HullView> shapes_;
};

// Resolves hulls and bodies by ID, all at one revision of the store, and builds the hulls of inline
// shapes. If the hull of a piece is missing, outside the prefix, or damaged, the result of its body
// is NOT_FOUND (PIECE_NOT_FOUND), PERMISSION_DENIED, or DATA_LOSS, and names the body and the
// piece. If --memory-limit has no room for the pieces, it is RESOURCE_EXHAUSTED. Without bodies,
// equivalent to HullReader::Refresh. Builds boxes of pieces, so it must not run on a gRPC thread
// unless plan.may_wait is false, in which case it returns WouldWait if there are bodies or unbuilt
// inline shapes. CANCELLED: should_stop returned true.
absl::StatusOr<Resolved> ResolvePlaced(Registry& registry, std::span<const std::string> ids,
                                       const PlacedLookup& lookup,
                                       const std::function<bool()>& should_stop);

// PERMISSION_DENIED, naming the piece: the hull of a piece is outside the caller's prefix.
absl::Status CheckPiecePrefix(const Body& body, const std::string& prefix);

}  // namespace hulld::server

#endif  // HULLD_SERVER_REGISTRY_BODY_RESOLUTION_H_
