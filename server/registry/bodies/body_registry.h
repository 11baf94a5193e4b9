#ifndef HULLD_SERVER_REGISTRY_BODIES_BODY_REGISTRY_H_
#define HULLD_SERVER_REGISTRY_BODIES_BODY_REGISTRY_H_

#include <absl/status/status.h>

#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>

#include "server/registry/catalog/body.h"
#include "server/registry/catalog/registry_types.h"
#include "server/registry/commit/committer.h"
#include "server/registry/memory/locked.h"
#include "server/registry/peers/read_barrier.h"
#include "server/registry/records/record_reader.h"
#include "server/registry/state/registry_state.h"

namespace hulld::server {

// Creation, change, deletion, and lookup of bodies. A body is small compared to the hulls of its
// pieces, so a known body is entirely in memory, counted like memory that calls hold for a long
// time.
//
// Invariants:
// - At most one change of a body is in flight (BodyTable::Entry::in_flight). Tasks that depend on
//   the ID wait in the entry and resume in order after it, or, if a peer server committed first,
//   after its change is applied (ReadBarrier::Defer).
// - A body becomes visible to all readers atomically after its commit. A refused change leaves the
//   previous state unchanged.
// - A hull and a body never share an ID: a put is refused if a hull has the ID, and waits while the
//   creation or end of a hull is in flight.
//
// Guarded by the registry's mutex; functions without a Locked parameter acquire it.
class BodyRegistry {
 public:
  // All must outlive this.
  BodyRegistry(RegistryState& state, Committer& committer, ReadBarrier& barrier,
               RecordReader& records)
      : state_(state), committer_(committer), barrier_(barrier), records_(records) {}
  BodyRegistry(const BodyRegistry&) = delete;
  BodyRegistry& operator=(const BodyRegistry&) = delete;

  // Creates or replaces a body atomically for all readers, and assigns its revisions. Calls `done`,
  // on this or another thread, after the change is committed or refused. Requires: valid IDs and
  // poses (not checked), and between one and --max-pieces-per-body pieces. The hulls of the pieces
  // need not exist. ALREADY_EXISTS: a hull has the ID; ABORTED: if_revision does not match;
  // RESOURCE_EXHAUSTED: --max-hulls, --memory-limit, or the disk is full; UNAVAILABLE: the store
  // cannot be written.
  void Put(StoredBody stored, std::optional<uint64_t> if_revision,
           const Reply<PutBodyResult>& done);
  // Removes a body. Replies with the store's revision, as Put. NOT_FOUND; ABORTED: if_revision does
  // not match; RESOURCE_EXHAUSTED: the disk is full; UNAVAILABLE: the store cannot be written.
  void Delete(const std::string& id, std::optional<uint64_t> if_revision,
              const Reply<uint64_t>& done);
  // Loads unknown records from the store, so it must not run on a gRPC thread. Status: UNAVAILABLE:
  // the store cannot be read; CANCELLED: should_stop returned true; RESOURCE_EXHAUSTED: a read is
  // needed, and readers exceed their share of --memory-limit. Cost: O(log n) each, and one store
  // query per kMaxLookupsPerHold; the mutex is released in between. may_wait: as in ReadPlan.
  FoundBodies Find(std::span<const std::string> ids, const std::function<bool()>& should_stop = {},
                   bool may_wait = true);

 private:
  absl::Status CheckPut(Locked& locked, const std::string& id, std::optional<uint64_t> if_revision);
  absl::Status NoSuchBody(const std::string& id) const;
  void Submit(Locked& locked, Change change, Committer::Completion finish);
  void Complete(Locked& locked, const std::string& id, const Committer::Completion& finish,
                const absl::Status& status, Change& change);

  RegistryState& state_;
  Committer& committer_;
  ReadBarrier& barrier_;
  RecordReader& records_;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_REGISTRY_BODIES_BODY_REGISTRY_H_
