#ifndef HULLD_SERVER_SHARDS_BODY_RESOLUTION_H_
#define HULLD_SERVER_SHARDS_BODY_RESOLUTION_H_

#include <absl/status/statusor.h>

#include <cstddef>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <unordered_map>
#include <vector>

#include "server/registry/bodies/served_body.h"
#include "server/registry/catalog/body.h"
#include "server/shards/known_in_shards.h"
#include "server/shards/shards.h"

namespace hulld::server {

// How hulls are looked up for questions.
struct PlacedLookup {
  // For answers that name vertices (QueryOptions::WantsCanonical).
  bool canonical = false;
  // What IDs must start with, those of pieces too; it is the caller's.
  std::string prefix;
  // Canonical snapshots need nothing prepared.
  ShardsPlan plan;
};

// What a reader that asks again and again for the same IDs keeps in between. Not thread-safe.
class KnownPlaced {
 public:
  // What it holds of bodies, in bytes. For hulls, KnownInShards::kBytesEach for each ID.
  size_t BodyBytes() const;

 private:
  friend absl::StatusOr<ShardsResolved> RefreshPlaced(Shards&, std::span<const std::string>,
                                                      KnownPlaced&, const PlacedLookup&,
                                                      const std::function<bool()>&);

  using Bodies = std::vector<std::shared_ptr<const Body>>;

  // Whether the bodies among the IDs are those of before, at the same revisions.
  bool AreBodies(const Bodies& bodies) const;
  // Takes the bodies among the IDs; where they are others than before, nothing is known of hulls.
  void SetBodies(std::span<const std::string> ids, Bodies bodies);
  bool has_bodies() const { return !bodies_.empty(); }
  void AddHull(const std::string& id);

  // Parallel to the IDs, null for those of hulls; empty when all are.
  Bodies bodies_;
  // Where there are bodies: the IDs of hulls, then those of pieces, each once.
  std::vector<std::string> hull_ids_;
  std::unordered_map<std::string, size_t> index_of_;
  KnownInShards hulls_;
};

// Hulls and bodies by ID, all current at one revision of their store; over several stores, at one
// instant where the read is linearizable. A body has no answer where the
// hull of a piece has none: NOT_FOUND (PIECE_NOT_FOUND), PERMISSION_DENIED or DATA_LOSS names body
// and piece; RESOURCE_EXHAUSTED: --memory-limit has no room for its pieces. Without bodies among
// them it is Shards::Refresh. Boxes of pieces are made here, not on gRPC's threads. CANCELLED
// when should_stop said so.
absl::StatusOr<ShardsResolved> ResolvePlaced(Shards& shards, std::span<const std::string> ids,
                                             const PlacedLookup& lookup,
                                             const std::function<bool()>& should_stop);

// As ResolvePlaced, for a reader that asks for the same IDs again and again: `known` is kept in
// between, and only hulls that changed since are looked up.
absl::StatusOr<ShardsResolved> RefreshPlaced(Shards& shards, std::span<const std::string> ids,
                                             KnownPlaced& known, const PlacedLookup& lookup,
                                             const std::function<bool()>& should_stop);

// The same, but nullopt, at once, where it would have to read, to prepare or to make something, or
// where there is a body among the IDs.
std::optional<ShardsResolved> TryResolvePlaced(Shards& shards, std::span<const std::string> ids,
                                               const PlacedLookup& lookup);

// PERMISSION_DENIED, naming the piece, where the hull of one is outside of a caller's prefix.
absl::Status CheckPiecePrefix(const Body& body, const std::string& prefix);

}  // namespace hulld::server

#endif  // HULLD_SERVER_SHARDS_BODY_RESOLUTION_H_
