#ifndef HULLD_SERVER_REGISTRY_CHANGES_HULL_CHANGES_H_
#define HULLD_SERVER_REGISTRY_CHANGES_HULL_CHANGES_H_

#include <functional>
#include <memory>
#include <utility>

#include "server/process/worker_pool.h"
#include "server/registry/catalog/catalog.h"
#include "server/registry/commit/committer.h"
#include "server/registry/memory/locked.h"
#include "server/registry/memory/memory_budget.h"
#include "server/registry/others/after_others.h"

namespace hulld::server {

struct RegisteredHull;

// Submits changes of hulls to the committer and resumes the tasks that wait for a hull: first tasks
// that need the hull to be quiet (RegisteredHull::exclusive: creations, deletions, replacements),
// then chunks (RegisteredHull::chunks), which may overlap.
//
// Invariant: Advance follows each transition of a hull's HullState, so no runnable task is left
// waiting. Guarded by the registry's mutex.
class HullChanges {
 public:
  using HullPointer = std::shared_ptr<RegisteredHull>;
  using ChunkTask = std::function<void(const HullPointer&)>;

  // All must outlive this. writers: threads that build chunks.
  HullChanges(Catalog& catalog, MemoryBudget& memory, Committer& committer,
              AfterOthers& after_others, WorkerPool& writers)
      : catalog_(catalog),
        memory_(memory),
        committer_(committer),
        after_others_(after_others),
        writers_(writers) {}
  HullChanges(const HullChanges&) = delete;
  HullChanges& operator=(const HullChanges&) = delete;

  // Sets the tasks for chunks, called on a thread of `writers` without the mutex. run: processes
  // the next chunk of a hull in kScheduled. refuse: refuses all chunks of a hull that can no longer
  // grow. Call before the first chunk.
  void SetChunkTasks(ChunkTask run, ChunkTask refuse) {
    run_chunk_ = std::move(run);
    refuse_chunks_ = std::move(refuse);
  }

  // Submits a change that follows all earlier changes of its hull. Requires: the state of `hull`
  // counts it as in flight. finish: called after the state's transition, before waiting tasks
  // resume.
  void Submit(Locked& locked, const HullPointer& hull, Change change, Committer::Completion finish);
  // Resumes the tasks that wait for the hull.
  void Advance(Locked& locked, const HullPointer& hull);
  // As Advance, after all pending peer changes are applied.
  void AdvanceLater(const HullPointer& hull);

 private:
  Catalog& catalog_;
  MemoryBudget& memory_;
  Committer& committer_;
  AfterOthers& after_others_;
  WorkerPool& writers_;
  ChunkTask run_chunk_;
  ChunkTask refuse_chunks_;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_REGISTRY_CHANGES_HULL_CHANGES_H_
