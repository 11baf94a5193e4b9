#ifndef HULLD_SERVER_REGISTRY_READ_HULL_READER_H_
#define HULLD_SERVER_REGISTRY_READ_HULL_READER_H_

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <cstdint>
#include <functional>
#include <span>
#include <string>

#include "server/process/metrics.h"
#include "server/process/task_pool.h"
#include "server/registry/catalog/known_hulls.h"
#include "server/registry/catalog/registry_types.h"
#include "server/registry/memory/locked.h"
#include "server/registry/peers/peer_sync.h"
#include "server/registry/records/record_reader.h"
#include "server/registry/state/registry_state.h"

namespace hulld::server {

// Returns hulls ready to be served, all at one revision.
//
// A read releases the mutex after every kMaxLookupsPerHold lookups. At the end, it looks up the
// hulls that have changed since, until all that remain fit into one critical section: all hulls are
// then at one revision. This terminates, because a commit takes longer than a lookup. Readers and
// writers never wait for each other: a reader gets the version of the committed state, created in
// O(1), and never uses a builder.
//
// A read waits only for the store: for the record of an unknown hull (RecordReader), and for points
// that are not in memory. One reader loads a hull for all that request it
// (RegisteredHull::is_loading). Other threads help a read that loads many hulls. A read finishes
// its own loads before it waits for another read, because the other read may be waiting for them.
//
// Guarded by the registry's mutex, which this class acquires, and releases to wait and to prepare.
class HullReader {
 public:
  // All must outlive this. loaders: threads that help readers of many hulls.
  HullReader(RegistryState& state, PeerSync& peers, RecordReader& records, TaskPool& loaders)
      : state_(state), peers_(peers), records_(records), loaders_(loaders) {}
  HullReader(const HullReader&) = delete;
  HullReader& operator=(const HullReader&) = delete;

  // Like Registry::Resolve, for a caller that repeatedly requests the same hulls: `known` persists
  // between calls, and only hulls changed since are looked up.
  absl::StatusOr<Resolved> Refresh(std::span<const std::string> ids, KnownHulls& known,
                                   const std::function<bool()>& should_stop,
                                   const ReadPlan& plan = {});
  // Returns the canonical snapshot of a resolved hull, built at first use; it lives as long as
  // view.served. Not for gRPC threads. DATA_LOSS: the store is damaged. CANCELLED: should_stop
  // returned true. RESOURCE_EXHAUSTED: it is not built yet, and readers exceed their share of
  // --memory-limit. Cost: building the hull.
  absl::StatusOr<const Hull*> Canonical(const HullView& view,
                                        const std::function<bool()>& should_stop);
  // Sets the histogram of snapshot build times. Call before the first; it must outlive this.
  void SetMetrics(prometheus::Histogram& snapshot_seconds) {
    snapshot_seconds_ = &snapshot_seconds;
  }

 private:
  struct HullsRead;

  absl::Status LookUpAll(Locked& locked, const HullsRead& read);
  size_t FindAhead(const HullsRead& read);
  absl::Status LookUp(Locked& locked, const HullsRead& read, uint32_t k);
  static absl::Status NoteFailure(const absl::Status& status, KnownHulls::Known& known);
  absl::Status AwaitRecord(Locked& locked, const HullsRead& read, uint32_t k);
  static bool IsHeld(const KnownHulls::Known& known, const RegisteredHull& hull);
  void NoteView(Locked& locked, const HullPointer& hull, KnownHulls& hulls, uint32_t k,
                bool was_missing);
  absl::Status CheckReaders(Locked& locked, const KnownHulls& known);

  void LoadMany(Locked& locked, const HullsRead& read);
  absl::Status LoadOne(Locked& locked, RegisteredHull& hull,
                       const std::function<bool()>& should_stop);

  RegistryState& state_;
  PeerSync& peers_;
  RecordReader& records_;
  TaskPool& loaders_;
  // May be null.
  prometheus::Histogram* snapshot_seconds_ = nullptr;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_REGISTRY_READ_HULL_READER_H_
