#include "server/registry/catalog/body.h"

#include <absl/strings/str_cat.h>

#include <mutex>

#include "server/contract/error_info.h"

namespace hulld::server {

std::shared_ptr<const PieceBoxes> Body::BoxesOf(std::span<const BodyPiece> pieces,
                                                std::vector<uint64_t> hull_revisions) const {
  {
    const std::lock_guard lock(mutex_);
    if (boxes_ != nullptr && box_revisions_ == hull_revisions) return boxes_;
  }
  // Built without the mutex: two readers may build the same boxes.
  auto boxes = std::make_shared<const PieceBoxes>(pieces);
  const std::lock_guard lock(mutex_);
  boxes_ = boxes;
  box_revisions_ = std::move(hull_revisions);
  box_charge_.Set(boxes_->MemoryBytes() + box_revisions_.capacity() * sizeof(uint64_t));
  return boxes;
}

HullChange Body::Describe(const StoredBody& stored, const absl::Status& damage) {
  HullChange change;
  change.record.hull_id = stored.record.body_id;
  change.record.create_revision = stored.record.create_revision;
  change.record.revision = stored.record.revision;
  change.is_body = true;
  change.piece_count = stored.pieces.size();
  change.damaged = !damage.ok();
  return change;
}

std::string QuotedBody(const std::string& id) { return absl::StrCat("body \"", id, "\""); }

absl::Status IdTaken(const std::string& kind, const std::string& id) {
  return WithReason(absl::AlreadyExistsError(
                        absl::StrCat("\"", id, "\" is a ", kind,
                                     ", and hulls and bodies share their IDs; choose another "
                                     "ID, or delete the ",
                                     kind, " first")),
                    kind == "body" ? v1::ERROR_REASON_BODY_EXISTS : v1::ERROR_REASON_HULL_EXISTS,
                    {{kind + "_id", id}});
}

absl::Status BodyNotFound(const std::string& id) {
  return WithReason(absl::NotFoundError(absl::StrCat(QuotedBody(id), " not found")),
                    v1::ERROR_REASON_BODY_NOT_FOUND, {{"body_id", id}});
}

}  // namespace hulld::server
