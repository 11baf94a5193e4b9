#include "server/registry/records/record_gate.h"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <memory>
#include <utility>

namespace hulld::server {
namespace {

// The store was asked after it had said to be at `asked_at`.
absl::Status WentBack(uint64_t found, uint64_t asked_at) {
  return absl::UnavailableError(
      absl::StrCat("the store answers as of revision ", found, ", and was at ", asked_at,
                   " before: it was put back to an earlier time, or another database answers"));
}

absl::Status IsAhead(uint64_t found, uint64_t known) {
  return absl::UnavailableError(absl::StrCat("the store holds changes up to revision ", found,
                                             ", and only those up to ", known,
                                             " are known to be committed; try again"));
}

}  // namespace

void RecordGate::WhenReached(Locked& locked, uint64_t asked_at, absl::StatusOr<FoundRecords> found,
                             FoundTaker take) {
  if (found.ok() && found->revision < asked_at) found = WentBack(found->revision, asked_at);
  if (!found.ok() || !IsBehind(*found)) return take(locked, found);
  // After this round of the committer, what the store held is known here.
  const auto kept = std::make_shared<const FoundRecords>(*std::move(found));
  committer_.Follow(
      locked, [this, kept, take = std::move(take)](Locked& later, const absl::Status& status) {
        const uint64_t known = catalog_.revision();
        if (!status.ok()) return take(later, status);
        if (kept->revision > known) return take(later, IsAhead(kept->revision, known));
        take(later, *kept);
      });
}

absl::StatusOr<FoundRecords> RecordGate::AwaitReached(uint64_t asked_at,
                                                      absl::StatusOr<FoundRecords> found,
                                                      const std::function<bool()>& should_stop) {
  if (!found.ok()) return found;
  if (found->revision < asked_at) return WentBack(found->revision, asked_at);
  Locked locked(mutex_);
  bool is_behind = found->revision > catalog_.revision();
  for (auto hull = found->hulls.begin(); !is_behind && hull != found->hulls.end(); ++hull) {
    locked.LetOthersPass();
    is_behind = IsBehind(hull->first, hull->second);
  }
  if (!is_behind) return found;
  if (absl::Status s = freshness_.AwaitOthers(locked, should_stop); !s.ok()) return s;
  const uint64_t known = catalog_.revision();
  if (found->revision > known) return IsAhead(found->revision, known);
  return found;
}

// Whether the store held more of this hull than is known here, under the same revision: points that
// changed no vertex take none.
bool RecordGate::IsBehind(const std::string& id, const absl::StatusOr<StoredHull>& stored) const {
  if (!stored.ok()) return false;
  const HullTable::Entries& all = catalog_.hulls().entries();
  const auto known = all.find(id);
  if (known == all.end() || known->second.revision() != stored->record.revision) return false;
  return known->second.Describe(id).record.counts.received < stored->record.counts.received;
}

// Whether what was found is of a later moment than what is known here: committed, perhaps by
// others, and not taken over yet. An answer that told it would be followed by one of what is here.
bool RecordGate::IsBehind(const FoundRecords& found) const {
  if (found.revision > catalog_.revision()) return true;
  return std::ranges::any_of(
      found.hulls, [this](const auto& hull) { return IsBehind(hull.first, hull.second); });
}

}  // namespace hulld::server
