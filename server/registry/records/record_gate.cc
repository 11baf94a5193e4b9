#include "server/registry/records/record_gate.h"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <memory>
#include <utility>

namespace hulld::server {
namespace {

// The store reported an older revision than `asked_at`, its revision before the query.
absl::Status WentBack(uint64_t found, uint64_t asked_at) {
  return absl::UnavailableError(absl::StrCat(
      "the store answers as of revision ", found, ", and was at ", asked_at,
      " before: it was restored to an earlier state, or another database is answering"));
}

absl::Status IsAhead(uint64_t found, uint64_t known) {
  return absl::UnavailableError(absl::StrCat("the store holds changes up to revision ", found,
                                             ", but only changes up to ", known,
                                             " are known to be committed; retry"));
}

}  // namespace

void RecordGate::WhenReached(Locked& locked, uint64_t asked_at, absl::StatusOr<FoundRecords> found,
                             FoundTaker take) {
  if (found.ok() && found->revision < asked_at) found = WentBack(found->revision, asked_at);
  if (!found.ok() || !IsBehind(*found)) return take(locked, found);
  // After this round of the committer, the catalog includes everything that the store held.
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

// True if the store holds a later state of the hull than the catalog under the same revision:
// points that change no vertex do not create a revision.
bool RecordGate::IsBehind(const std::string& id, const absl::StatusOr<StoredHull>& stored) const {
  if (!stored.ok()) return false;
  const HullTable::Entries& all = catalog_.hulls().entries();
  const auto known = all.find(id);
  if (known == all.end() || known->second.revision() != stored->record.revision) return false;
  return known->second.Describe(id).record.counts.received < stored->record.counts.received;
}

// True if the records are newer than the catalog: committed, perhaps by a peer server, but not yet
// applied. An answer from them would be followed by an older one from the catalog.
bool RecordGate::IsBehind(const FoundRecords& found) const {
  if (found.revision > catalog_.revision()) return true;
  return std::ranges::any_of(
      found.hulls, [this](const auto& hull) { return IsBehind(hull.first, hull.second); });
}

}  // namespace hulld::server
