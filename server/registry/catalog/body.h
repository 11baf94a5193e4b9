#ifndef HULLD_SERVER_REGISTRY_CATALOG_BODY_H_
#define HULLD_SERVER_REGISTRY_CATALOG_BODY_H_

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "core/query/body/query_body.h"
#include "server/process/synchronization.h"
#include "server/registry/catalog/registry_types.h"
#include "server/registry/memory/memory_budget.h"
#include "server/store/body_record.h"

namespace hulld::server {

// A body at one revision. Immutable except for the boxes of its pieces, which are built by the
// first query and rebuilt after a hull of a piece changed. Thread-safe.
class Body {
 public:
  // use: the memory use to which the body is charged.
  Body(StoredBody stored, MemoryBudget& budget, MemoryUse use)
      : stored_(std::make_shared<StoredBody>(std::move(stored))),
        charge_(budget, use, stored_->MemoryBytes()),
        box_charge_(budget, MemoryUse::kReading) {}
  // A body as read from the store; damaged if `stored` is not OK.
  Body(const std::string& id, const absl::StatusOr<StoredBody>& stored, MemoryBudget& budget,
       MemoryUse use)
      : Body(stored.ok() ? *stored : StoredBody{{id, 0, 0}, {}, {}}, budget, use) {
    damage_ = stored.status();
  }

  const BodyRecord& record() const { return stored_->record; }
  const std::vector<std::string>& hull_ids() const { return stored_->hull_ids; }
  const std::vector<StoredPiece>& pieces() const { return stored_->pieces; }
  // OK unless the store cannot read the body back.
  const absl::Status& damage() const { return damage_; }
  // Describes the body for watches.
  HullChange Describe() const { return Describe(*stored_, damage_); }
  static HullChange Describe(const StoredBody& stored, const absl::Status& damage);

  // Returns boxes of the pieces. Requires: `pieces` belong to this body, and their hulls are at
  // `hull_revisions`.
  std::shared_ptr<const PieceBoxes> BoxesOf(std::span<const BodyPiece> pieces,
                                            std::vector<uint64_t> hull_revisions) const;

  // For the store, which assigns revisions at commit, before the body is visible.
  const std::shared_ptr<StoredBody>& stored() const { return stored_; }

 private:
  const std::shared_ptr<StoredBody> stored_;
  absl::Status damage_;

  const MemoryCharge charge_;

  mutable Mutex mutex_;
  // mutex_ guards the members below.
  mutable MemoryCharge box_charge_;
  mutable std::vector<uint64_t> box_revisions_;
  mutable std::shared_ptr<const PieceBoxes> boxes_;
};

// A body as seen by one call. References the hulls of its pieces; charged to --memory-limit.
struct ServedBody {
  std::shared_ptr<const Body> body;
  // In the order of Body::hull_ids().
  std::vector<HullView> hulls;
  QueryBody query;
  MemoryCharge charge;

  const HullView& hull_of(uint32_t piece) const { return hulls[body->pieces()[piece].hull]; }
};

// ALREADY_EXISTS: the ID requested for a hull belongs to a body, or the reverse. kind: that of the
// existing object, "hull" or "body".
absl::Status IdTaken(const std::string& kind, const std::string& id);
absl::Status BodyNotFound(const std::string& id);
std::string QuotedBody(const std::string& id);

}  // namespace hulld::server

#endif  // HULLD_SERVER_REGISTRY_CATALOG_BODY_H_
