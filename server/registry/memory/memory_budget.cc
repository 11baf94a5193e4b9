#include "server/registry/memory/memory_budget.h"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <chrono>
#include <mutex>
#include <utility>

#include "core/base/check.h"
#include "server/contract/limit_error.h"

namespace hulld::server {
namespace {

// Retry delay after which calls may have released hulls, and hulls in use may have come to rest.
constexpr std::chrono::milliseconds kRetry(1000);

}  // namespace

void MemoryBudget::Usage::Remove(Kind kind, uint64_t amount) {
  HULLD_CHECK(bytes[kind] >= amount);
  bytes[kind] -= amount;
}

void MemoryBudget::Account::Enter() {
  Usage& usage = *budget_.usage_;
  usage.Add(is_for_writing_ ? kForWriting : kAtRest, bytes_ + resting_);
  usage.Add(is_for_writing_ ? kForWriting : kForReading, pinned_);
}

void MemoryBudget::Account::Leave() {
  Usage& usage = *budget_.usage_;
  usage.Remove(is_for_writing_ ? kForWriting : kAtRest, bytes_ + resting_);
  usage.Remove(is_for_writing_ ? kForWriting : kForReading, pinned_);
}

void MemoryBudget::Account::Set(uint64_t bytes, bool is_for_writing) {
  if (bytes == 0 && bytes_ == 0) return;
  std::list<Account*>& used = budget_.used_;
  if (bytes_ == 0) {
    place_ = used.insert(used.begin(), this);
  } else if (bytes == 0) {
    used.erase(place_);
  } else {
    used.splice(used.begin(), used, place_);
  }
  const std::lock_guard lock(budget_.usage_->mutex);
  Leave();
  bytes_ = bytes;
  is_for_writing_ = is_for_writing;
  Enter();
}

void MemoryBudget::Account::Touch() {
  if (bytes_ > 0) budget_.used_.splice(budget_.used_.begin(), budget_.used_, place_);
}

void MemoryBudget::Account::Age() {
  if (bytes_ > 0) budget_.used_.splice(budget_.used_.end(), budget_.used_, place_);
}

const std::shared_ptr<const MemoryParts>& MemoryBudget::Account::NoParts() {
  static const auto* const kNone =
      new std::shared_ptr<const MemoryParts>(std::make_shared<const MemoryParts>());
  return *kNone;
}

void MemoryBudget::Account::Hold(MemoryParts parts) {
  if (parts == *parts_) return;
  {
    const std::lock_guard lock(budget_.usage_->mutex);
    for (const MemoryParts* const moved : {parts_.get(), &std::as_const(parts)}) {
      for (const auto& part : *moved) {
        part->Leave();
        part->account_ = moved == &parts ? this : nullptr;
        part->Enter();
      }
    }
  }
  parts_ = parts.empty() ? NoParts() : std::make_shared<const MemoryParts>(std::move(parts));
}

void MemoryBudget::Account::Close() {
  Hold({});
  Set(0, false);
}

void MemoryPart::Enter() {
  if (account_ == nullptr) {
    if (pins_ > 0) usage_->Add(MemoryBudget::kForReading, bytes_);
    return;
  }
  account_->Leave();
  (pins_ > 0 ? account_->pinned_ : account_->resting_) += bytes_;
  account_->Enter();
}

void MemoryPart::Leave() {
  if (account_ == nullptr) {
    if (pins_ > 0) usage_->Remove(MemoryBudget::kForReading, bytes_);
    return;
  }
  account_->Leave();
  (pins_ > 0 ? account_->pinned_ : account_->resting_) -= bytes_;
  account_->Enter();
}

void MemoryPart::SetBytes(uint64_t bytes) {
  const std::lock_guard lock(usage_->mutex);
  if (bytes == bytes_) return;
  Leave();
  bytes_ = bytes;
  Enter();
}

void MemoryPart::Pin(const MemoryParts& parts, bool pins) {
  if (parts.empty()) return;
  const std::lock_guard lock(parts.front()->usage_->mutex);
  for (const auto& part : parts) {
    part->Leave();
    part->pins_ += pins ? 1 : -1;
    part->Enter();
  }
}

void MemoryCharge::Set(uint64_t bytes) {
  if (bytes == bytes_) return;
  MemoryBudget::Usage& usage = *budget_->usage_;
  const auto kind = static_cast<MemoryBudget::Kind>(use_);
  const std::lock_guard lock(usage.mutex);
  usage.Remove(kind, std::exchange(bytes_, bytes));
  usage.Add(kind, bytes);
}

void MemoryBudget::Evict(Locked& owners) {
  HULLD_CHECK(owners.Holds(owners_));
  const size_t most = std::min(kMostVisited, used_.size());
  for (size_t visited = 0; visited < most && !used_.empty() && Total() > limit_bytes_; ++visited) {
    Account& account = *used_.back();
    used_.splice(used_.begin(), used_, account.place_);
    const uint64_t before = Total();
    account.drop_(owners);
    if (Total() < before) ++evictions_;
  }
}

absl::Status MemoryBudget::Check(Locked& owners, MemoryUse use) {
  Evict(owners);
  if (!IsOver(use)) return absl::OkStatus();
  const MemoryStatistics now = Statistics();
  const std::string what =
      use == MemoryUse::kReading
          ? absl::StrCat(
                "readers use ", now.reading,
                " bytes of memory for hulls in use, streams, and watches, more than their share")
          : absl::StrCat(
                "writers use ", now.writing,
                " bytes of memory for changing hulls and points in flight, more than their share");
  return Overloaded(what, share(use), "memory-limit", kRetry);
}

bool MemoryBudget::IsOver(MemoryUse use) const {
  const std::lock_guard lock(usage_->mutex);
  return usage_->bytes[static_cast<size_t>(use)] > share(use);
}

uint64_t MemoryBudget::Total() const {
  const std::lock_guard lock(usage_->mutex);
  return usage_->bytes[kForReading] + usage_->bytes[kForWriting] + usage_->bytes[kAtRest];
}

MemoryStatistics MemoryBudget::Statistics() const {
  const std::lock_guard lock(usage_->mutex);
  const auto& bytes = usage_->bytes;
  return {bytes[kForReading] + bytes[kForWriting] + bytes[kAtRest], bytes[kForReading],
          bytes[kForWriting], limit_bytes_, evictions_};
}

}  // namespace hulld::server
