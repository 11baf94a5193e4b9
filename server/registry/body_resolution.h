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

#include "server/registry/catalog/body.h"
#include "server/registry/catalog/known_hulls.h"
#include "server/registry/inline_shapes.h"
#include "server/registry/registry.h"

namespace hulld::server {

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

// State that a reader keeps between repeated lookups of the same IDs. Not thread-safe.
class KnownPlaced {
 public:
  KnownPlaced() = default;
  // As KnownHulls::ForOneLookup.
  static KnownPlaced ForOneLookup() {
    KnownPlaced known;
    known.hulls_ = KnownHulls::ForOneLookup();
    return known;
  }

  // Bytes used for bodies. Hulls use KnownHulls::kBytesEach per ID.
  size_t BodyBytes() const;

 private:
  friend absl::StatusOr<Resolved> RefreshPlaced(Registry&, std::span<const std::string>,
                                                KnownPlaced&, const PlacedLookup&,
                                                const std::function<bool()>&);

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
// shapes. If a body has no hull for some piece, its result is an error: NOT_FOUND
// (PIECE_NOT_FOUND), PERMISSION_DENIED, or DATA_LOSS, which names body and piece;
// RESOURCE_EXHAUSTED: --memory-limit has no room for its pieces. Without bodies, equivalent to
// HullReader::Refresh. Builds boxes of pieces, so it must not run on a gRPC thread unless
// plan.may_wait is false: WouldWait then includes bodies and inline shapes. CANCELLED: should_stop
// returned true.
absl::StatusOr<Resolved> ResolvePlaced(Registry& registry, std::span<const std::string> ids,
                                       const PlacedLookup& lookup,
                                       const std::function<bool()>& should_stop);

// As ResolvePlaced, for a reader that repeatedly resolves the same IDs: `known` persists between
// calls, and only hulls changed since are looked up. The points of inline shapes are not needed
// after the first call.
absl::StatusOr<Resolved> RefreshPlaced(Registry& registry, std::span<const std::string> ids,
                                       KnownPlaced& known, const PlacedLookup& lookup,
                                       const std::function<bool()>& should_stop);

// PERMISSION_DENIED, naming the piece: the hull of a piece is outside the caller's prefix.
absl::Status CheckPiecePrefix(const Body& body, const std::string& prefix);

}  // namespace hulld::server

#endif  // HULLD_SERVER_REGISTRY_BODY_RESOLUTION_H_
