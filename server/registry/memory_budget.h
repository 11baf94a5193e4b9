#ifndef HULLD_SERVER_REGISTRY_MEMORY_BUDGET_H_
#define HULLD_SERVER_REGISTRY_MEMORY_BUDGET_H_

#include <absl/status/status.h>

#include <cstdint>
#include <functional>
#include <list>
#include <mutex>
#include <utility>

#include "server/registry/locked.h"

namespace hulld::server {

struct MemoryStatistics {
  // Everything that is counted now.
  uint64_t bytes = 0;
  uint64_t limit_bytes = 0;
  // How often an account was made to let go of something.
  uint64_t evictions = 0;
};

// Who holds how much memory, and who lets go first once the limit is exceeded.
//
// There are two kinds of memory. An Account counts what can be made again; the account that was not
// used for longest lets go first. A MemoryCharge counts what is needed until its owner is done; it
// never lets go. Check refuses more once charges, and what accounts cannot let go of, exceed the
// limit.
//
// Thread-safe. Its mutex is the innermost one: it is taken while other locks are held, and it calls
// nothing but the Drop of an account. All accounts of one budget are guarded by one mutex of their
// owners (the registry's). Evict and Check require it, which they check, since they call Drop.
class MemoryBudget {
 public:
  // What one owner holds and can make again. Used under the owners' mutex. The destructor may run
  // without it, if the account is empty or Evict cannot run any more.
  class Account {
   public:
    // Lets go of what is not in use and can be made again. Returns the bytes that are held after
    // that (more than were set, if what is held grew since). It must not use the budget, whose
    // mutex is held.
    using Drop = std::function<uint64_t(Locked& owners)>;

    // The budget must outlive the account, or Close must come first.
    Account(MemoryBudget& budget, Drop drop) : budget_(budget), drop_(std::move(drop)) {}
    Account(const Account&) = delete;
    Account& operator=(const Account&) = delete;
    ~Account() { Close(); }

    // What it holds now, and that it was used just now. Cost: O(1).
    void Set(uint64_t bytes);
    // It holds nothing from now on; the budget may go.
    void Close() { Set(0); }

   private:
    friend class MemoryBudget;
    MemoryBudget& budget_;
    const Drop drop_;
    // Guarded by the budget's mutex. Only its owner touches an account that is empty.
    uint64_t bytes_ = 0;
    std::list<Account*>::iterator place_;
  };

  // limit_bytes: --memory-limit. owners: the mutex that guards the accounts; it may not be
  // constructed yet.
  MemoryBudget(uint64_t limit_bytes, const FairMutex& owners)
      : limit_bytes_(limit_bytes), owners_(owners) {}
  MemoryBudget(const MemoryBudget&) = delete;
  MemoryBudget& operator=(const MemoryBudget&) = delete;

  // Makes accounts let go, the one not used for longest first, until the rest is within the limit
  // or no account can let go of more. Cost: O(1) within the limit, else up to that of all accounts.
  void Evict(Locked& owners);
  // The same; RESOURCE_EXHAUSTED, with a time to retry, when the rest is beyond the limit.
  absl::Status Check(Locked& owners);

  MemoryStatistics Statistics() const;

 private:
  friend class MemoryCharge;
  void Charge(uint64_t before, uint64_t now);
  // Requires mutex_ (unchecked: a std::mutex does not tell).
  void Exchange(uint64_t before, uint64_t now);

  const uint64_t limit_bytes_;
  const FairMutex& owners_;
  mutable std::mutex mutex_;
  // The rest is guarded by mutex_.
  uint64_t bytes_ = 0;
  uint64_t evictions_ = 0;
  // Accounts that hold something, the last used in front.
  std::list<Account*> used_;
};

// Memory that stays until its owner is done: points on their way to a hull, a hull that the
// registry does not know yet, placements and pairs of a stream. Counted until it goes. Not
// thread-safe; the budget must outlive it.
class MemoryCharge {
 public:
  explicit MemoryCharge(MemoryBudget& budget, uint64_t bytes = 0) : budget_(&budget) { Set(bytes); }
  MemoryCharge(MemoryCharge&& other) noexcept
      : budget_(other.budget_), bytes_(std::exchange(other.bytes_, 0)) {}
  MemoryCharge& operator=(MemoryCharge&&) = delete;
  ~MemoryCharge() { Set(0); }

  // What is held now. Cost: O(1).
  void Set(uint64_t bytes) {
    if (bytes != bytes_) budget_->Charge(std::exchange(bytes_, bytes), bytes);
  }

 private:
  MemoryBudget* budget_;
  uint64_t bytes_ = 0;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_REGISTRY_MEMORY_BUDGET_H_
