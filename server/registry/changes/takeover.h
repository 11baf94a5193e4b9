#ifndef HULLD_SERVER_REGISTRY_CHANGES_TAKEOVER_H_
#define HULLD_SERVER_REGISTRY_CHANGES_TAKEOVER_H_

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "server/registry/catalog/catalog.h"
#include "server/registry/catalog/change_feed.h"
#include "server/registry/catalog/registry_types.h"
#include "server/registry/changes/hull_changes.h"
#include "server/registry/memory/locked.h"
#include "server/registry/memory/memory_budget.h"
#include "server/registry/others/after_others.h"
#include "server/registry/read/preparer.h"
#include "server/registry/records/record_reader.h"
#include "server/store/store.h"

namespace hulld::server {

struct RegisteredHull;

// Takes over what other servers committed to the same store, as of one of their batches: puts it in
// the place of what was known, tells watches, and lets go on what waited for it.
//
// It runs on the committer's thread, so that nothing of what it takes over is being committed here
// meanwhile, after the changes that it supersedes were refused. Invariant: nothing of these IDs is
// in flight; but a thread may build a chunk on a hull, or read a record, and finds by the state of
// the hull, or of the reading, that it was overtaken.
//
// Guarded by the registry's mutex.
class Takeover {
 public:
  using HullPointer = std::shared_ptr<RegisteredHull>;

  // Hulls that are advanced at a time by what other servers added, and the points of all of them:
  // some milliseconds under the mutex.
  static constexpr size_t kMostGrownHulls = 1 << 10;
  static constexpr uint64_t kMostGrowth = 1 << 16;

  // All must outlive this.
  Takeover(Catalog& catalog, MemoryBudget& memory, ChangeFeed& feed, AfterOthers& after_others,
           RecordReader& records, Preparer& preparer, HullChanges& changes)
      : catalog_(catalog),
        memory_(memory),
        feed_(feed),
        after_others_(after_others),
        records_(records),
        preparer_(preparer),
        changes_(changes) {}
  Takeover(const Takeover&) = delete;
  Takeover& operator=(const Takeover&) = delete;

  // Hulls whose points are in memory and that only grew, as far as they can be added within one
  // hold of the mutex. What is committed here stays so until Take is told of the same changes, as
  // the same thread does both.
  std::vector<HullGrowth> GrownHulls(const OtherChanges& others) const;
  void Take(Locked& locked, const OtherChanges& others);

 private:
  struct Former;

  void TakeOne(Locked& locked, const std::string& id, const OtherChange& other, uint64_t since);
  Former FindFormer(const std::string& id, const OtherChange& other, uint64_t since);
  std::optional<BodyRecord> FindFormerBody(const std::string& id, const OtherChange& other,
                                           uint64_t since);
  bool TakeVersion(Locked& locked, const HullPointer& hull, const OtherChange& other, bool is_news);
  void EndFormer(Locked& locked, const HullPointer& former, const OtherChange& other);
  void TakeBody(Locked& locked, const std::string& id, const OtherChange& other);
  void Tell(Locked& locked, const std::string& id, const OtherChange& other, const Former& former,
            uint64_t since);
  void TellOfBody(Locked& locked, const std::string& id, const OtherChange& other,
                  const Former& former, const std::shared_ptr<const Body>& body);
  void TellOfHull(Locked& locked, const HullPointer& hull, const Former& former, uint64_t since);
  void TellOfEnd(Locked& locked, const std::string& id, const OtherChange& other,
                 const Former& former, bool has_body);

  Catalog& catalog_;
  MemoryBudget& memory_;
  ChangeFeed& feed_;
  AfterOthers& after_others_;
  RecordReader& records_;
  Preparer& preparer_;
  HullChanges& changes_;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_REGISTRY_CHANGES_TAKEOVER_H_
