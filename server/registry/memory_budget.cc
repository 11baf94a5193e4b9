#include "server/registry/memory_budget.h"

#include <absl/strings/str_cat.h>

#include <chrono>

#include "core/base/check.h"
#include "server/contract/limit_error.h"

namespace hulld::server {
namespace {

// When hulls in use may have come to rest.
constexpr std::chrono::milliseconds kRetry(1000);

}  // namespace

void MemoryBudget::Account::Set(uint64_t bytes) {
  if (bytes == 0 && bytes_ == 0) return;
  const std::lock_guard lock(budget_.mutex_);
  std::list<Account*>& used = budget_.used_;
  if (bytes_ == 0) {
    place_ = used.insert(used.begin(), this);
  } else if (bytes == 0) {
    used.erase(place_);
  } else {
    used.splice(used.begin(), used, place_);
  }
  budget_.Exchange(bytes_, bytes);
  bytes_ = bytes;
}

void MemoryBudget::Charge(uint64_t before, uint64_t now) {
  const std::lock_guard lock(mutex_);
  Exchange(before, now);
}

void MemoryBudget::Exchange(uint64_t before, uint64_t now) {
  HULLD_CHECK(bytes_ >= before);
  bytes_ = bytes_ - before + now;
}

void MemoryBudget::Evict(Locked& owners) {
  HULLD_CHECK(owners.Holds(owners_));
  const std::lock_guard lock(mutex_);
  for (auto place = used_.end(); bytes_ > limit_bytes_ && place != used_.begin();) {
    Account& account = **--place;
    const uint64_t left = account.drop_(owners);
    if (left < account.bytes_) ++evictions_;
    Exchange(account.bytes_, left);
    account.bytes_ = left;
    if (left == 0) place = used_.erase(place);
  }
}

absl::Status MemoryBudget::Check(Locked& owners) {
  Evict(owners);
  const uint64_t bytes = Statistics().bytes;
  if (bytes <= limit_bytes_) return absl::OkStatus();
  return Overloaded(
      absl::StrCat("hulls in use, points on their way to them and streams of queries hold ", bytes,
                   " bytes of memory"),
      limit_bytes_, "memory-limit", kRetry);
}

MemoryStatistics MemoryBudget::Statistics() const {
  const std::lock_guard lock(mutex_);
  return {bytes_, limit_bytes_, evictions_};
}

}  // namespace hulld::server
