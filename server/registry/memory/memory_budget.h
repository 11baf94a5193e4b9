#ifndef HULLD_SERVER_REGISTRY_MEMORY_MEMORY_BUDGET_H_
#define HULLD_SERVER_REGISTRY_MEMORY_MEMORY_BUDGET_H_

#include <absl/status/status.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <list>
#include <memory>
#include <utility>
#include <vector>

#include "server/process/synchronization.h"
#include "server/registry/memory/locked.h"

namespace hulld::server {

// Use of memory that cannot be freed immediately.
enum class MemoryUse {
  // Queries: versions of hulls that they hold, placements and pairs of streams, pending changes of
  // watches.
  kReading,
  // Hulls being changed, points pending for them, and replacements. Also every hull that is kept
  // only in memory.
  kWriting,
};

struct MemoryStatistics {
  // All memory currently counted, and its parts held for readers and writers; the rest can be
  // evicted.
  uint64_t bytes = 0;
  uint64_t reading_bytes = 0;
  uint64_t writing_bytes = 0;
  uint64_t limit_bytes = 0;
  // Number of evictions from an account.
  uint64_t evictions = 0;
};

class MemoryPart;
using MemoryParts = std::vector<std::shared_ptr<MemoryPart>>;

// Counts the memory of each use and chooses evictions when the limit is exceeded.
//
// Memory is of three kinds. Memory held for readers and for writers stays until they are done; each
// of the two has a share of the limit, and Check refuses more memory to a use that exceeds its
// share, independently of the other use. The rest is hulls at rest, which can be reloaded; they
// fill the remaining memory, and the least recently used is evicted first.
//
// An Account counts the memory of a hull, which is of the third kind unless a writer needs it.
// Memory that readers may hold longer than the hull is a separate MemoryPart: it is held for
// readers while a MemoryPin on it exists, and counts until its last holder is gone. A MemoryCharge
// counts any other memory of a call.
//
// Thread-safe. Its mutex is the innermost one: it is acquired while other locks are held, and no
// callback runs under it. One mutex of the owners (the registry's) guards all accounts of a budget.
// Evict and Check require it (checked).
class MemoryBudget {
 private:
  enum Kind : size_t { kForReading, kForWriting, kAtRest };
  // Outlives the budget while parts exist.
  struct Usage {
    Mutex mutex;
    std::array<uint64_t, 3> bytes{};

    // Adds an amount, or removes a negative one. Requires the mutex (not checked: a Mutex does not
    // know its holder).
    void Add(Kind kind, int64_t amount);
  };

 public:
  // Evictable memory of an owner. Requires the owners' mutex, except for the destructor of an
  // empty account.
  class Account {
   public:
    // Evicts unused memory that can be rebuilt, and reports it through Set and Hold.
    using Drop = std::function<void(Locked& owners)>;

    // The budget must outlive the account, or Close must come first.
    Account(MemoryBudget& budget, Drop drop) : budget_(budget), drop_(std::move(drop)) {}
    Account(const Account&) = delete;
    Account& operator=(const Account&) = delete;
    ~Account() { Close(); }

    // Sets the memory excluding parts; is_for_writing: a writer needs it and the parts. Marks the
    // account as just used. Cost: O(1).
    void Set(uint64_t bytes, bool is_for_writing);
    // Touch marks the account as just used, Age as the first to evict from. Cost: O(1).
    void Touch();
    void Age();
    // Sets the parts held. Previous parts stop counting unless readers hold them. Cost: O(parts).
    void Hold(MemoryParts parts);
    const std::shared_ptr<const MemoryParts>& parts() const { return parts_; }
    // Empties the account; the budget may be destroyed afterwards.
    void Close();

    MemoryBudget& budget() const { return budget_; }

   private:
    friend class MemoryBudget;
    friend class MemoryPart;

    // Adds the account's memory to the budget, or removes it if `sign` is -1. Requires the budget's
    // mutex.
    void Count(int sign);
    static const std::shared_ptr<const MemoryParts>& NoParts();

    MemoryBudget& budget_;
    const Drop drop_;
    // Changed under both mutexes.
    uint64_t bytes_ = 0;
    bool is_for_writing_ = false;
    // Sums over parts without readers, and over parts with readers. Guarded by the budget's mutex.
    uint64_t resting_ = 0;
    uint64_t pinned_ = 0;
    // Guarded by the owners' mutex.
    std::shared_ptr<const MemoryParts> parts_ = NoParts();
    std::list<Account*>::iterator place_;
  };

  // Maximum number of accounts that one eviction visits; takes about 10 us.
  static constexpr size_t kMaxVisited = 64;

  // limit_bytes: --memory-limit. reading_bytes: the readers' share; writers get the rest. owners:
  // the mutex that guards the accounts; it may not be constructed yet.
  MemoryBudget(uint64_t limit_bytes, uint64_t reading_bytes, const FairMutex& owners)
      : limit_bytes_(limit_bytes),
        shares_{reading_bytes, limit_bytes - reading_bytes},
        owners_(owners) {}
  MemoryBudget(const MemoryBudget&) = delete;
  MemoryBudget& operator=(const MemoryBudget&) = delete;

  // Evicts from accounts, least recently used first, until the memory is within the limit or
  // kMaxVisited accounts were visited. An account that cannot evict is visited again after all
  // other accounts.
  void Evict(Locked& owners);
  // Like Evict. RESOURCE_EXHAUSTED, with a retry delay: this use exceeds its share.
  absl::Status Check(Locked& owners, MemoryUse use);
  // Share of a use, and true if the use exceeds it.
  uint64_t share(MemoryUse use) const { return shares_[static_cast<size_t>(use)]; }
  bool IsOver(MemoryUse use) const;

  MemoryStatistics Statistics() const;

 private:
  friend class MemoryCharge;
  friend class MemoryPart;

  const uint64_t limit_bytes_;
  const std::array<uint64_t, 2> shares_;
  const FairMutex& owners_;
  const std::shared_ptr<Usage> usage_ = std::make_shared<Usage>();
  // The owners' mutex guards the members below. Non-empty accounts, most recently used first.
  std::list<Account*> used_;
  uint64_t evictions_ = 0;
};

// Memory of a hull that readers may hold longer than the hull: counted once, regardless of the
// number of holders, until the last one is gone. Thread-safe; may outlive the budget.
class MemoryPart {
 public:
  // what: identifies the part within its account; never dereferenced.
  MemoryPart(MemoryBudget& budget, const void* what, uint64_t bytes = 0)
      : usage_(budget.usage_), what_(what), bytes_(bytes) {}
  MemoryPart(const MemoryPart&) = delete;
  MemoryPart& operator=(const MemoryPart&) = delete;

  const void* what() const { return what_; }
  void SetBytes(uint64_t bytes);

 private:
  friend class MemoryBudget::Account;
  friend class MemoryPin;

  // Requires: all parts are of one budget.
  static void Pin(const MemoryParts& parts, bool pins);
  // Like Account::Count.
  void Count(int sign);

  const std::shared_ptr<MemoryBudget::Usage> usage_;
  const void* const what_;
  // Guarded by the budget's mutex.
  uint64_t bytes_ = 0;
  uint64_t pins_ = 0;
  MemoryBudget::Account* account_ = nullptr;
};

// Counts parts as held for readers during its lifetime. Any thread may destroy it.
class MemoryPin {
 public:
  explicit MemoryPin(std::shared_ptr<const MemoryParts> parts) : parts_(std::move(parts)) {
    MemoryPart::Pin(*parts_, true);
  }
  MemoryPin(const MemoryPin&) = delete;
  MemoryPin& operator=(const MemoryPin&) = delete;
  ~MemoryPin() { MemoryPart::Pin(*parts_, false); }

 private:
  const std::shared_ptr<const MemoryParts> parts_;
};

// Memory in use until its owner is done, counted during the lifetime of this object. Not
// thread-safe; the budget must outlive it.
class MemoryCharge {
 public:
  MemoryCharge(MemoryBudget& budget, MemoryUse use, uint64_t bytes = 0)
      : budget_(&budget), use_(use) {
    Set(bytes);
  }
  MemoryCharge(MemoryCharge&& other) noexcept
      : budget_(other.budget_), use_(other.use_), bytes_(std::exchange(other.bytes_, 0)) {}
  MemoryCharge& operator=(MemoryCharge&&) = delete;
  ~MemoryCharge() { Set(0); }

  // Sets the memory held. Cost: O(1).
  void Set(uint64_t bytes);
  uint64_t bytes() const { return bytes_; }

 private:
  MemoryBudget* budget_;
  MemoryUse use_;
  uint64_t bytes_ = 0;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_REGISTRY_MEMORY_MEMORY_BUDGET_H_
