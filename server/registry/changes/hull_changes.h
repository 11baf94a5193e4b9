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

// Brings the changes of hulls to the committer, and lets what waits for a hull go on in its order:
// first what needs the hull to be quiet (RegisteredHull::exclusive: creations, deletions,
// replacements), then chunks (RegisteredHull::chunks), which may overlap.
//
// Invariant: after each step of a hull's HullState, Advance is called, so that nothing that could
// go on waits. Guarded by the registry's mutex.
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

  // What is to be done with chunks, on a thread of the writers and without the mutex. run: with the
  // next one of a hull, which is kScheduled. refuse: with all of a hull that cannot grow any more.
  // Before the first chunk.
  void SetChunkTasks(ChunkTask run, ChunkTask refuse) {
    run_chunk_ = std::move(run);
    refuse_chunks_ = std::move(refuse);
  }

  // Submits a change that follows all changes of its hull submitted before; `hull` is in the state
  // that says so. finish: called after the step of the state, before what waits for the hull goes
  // on.
  void Submit(Locked& locked, const HullPointer& hull, Change change, Committer::Completion finish);
  // Lets whatever waits for the hull go on.
  void Advance(Locked& locked, const HullPointer& hull);
  // The same once everything that other servers did is taken over.
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
