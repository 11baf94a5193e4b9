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

// Applies a batch of changes that peer servers committed to the same store: replaces the known
// state, notifies watches, and resumes tasks that waited for it.
//
// Runs on the committer's thread, after the superseded local changes were refused, so nothing that
// it touches is being committed. Invariant: no change of these IDs is in flight. A thread may still
// build a chunk on such a hull, or read its record; the state of the hull, or of the reading, shows
// that it was superseded.
//
// Guarded by the registry's mutex.
class Takeover {
 public:
  using HullPointer = std::shared_ptr<RegisteredHull>;

  // Maximum number of hulls that grow by peer servers' points within one hold of the mutex, and of
  // their points in total: some milliseconds.
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

  // Returns the hulls that are in memory and only grew, up to the limits of a single hold of the
  // mutex. The committed state does not change before Take applies the same changes, because the
  // same thread calls both.
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
