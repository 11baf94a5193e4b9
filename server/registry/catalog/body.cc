#include "server/registry/catalog/body.h"

#include <absl/strings/str_cat.h>

#include <mutex>
#include <utility>

#include "core/base/check.h"
#include "server/contract/errors.h"

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

uint64_t BodyTable::BytesOf(const Entry& entry) {
  return kBytesOfEntry + (entry.body_ == nullptr ? 0 : entry.body_->stored()->MemoryBytes());
}

BodyTable::Entry* BodyTable::Find(const std::string& id) {
  const auto found = entries_.find(id);
  if (found == entries_.end()) return nullptr;
  used_.splice(used_.begin(), used_, found->second.place_);
  return &found->second;
}

BodyTable::Entry& BodyTable::Add(const std::string& id) {
  const auto [place, is_new] = entries_.try_emplace(id);
  Entry& entry = place->second;
  if (is_new) {
    used_.push_front(&place->first);
    entry.place_ = used_.begin();
    bytes_ += BytesOf(entry);
  }
  return entry;
}

void BodyTable::Set(Locked& locked, const std::string& id, std::shared_ptr<const Body> body) {
  Entry* const entry = Find(id);
  HULLD_CHECK(entry != nullptr);
  bytes_ -= BytesOf(*entry);
  locked.Discard(std::exchange(entry->body_, std::move(body)));
  bytes_ += BytesOf(*entry);
}

void BodyTable::Erase(Locked& locked, const std::string& id) {
  const auto found = entries_.find(id);
  HULLD_CHECK(found != entries_.end() && !found->second.in_flight && found->second.waiting.empty());
  bytes_ -= BytesOf(found->second);
  used_.erase(found->second.place_);
  locked.Discard(std::move(found->second.body_));
  entries_.erase(found);
}

void BodyTable::DropSome(Locked& locked) {
  if (!capacity_.has_value()) return;
  int skipped = 0;
  while (bytes_ > *capacity_ && skipped < kMaxSkipped && !used_.empty()) {
    const std::string id = *used_.back();
    if (entries_.at(id).IsUnused()) {
      Erase(locked, id);
    } else {
      ++skipped;
      used_.splice(used_.begin(), used_, std::prev(used_.end()));
    }
  }
}

std::string Quoted(const std::string& kind, const std::string& id) {
  return absl::StrCat(kind, " \"", id, "\"");
}

absl::Status NotFound(const std::string& kind, const std::string& id, bool is_other_kind) {
  const bool is_body = kind == "body";
  const char* const other =
      is_body ? "\" is a hull, not a body" : "\" is a body; this call requires a hull";
  return WithReason(absl::NotFoundError(is_other_kind ? absl::StrCat("\"", id, other)
                                                      : Quoted(kind, id) + " not found"),
                    is_body ? v1::ERROR_REASON_BODY_NOT_FOUND : v1::ERROR_REASON_HULL_NOT_FOUND,
                    {{kind + "_id", id}});
}

absl::Status IdTaken(const std::string& kind, const std::string& id) {
  return WithReason(absl::AlreadyExistsError(
                        absl::StrCat("\"", id, "\" is a ", kind,
                                     ", and hulls and bodies share their IDs; choose another "
                                     "ID, or delete the ",
                                     kind, " first")),
                    kind == "body" ? v1::ERROR_REASON_BODY_EXISTS : v1::ERROR_REASON_HULL_EXISTS,
                    {{kind + "_id", id}});
}

absl::Status CheckRevision(const std::string& kind, const std::string& id, uint64_t revision,
                           std::optional<uint64_t> if_revision) {
  if (if_revision.value_or(revision) == revision) return absl::OkStatus();
  const std::string found =
      revision == 0
          ? absl::StrCat(" does not exist or is damaged, so it is not at revision ", *if_revision)
          : absl::StrCat(" is at revision ", revision, ", not ", *if_revision);
  return WithReason(
      absl::AbortedError(
          absl::StrCat(Quoted(kind, id), found, " (if_revision); read it again, then retry")),
      v1::ERROR_REASON_REVISION_MISMATCH,
      {{kind + "_id", id}, {"if_revision", *if_revision}, {"current_revision", revision}});
}

}  // namespace hulld::server
