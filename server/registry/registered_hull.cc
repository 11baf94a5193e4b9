#include "server/registry/registered_hull.h"

#include <absl/strings/str_cat.h>

#include <utility>

#include "server/contract/error_info.h"

namespace hulld::server {

RegisteredHull::RegisteredHull(const StoredHull& stored, const HullState& initial, bool readable,
                               MemoryBudget& budget)
    : state(initial),
      readable_from_store(readable),
      committed(stored),
      head(stored),
      served(stored.record.vertex_count == 0 ? EmptyServedHull() : nullptr),
      account(budget, [this](Locked& locked) { return DropUnused(locked); }) {}

void RegisteredHull::DiscardBuilder(Locked& locked) {
  if (builder == nullptr) return;
  locked.Discard(std::move(builder));
  builder_bytes = 0;
}

uint64_t RegisteredHull::HeadSequence(const std::string& writer_id) const {
  const auto writer = writers.find(writer_id);
  return writer == writers.end() ? 0 : writer->second.head;
}

uint64_t RegisteredHull::MemoryBytes() const {
  const bool counts = served != nullptr && served != EmptyServedHull();
  return builder_bytes + (counts ? served->MemoryBytes() : 0);
}

uint64_t RegisteredHull::DropUnused(Locked& locked) {
  if (state.quiet() && !state.pinned() && chunks.empty()) {
    if (readable_from_store) DiscardBuilder(locked);
    const bool can_make_again = readable_from_store || builder != nullptr;
    if (can_make_again && served.use_count() == 1) locked.Discard(std::exchange(served, nullptr));
  }
  return MemoryBytes();
}

const std::shared_ptr<const ServedHull>& EmptyServedHull() {
  static const auto* const empty =
      new std::shared_ptr<const ServedHull>(std::make_shared<const ServedHull>(Hull()));
  return *empty;
}

std::string QuotedHull(const std::string& id) { return absl::StrCat("hull \"", id, "\""); }

absl::Status HullNotFound(const std::string& id) {
  return WithReason(
      absl::NotFoundError(absl::StrCat(QuotedHull(id), " not found; create it first")),
      v1::ERROR_REASON_HULL_NOT_FOUND, {{"hull_id", id}});
}

absl::Status RevisionMismatch(const HullRecord& record, uint64_t if_revision) {
  return WithReason(absl::AbortedError(absl::StrCat(QuotedHull(record.hull_id), " is at revision ",
                                                    record.revision, ", not ", if_revision,
                                                    " (if_revision); read it again, then retry")),
                    v1::ERROR_REASON_REVISION_MISMATCH,
                    {{"hull_id", record.hull_id},
                     {"if_revision", if_revision},
                     {"current_revision", record.revision}});
}

}  // namespace hulld::server
