#ifndef HULLD_SERVER_REGISTRY_CATALOG_REGISTRY_TYPES_H_
#define HULLD_SERVER_REGISTRY_CATALOG_REGISTRY_TYPES_H_

#include <absl/status/statusor.h>

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/hull/growth/hull_builder.h"
#include "core/numeric/vector.h"
#include "core/query/box_tree.h"
#include "core/query/placed/live_hull.h"
#include "server/process/fair_queue.h"
#include "server/process/synchronization.h"
#include "server/registry/memory/memory_budget.h"
#include "server/registry/memory/served_hull.h"
#include "server/store/records.h"

// Arguments and results of the registry's functions.
namespace hulld::server {

// A body as seen by one call (catalog/body.h).
struct ServedBody;

// A hull as seen by one reader; `served` belongs to the record's revision. In lookups that allow
// bodies (ResolvePlaced), possibly a body: then `record` contains only its ID and revisions, and
// `served` is null. The record of an inline shape is empty.
struct HullView {
  HullRecord record;
  std::shared_ptr<const ServedHull> served;
  std::shared_ptr<const ServedBody> body = nullptr;
};

// Required freshness of a read when peer servers commit to the same store; see
// proto/hulld/v1/freshness.proto. All conditions must hold. Default: a linearizable read.
struct Freshness {
  // Accepts any staleness without a store query: for readers notified of a change that the registry
  // has already applied.
  static Freshness AnyStaleness() { return {0, std::nullopt, std::nullopt}; }

  uint64_t at_least_revision = 0;
  // Bound on staleness: commits older than this at the start of the read are visible. nullopt: any.
  std::optional<std::chrono::nanoseconds> max_staleness = std::chrono::nanoseconds(0);
  // Start of the read; nullopt: the time of the lookup. A call that waited for a thread sets it and
  // can then use store queries made since.
  std::optional<SteadyClock::time_point> began;
};

// Revision and staleness of an answer.
struct AsOf {
  // Revision of the store.
  uint64_t revision = 0;
  // Bound on staleness: all commits older than this at the start of the read are visible.
  std::chrono::nanoseconds staleness{0};
};

// A reader's intended use of the hulls that it requests.
struct ReadPlan {
  // Expected number of queries on each hull's current version, if known.
  uint64_t expected_queries = 0;
  // If true, the reader waits for preparation that these queries pay for (LiveHull). Otherwise
  // another thread prepares the hull for later readers.
  bool prepare_first = false;
  Freshness freshness = {};
  // If false, the read fails with WouldWait instead of blocking: it would have to query or read the
  // store, to prepare a hull, or to build boxes or canonical snapshots.
  bool may_wait = true;
};

// UNAVAILABLE, without a message, to avoid an allocation.
inline absl::Status WouldWait() { return absl::Status(absl::StatusCode::kUnavailable, ""); }

// Hulls at one revision of the store.
struct Resolved {
  AsOf as_of = {};
  // In the order of the request; NOT_FOUND if absent, DATA_LOSS if the store is damaged.
  std::vector<absl::StatusOr<HullView>> hulls = {};
};

// Result of creating or replacing a hull.
struct PutHullResult {
  uint64_t store_revision = 0;
  HullRecord hull;
  // True if no hull existed before.
  bool created = false;
};

// Replacement of a hull.
struct Replacement {
  std::string hull_id;
  // 0: the hull must not exist.
  std::optional<uint64_t> if_revision;
  bool create_if_absent = false;
  std::shared_ptr<HullBuilder> builder;
  // Sums over the points passed to the builder.
  PointCounts counts;
  // Vertices and live hull of the builder, for the store and for readers; set by
  // LocalChanges::Replace.
  std::vector<Vector> vertices = {};
  std::shared_ptr<LiveHull> live = nullptr;
};

// A body at one revision, shared by readers.
class Body;

// Kind of change of a hull, like v1::HullEventKind.
enum class ChangeKind { kPresent, kCreated, kChanged, kReplaced, kDeleted };

// Describes a hull or body in lists and replies, or its net change since a watch was last notified.
struct HullChange {
  ChangeKind kind = ChangeKind::kPresent;
  // kDeleted: only the ID, and the revision of the deletion. For a body: ID and revisions.
  HullRecord record;
  bool is_body = false;
  // For a body.
  uint64_t piece_count = 0;
  // True if the store cannot read it.
  bool damaged = false;
  // The bounding box. Empty if the hull has no vertices, or has not been in memory since the server
  // started.
  Box box = Box::Empty();
};

struct PutBodyResult {
  uint64_t store_revision = 0;
  HullChange body;
  // True if no body existed before.
  bool created = false;
};

// Bodies by ID, in the order of the request; null if absent. Each was current at some time during
// the call, the last one at store_revision.
struct FoundBodies {
  uint64_t store_revision = 0;
  std::vector<std::shared_ptr<const Body>> bodies;
  // Error of the failed lookups; their bodies are null, too.
  absl::Status status;
};

struct RegistrySizes {
  uint64_t store_revision = 0;
  uint64_t hull_count = 0;
  uint64_t vertex_count = 0;
  uint64_t body_count = 0;
};

// Memory used for hulls, and its effect on reads so far. It includes builders, points and their
// prepared form, canonical snapshots, points pending to be built, vertices pending to be stored,
// and memory that calls hold for a long time (MemoryCharge).
struct CacheStatistics : MemoryStatistics {
  // Requested hulls found in memory.
  uint64_t hits = 0;
  // Requested hulls that had to be read from the store.
  uint64_t misses = 0;
  // Hulls read back from the store.
  uint64_t loads = 0;
  // Number of times that points from a peer server were added to a hull in memory.
  uint64_t grown = 0;
  // Hulls found damaged in the store.
  uint64_t damaged = 0;
};

// A writer's chunk.
struct Chunk {
  uint64_t sequence = 0;
  std::vector<Vector> points;
  // 0: this session created the hull, and nothing was appended since.
  std::optional<uint64_t> if_revision;
};

struct ChunkResult {
  uint64_t store_revision = 0;
  bool already_applied = false;
  uint64_t hull_revision = 0;
  uint64_t vertex_count = 0;
  // All zero if the chunk was already applied.
  PointCounts counts;
};

// A hull and all of its state; private to the registry.
class RegisteredHull;
using HullPointer = std::shared_ptr<RegisteredHull>;

// A writer's open stream into one incarnation of a hull.
struct AppendSession {
  HullPointer hull;
  std::string writer_id;
  bool created_hull = false;
  uint64_t watch = 0;
  // Client charged for the chunks in fair scheduling.
  ClientId client = kNoClient;
};

struct OpenResult {
  uint64_t store_revision = 0;
  AppendSession session;
  HullRecord hull;
  uint64_t last_sequence = 0;
};

// Called exactly once with the result.
template <typename T>
using Reply = std::function<void(absl::StatusOr<T>)>;
// Called exactly once with the error. A Reply converts to it.
using Refusal = std::function<void(const absl::Status&)>;

}  // namespace hulld::server

#endif  // HULLD_SERVER_REGISTRY_CATALOG_REGISTRY_TYPES_H_
