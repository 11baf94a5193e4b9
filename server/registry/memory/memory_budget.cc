#include "server/registry/memory/memory_budget.h"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <chrono>
#include <mutex>
#include <utility>

#include "core/base/check.h"
#include "server/contract/errors.h"

namespace hulld::server {
namespace {

// Retry delay after which calls may have released hulls, and hulls in use may have come to rest.
constexpr std::chrono::milliseconds kRetry(1000);

}  // namespace

void MemoryBudget::Usage::Add(Kind kind, int64_t amount) {
  HULLD_CHECK(amount >= 0 || bytes[kind] >= static_cast<uint64_t>(-amount));
  bytes[kind] += static_cast<uint64_t>(amount);
}

void MemoryBudget::Account::Count(int sign) {
  Usage& usage = *budget_.usage_;
  usage.Add(is_for_writing_ ? kForWriting : kAtRest,
            sign * static_cast<int64_t>(bytes_ + resting_));
  usage.Add(is_for_writing_ ? kForWriting : kForReading, sign * static_cast<int64_t>(pinned_));
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
  Count(-1);
  bytes_ = bytes;
  is_for_writing_ = is_for_writing;
  Count(1);
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
        part->Count(-1);
        part->account_ = moved == &parts ? this : nullptr;
        part->Count(1);
      }
    }
  }
  parts_ = parts.empty() ? NoParts() : std::make_shared<const MemoryParts>(std::move(parts));
}

void MemoryBudget::Account::Close() {
  Hold({});
  Set(0, false);
}

void MemoryPart::Count(int sign) {
  const int64_t amount = sign * static_cast<int64_t>(bytes_);
  if (account_ == nullptr) {
    if (pins_ > 0) usage_->Add(MemoryBudget::kForReading, amount);
    return;
  }
  account_->Count(-1);
  (pins_ > 0 ? account_->pinned_ : account_->resting_) += static_cast<uint64_t>(amount);
  account_->Count(1);
}

void MemoryPart::SetBytes(uint64_t bytes) {
  const std::lock_guard lock(usage_->mutex);
  if (bytes == bytes_) return;
  Count(-1);
  bytes_ = bytes;
  Count(1);
}

void MemoryPart::Pin(const MemoryParts& parts, bool pins) {
  if (parts.empty()) return;
  const std::lock_guard lock(parts.front()->usage_->mutex);
  for (const auto& part : parts) {
    part->Count(-1);
    part->pins_ += pins ? 1 : -1;
    part->Count(1);
  }
}

void MemoryCharge::Set(uint64_t bytes) {
  if (bytes == bytes_) return;
  MemoryBudget::Usage& usage = *budget_->usage_;
  const auto kind = static_cast<MemoryBudget::Kind>(use_);
  const std::lock_guard lock(usage.mutex);
  usage.Add(kind, -static_cast<int64_t>(std::exchange(bytes_, bytes)));
  usage.Add(kind, static_cast<int64_t>(bytes));
}

void MemoryBudget::Evict(Locked& owners) {
  HULLD_CHECK(owners.Holds(owners_));
  const size_t max_visited = std::min(kMaxVisited, used_.size());
  for (size_t visited = 0;
       visited < max_visited && !used_.empty() && Statistics().bytes > limit_bytes_; ++visited) {
    Account& account = *used_.back();
    used_.splice(used_.begin(), used_, account.place_);
    const uint64_t before = Statistics().bytes;
    account.drop_(owners);
    if (Statistics().bytes < before) ++evictions_;
  }
}

absl::Status MemoryBudget::Check(Locked& owners, MemoryUse use) {
  Evict(owners);
  if (!IsOver(use)) return absl::OkStatus();
  const MemoryStatistics now = Statistics();
  const std::string what = use == MemoryUse::kReading
                               ? absl::StrCat("readers use ", now.reading_bytes,
                                              " bytes of memory for hulls in use, streams, and "
                                              "watches, which exceeds their share")
                               : absl::StrCat("writers use ", now.writing_bytes,
                                              " bytes of memory for hulls being changed and points "
                                              "in flight, which exceeds their share");
  return Overloaded(what, share(use), "memory-limit", kRetry);
}

bool MemoryBudget::IsOver(MemoryUse use) const {
  const std::lock_guard lock(usage_->mutex);
  return usage_->bytes[static_cast<size_t>(use)] > share(use);
}

MemoryStatistics MemoryBudget::Statistics() const {
  const std::lock_guard lock(usage_->mutex);
  const auto& bytes = usage_->bytes;
  return {bytes[kForReading] + bytes[kForWriting] + bytes[kAtRest], bytes[kForReading],
          bytes[kForWriting], limit_bytes_, evictions_};
}

}  // namespace hulld::server
