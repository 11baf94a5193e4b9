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
#include "core/query/placed/live_hull.h"
#include "server/process/fair_queue.h"
#include "server/process/synchronization.h"
#include "server/registry/memory/served_hull.h"
#include "server/store/body_record.h"
#include "server/store/hull_record.h"

// What the registry is asked and what it answers.
namespace hulld::server {

// A body as one call sees it (bodies/served_body.h).
struct ServedBody;

// A hull as one reader sees it: what is served belongs to the record's revision. Or a body where
// those are asked for (ResolvePlaced): then `record` holds its ID and revisions alone, and `served`
// is null.
struct HullView {
  HullRecord record;
  std::shared_ptr<const ServedHull> served;
  std::shared_ptr<const ServedBody> body = nullptr;
};

// How fresh what a read is answered from must be, where other servers commit to the same store; as
// proto/hulld/v1/freshness.proto says. All of it must hold. By default a read is linearizable.
struct Freshness {
  // However old, without asking: for one that the registry told of a change, which then is here.
  static Freshness OfWhatIsHere() { return {0, std::nullopt, std::nullopt}; }

  uint64_t at_least_revision = 0;
  // What was committed up to this long before the read began is to be seen; none: however old.
  std::optional<std::chrono::nanoseconds> max_staleness = std::chrono::nanoseconds(0);
  // When the read began; none: when it is made. A call that waits for a thread meanwhile gives it,
  // and is content with what others asked in between.
  std::optional<SteadyClock::time_point> began;
};

// What the answer to a read is of.
struct AsOf {
  // The revision of the store.
  uint64_t revision = 0;
  // Everything that was committed up to this long before the read began is seen; at least.
  std::chrono::nanoseconds staleness{0};
};

// What a reader is about to do with the hulls that it asks for.
struct ReadPlan {
  // Questions that it will ask of each hull as it is now, if it knows.
  uint64_t expected_questions = 0;
  // It will wait while what these questions pay for is prepared (LiveHull). Otherwise another
  // thread prepares it for later ones.
  bool prepare_first = false;
  Freshness freshness = {};
};

// Hulls that all were current at one revision of the store.
struct Resolved {
  AsOf as_of() const { return {store_revision, staleness}; }

  uint64_t store_revision = 0;
  // As in AsOf.
  std::chrono::nanoseconds staleness{0};
  // In the order asked for; NOT_FOUND where there is none, DATA_LOSS where the store is damaged.
  std::vector<absl::StatusOr<HullView>> hulls;
};

struct CreateResult {
  uint64_t store_revision = 0;
  HullRecord hull;
  bool created = false;
};

struct ReplaceResult {
  uint64_t store_revision = 0;
  HullRecord hull;
  // Whether there was none before.
  bool created = false;
};

// What takes the place of a hull.
struct Replacement {
  std::string hull_id;
  // 0: the hull must not exist.
  std::optional<uint64_t> if_revision;
  bool create_if_absent = false;
  std::shared_ptr<HullBuilder> builder;
  // Sums over the points that the builder was given.
  PointCounts counts;
  // The builder's, for the store and for readers; Registry::Replace fills them.
  std::vector<Vector> vertices = {};
  std::shared_ptr<LiveHull> live = nullptr;
};

struct ListedHull {
  HullRecord record;
  // The store cannot read it; of a damaged record no more than the ID is known.
  bool damaged = false;
};

struct HullPage {
  uint64_t store_revision = 0;
  std::vector<ListedHull> hulls;
  bool more = false;
};

// A body of one revision, known to many readers.
class Body;

struct PutBodyResult {
  uint64_t store_revision = 0;
  BodyRecord body;
  uint64_t piece_count = 0;
  // Whether there was none before.
  bool created = false;
};

struct BodyPage {
  uint64_t store_revision = 0;
  // Those that are damaged, too.
  std::vector<std::shared_ptr<const Body>> bodies;
  bool more = false;
};

// Bodies by ID, in the order asked for, each of some moment of the call; null where there is none.
// The last one was current at the revision.
struct FoundBodies {
  uint64_t store_revision = 0;
  std::vector<std::shared_ptr<const Body>> bodies;
  // Why some could not be looked for, which then are null, too.
  absl::Status status;
};

struct RegistrySizes {
  uint64_t store_revision = 0;
  uint64_t hull_count = 0;
  uint64_t vertex_count = 0;
  uint64_t body_count = 0;
};

// What the registry holds of hulls in memory, and how that served so far.
struct CacheStatistics {
  // Builders, points and what is prepared of them, canonical snapshots; points that wait to be
  // built, and vertices that wait for the store; and what calls hold for long (MemoryCharge).
  uint64_t bytes = 0;
  // What of that is held for readers, and for writers (MemoryUse).
  uint64_t reading_bytes = 0;
  uint64_t writing_bytes = 0;
  uint64_t limit_bytes = 0;
  // Hulls that a reader asked for and that were in memory.
  uint64_t hits = 0;
  // Those that had to be read from the store.
  uint64_t misses = 0;
  // Hulls read back from the store.
  uint64_t loads = 0;
  // How often a hull in memory was advanced by the points that another server added to it.
  uint64_t grown = 0;
  // How often a hull dropped its builder or what it serves to stay within the limit.
  uint64_t evictions = 0;
  // Hulls found damaged in the store.
  uint64_t damaged = 0;
};

// One chunk of a writer.
struct Chunk {
  uint64_t sequence = 0;
  std::vector<Vector> points;
  // 0: this session created the hull and nothing was appended since.
  std::optional<uint64_t> if_revision;
};

struct ChunkResult {
  uint64_t store_revision = 0;
  bool already_applied = false;
  uint64_t hull_revision = 0;
  uint64_t vertex_count = 0;
  // All zero when already applied.
  PointCounts counts;
};

// One hull and all that belongs to it; known to the registry alone.
struct RegisteredHull;

// One writer's open stream into one incarnation of a hull.
struct AppendSession {
  std::shared_ptr<RegisteredHull> hull;
  std::string writer_id;
  bool created_hull = false;
  uint64_t watch = 0;
  // In whose turn its chunks are built.
  ClientId client = kNoClient;
};

struct OpenResult {
  uint64_t store_revision = 0;
  AppendSession session;
  HullRecord hull;
  uint64_t last_sequence = 0;
};

// What a watch is about: hulls whose IDs start with a prefix, or hulls by ID.
struct WatchTarget {
  // The second form where `ids` holds any.
  std::string prefix;
  std::vector<std::string> ids;
  // Bodies, too.
  bool bodies = false;
  // IDs come and go later (Registry::WatchAlso), so that no other watch shares what is kept.
  bool varies = false;

  bool operator==(const WatchTarget&) const = default;
};

// What became of a hull, as v1::HullEventKind says.
enum class ChangeKind { kPresent, kCreated, kChanged, kReplaced, kDeleted };

// All that happened to a hull, or to a body, since a watch was told of it, as one change.
struct HullChange {
  ChangeKind kind = ChangeKind::kPresent;
  // kDeleted: the ID alone, and in `revision` that of the deletion. For a body: ID and revisions.
  HullRecord record;
  bool is_body = false;
  // For a body.
  uint64_t piece_count = 0;
  // The store cannot read it.
  bool damaged = false;
  // Whether `low` and `high` are the corners of its bounding box. Not so for a hull without
  // vertices, and for one that was not in memory since the server started.
  bool has_box = false;
  Vector low;
  Vector high;
};

// What a watch is told next.
struct WatchPiece {
  // There is nothing to tell; the watch's on_ready is called, once, when there is.
  bool waits = false;
  // Every change up to this revision was told, or is in `changes`, unless it was superseded.
  uint64_t revision = 0;
  std::vector<HullChange> changes;
  // As in v1::WatchHullsResponse.
  bool synced = false;
  bool anew = false;
};

// Where a watch begins.
struct WatchStart {
  // From what is there; otherwise from what changes.
  bool tell_present = false;
  // Resumes a watch that was told everything up to this revision of that store; 0: does not.
  uint64_t after_revision = 0;
  std::string store_id = {};
};

// Called once with the answer.
template <typename T>
using Reply = std::function<void(absl::StatusOr<T>)>;
// Called once with why there is none. A Reply is one.
using Refusal = std::function<void(const absl::Status&)>;

}  // namespace hulld::server

#endif  // HULLD_SERVER_REGISTRY_CATALOG_REGISTRY_TYPES_H_
