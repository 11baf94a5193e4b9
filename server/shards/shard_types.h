#ifndef HULLD_SERVER_SHARDS_SHARD_TYPES_H_
#define HULLD_SERVER_SHARDS_SHARD_TYPES_H_

#include <absl/status/statusor.h>

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "server/registry/catalog/registry_types.h"

// What is asked of hulls in several shards, and what is answered: as registry_types.h, with a
// revision for each shard.
namespace hulld::server {

// A revision of the store of a shard, which is named by its place among all.
struct ShardRevision {
  size_t shard = 0;
  uint64_t revision = 0;

  friend bool operator==(const ShardRevision&, const ShardRevision&) = default;
};

// Ascending by shard, each at most once.
using ShardRevisions = std::vector<ShardRevision>;

// As AsOf: what the answer to a read is of, which may be several shards.
struct ShardsAsOf {
  ShardRevisions revisions;
  std::chrono::nanoseconds staleness{0};
};

// As Freshness. at_least_revision is that of the only shard where there is one; otherwise 0, and
// `at_least` names those of the shards that have one.
struct ShardsFreshness : Freshness {
  static ShardsFreshness OfWhatIsHere() { return ShardsFreshness(Freshness::OfWhatIsHere()); }

  ShardsFreshness() = default;
  explicit ShardsFreshness(const Freshness& each) : Freshness(each) {}

  // What holds for one shard.
  Freshness Of(size_t shard) const {
    Freshness freshness = *this;
    for (const ShardRevision& least : at_least) {
      if (least.shard == shard) freshness.at_least_revision = least.revision;
    }
    return freshness;
  }
  // Whether an answer from several shards is to be of one instant.
  bool is_linearizable() const { return max_staleness == std::chrono::nanoseconds(0); }

  ShardRevisions at_least;
};

// As ReadPlan.
struct ShardsPlan {
  ReadPlan Of(size_t shard) const {
    return {expected_questions, prepare_first, freshness.Of(shard)};
  }

  uint64_t expected_questions = 0;
  bool prepare_first = false;
  ShardsFreshness freshness = {};
};

// As Resolved. Those of one shard were all current at its revision; where the read was
// linearizable, all of them were at one instant during the call.
struct ShardsResolved {
  ShardsAsOf as_of;
  // In the order asked for.
  std::vector<absl::StatusOr<HullView>> hulls;
};

struct ShardsHullPage {
  ShardRevisions revisions;
  std::vector<ListedHull> hulls;
  bool more = false;
};

struct ShardsBodyPage {
  ShardRevisions revisions;
  std::vector<std::shared_ptr<const Body>> bodies;
  bool more = false;
};

struct ShardsSizes {
  ShardRevisions revisions;
  uint64_t hull_count = 0;
  uint64_t vertex_count = 0;
  uint64_t body_count = 0;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_SHARDS_SHARD_TYPES_H_
