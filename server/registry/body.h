#ifndef HULLD_SERVER_REGISTRY_BODY_H_
#define HULLD_SERVER_REGISTRY_BODY_H_

#include <absl/status/status.h>

#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/query/body/query_body.h"
#include "server/process/synchronization.h"
#include "server/registry/memory/locked.h"
#include "server/registry/memory/memory_budget.h"
#include "server/registry/registry_types.h"
#include "server/store/body_record.h"

namespace hulld::server {

// A body of one revision. Immutable but for the boxes about its pieces, which are made when the
// first question needs them, and again when a hull of a piece has changed since. Thread-safe.
class Body {
 public:
  Body(StoredBody stored, MemoryBudget& budget)
      : stored_(std::make_shared<StoredBody>(std::move(stored))),
        charge_(budget, MemoryUse::kWriting, stored_->MemoryBytes()),
        box_charge_(budget, MemoryUse::kReading) {}
  // One that the store cannot give back. damage: not OK.
  Body(const std::string& id, absl::Status damage, MemoryBudget& budget)
      : Body(StoredBody{{id, 0, 0}, {}, {}}, budget) {
    damage_ = std::move(damage);
  }

  const BodyRecord& record() const { return stored_->record; }
  const std::vector<std::string>& hull_ids() const { return stored_->hull_ids; }
  const std::vector<StoredPiece>& pieces() const { return stored_->pieces; }
  // OK unless the store cannot give it back.
  const absl::Status& damage() const { return damage_; }
  // As watches are told of it.
  HullChange Describe() const;

  // Boxes about these pieces, which are those of this body, of hulls at these revisions.
  std::shared_ptr<const PieceBoxes> BoxesOf(std::span<const BodyPiece> pieces,
                                            std::vector<uint64_t> hull_revisions) const;

  // For the store, which gives it its revisions as it commits it, before others know it.
  const std::shared_ptr<StoredBody>& stored() const { return stored_; }

 private:
  const std::shared_ptr<StoredBody> stored_;
  absl::Status damage_;

  const MemoryCharge charge_;

  mutable Mutex mutex_;
  // Guarded by mutex_.
  mutable MemoryCharge box_charge_;
  mutable std::vector<uint64_t> box_revisions_;
  mutable std::shared_ptr<const PieceBoxes> boxes_;
};

// What the registry knows of an ID that is, or is about to be, a body's. Guarded by its mutex.
struct RegisteredBody {
  // Null until the first is committed.
  std::shared_ptr<const Body> committed;
  // A change of it is submitted and neither committed nor refused; others wait for that.
  bool in_flight = false;
  std::deque<std::function<void(Locked&)>> waiting;
};

// ALREADY_EXISTS: a hull cannot have the ID.
absl::Status BodyExists(const std::string& id);
absl::Status BodyNotFound(const std::string& id);
std::string QuotedBody(const std::string& id);

}  // namespace hulld::server

#endif  // HULLD_SERVER_REGISTRY_BODY_H_
