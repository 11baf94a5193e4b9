#ifndef HULLD_SERVER_REGISTRY_CHANGES_HULL_APPENDER_H_
#define HULLD_SERVER_REGISTRY_CHANGES_HULL_APPENDER_H_

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "core/hull/growth/hull_builder.h"
#include "core/query/placed/live_hull.h"
#include "server/process/worker_pool.h"
#include "server/registry/catalog/catalog.h"
#include "server/registry/catalog/change_feed.h"
#include "server/registry/catalog/registry_types.h"
#include "server/registry/changes/hull_changes.h"
#include "server/registry/changes/hull_lifecycle.h"
#include "server/registry/memory/locked.h"
#include "server/registry/memory/memory_budget.h"
#include "server/registry/others/freshness_gate.h"
#include "server/registry/read/preparer.h"
#include "server/registry/records/record_reader.h"
#include "server/settings/config.h"
#include "server/store/store.h"

namespace hulld::server {

struct PendingChunk;
struct RegisteredHull;

// Growth of hulls: writers' sessions and their chunks.
//
// The thread that owns the hull's builder (HullState) builds a chunk without the mutex and appends
// the new vertices to the LiveHull. The resulting change is then submitted, and the next chunk of
// the hull may be built on it immediately. If the batch fails, all later chunks fail too, and the
// hull returns to its last committed state (Revert). If a peer server committed first, a chunk
// instead returns to its place in the queue and is rebuilt.
//
// Invariants, per hull and writer: chunks commit in the order of their sequences, each exactly
// once; `head` and the writer's `head` include every chunk in flight, `committed` only what the
// store has committed. Queued chunks of a hull occupy no thread.
//
// Guarded by the registry's mutex; functions without a Locked parameter acquire it.
class HullAppender {
 public:
  using HullPointer = std::shared_ptr<RegisteredHull>;

  // All must outlive this. limits: the limits in force. Registers the chunk tasks with HullChanges,
  // which runs them on `writers`.
  HullAppender(Store& store, const Limits& limits, WorkerPool& writers, FairMutex& mutex,
               Catalog& catalog, MemoryBudget& memory, ChangeFeed& feed, FreshnessGate& freshness,
               RecordReader& records, Preparer& preparer, HullLifecycle& lifecycle,
               HullChanges& changes);
  HullAppender(const HullAppender&) = delete;
  HullAppender& operator=(const HullAppender&) = delete;

  // See Registry.
  void OpenAppend(const std::string& id, const std::string& writer_id, bool create_if_absent,
                  std::function<void(const absl::Status&)> on_gone, Reply<OpenResult> done,
                  ClientId client);
  void CloseAppend(const AppendSession& session);
  void Append(const AppendSession& session, Chunk chunk, std::function<bool()> should_stop,
              std::function<void()> on_built, Reply<ChunkResult> done);

 private:
  struct OpenRequest;
  struct BuiltChunk;
  enum class Verdict;

  void RunOpen(const std::shared_ptr<OpenRequest>& request);
  void OpenLocked(Locked& locked, const std::shared_ptr<OpenRequest>& request);
  void OpenSession(Locked& locked, const HullPointer& hull,
                   const std::shared_ptr<OpenRequest>& request, uint64_t last_sequence);
  absl::StatusOr<uint64_t> CommittedSequence(Locked& locked, RegisteredHull& hull,
                                             const std::string& writer_id);
  void RunNextChunk(const HullPointer& hull);
  void RefuseChunks(const HullPointer& hull);
  void ApplyChunk(Locked& locked, const HullPointer& hull, PendingChunk& pending);
  absl::StatusOr<Verdict> CheckChunk(Locked& locked, RegisteredHull& hull,
                                     const PendingChunk& pending);
  absl::StatusOr<BuiltChunk> Build(Locked& locked, RegisteredHull& hull, PendingChunk& pending);
  absl::StatusOr<std::shared_ptr<LiveHull>> LiveForWriter(Locked& locked, RegisteredHull& hull);
  absl::StatusOr<PointCounts> AddPoints(PendingChunk& pending, const LiveHull::Mark& committed,
                                        std::span<const Vector> builder_lacks, LiveHull& live,
                                        std::unique_ptr<HullBuilder>& builder, BuiltChunk& built);
  absl::Status WhyNotBuilt(RegisteredHull& hull, const absl::Status& cause);
  static void FillChange(const RegisteredHull& hull, const PointCounts& added, Change& change);
  void SubmitChunk(Locked& locked, const HullPointer& hull, PendingChunk& pending,
                   BuiltChunk built);
  void CommitChunk(Locked& locked, const HullPointer& hull, const StoredHull& after,
                   const LiveHull::Mark& mark, const std::string& writer_id, uint64_t sequence);
  static void Revert(Locked& locked, RegisteredHull& hull);

  Store& store_;
  const Limits& limits_;
  WorkerPool& writers_;
  FairMutex& mutex_;
  Catalog& catalog_;
  MemoryBudget& memory_;
  ChangeFeed& feed_;
  FreshnessGate& freshness_;
  RecordReader& records_;
  Preparer& preparer_;
  HullLifecycle& lifecycle_;
  HullChanges& changes_;
  // Key of the newest session in RegisteredHull::watches. Guarded by mutex_.
  uint64_t last_watch_ = 0;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_REGISTRY_CHANGES_HULL_APPENDER_H_
