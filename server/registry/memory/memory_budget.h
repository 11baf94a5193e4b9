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

// For whom memory is held that cannot be made free at once.
enum class MemoryUse {
  // Calls that ask: versions of hulls that they hold, placements and pairs of streams, what watches
  // were not told yet.
  kReading,
  // Hulls that are being changed, points on their way to them, replacements; and every hull that no
  // store keeps.
  kWriting,
};

struct MemoryStatistics {
  // Everything that is counted now, and what of it is held for whom; the rest can be let go.
  uint64_t bytes = 0;
  uint64_t reading = 0;
  uint64_t writing = 0;
  uint64_t limit_bytes = 0;
  // How often an account was made to let go of something.
  uint64_t evictions = 0;
};

class MemoryPart;

// Counts how much memory each use holds, and says what lets go first once the limit is exceeded.
//
// There are three kinds of memory. What is held for readers and what is held for writers stays
// until they are done; each of the two has a share of the limit, and Check refuses more to the one
// whose share is used up, whatever the other does. The rest is hulls at rest, which can be made
// again; they fill what the others leave, and the one that was not used for longest goes first.
//
// An Account counts what a hull holds, which is of the third kind unless a writer needs it. What
// readers may hold for longer than the hull does is a MemoryPart of its own: it is held for readers
// while a MemoryPin is on it, and counts until the last holder is gone. A MemoryCharge counts
// whatever else a call holds.
//
// Thread-safe. Its mutex is the innermost one: it is taken while other locks are held, and nothing
// is called under it. All accounts of one budget are guarded by one mutex of their owners (the
// registry's). Evict and Check require it, which they check.
class MemoryBudget {
 private:
  enum Kind : size_t { kForReading, kForWriting, kAtRest };
  // Outlives the budget where parts do.
  struct Books {
    Mutex mutex;
    std::array<uint64_t, 3> bytes{};

    // Requires the mutex (unchecked: a Mutex does not tell).
    void Add(Kind kind, uint64_t amount) { bytes[kind] += amount; }
    void Remove(Kind kind, uint64_t amount);
  };

 public:
  // What one owner holds and can make again. Used under the owners' mutex. The destructor may run
  // without it, if the account is empty.
  class Account {
   public:
    // Lets go of what is not in use and can be made again, and says so by Set and Hold.
    using Drop = std::function<void(Locked& owners)>;

    // The budget must outlive the account, or Close must come first.
    Account(MemoryBudget& budget, Drop drop) : budget_(budget), drop_(std::move(drop)) {}
    Account(const Account&) = delete;
    Account& operator=(const Account&) = delete;
    ~Account() { Close(); }

    // What it holds now beside its parts, whether a writer needs it and them, and that it was used
    // just now. Cost: O(1).
    void Set(uint64_t bytes, bool is_for_writing);
    // The parts that it holds now. Those before are counted no more, unless readers hold them.
    // Cost: O(parts).
    void Hold(std::vector<std::shared_ptr<MemoryPart>> parts);
    const std::vector<std::shared_ptr<MemoryPart>>& parts() const { return parts_; }
    // It holds nothing from now on; the budget may go.
    void Close();

    MemoryBudget& budget() const { return budget_; }

   private:
    friend class MemoryBudget;
    friend class MemoryPart;

    // Counts all that it holds, or no more. Require the budget's mutex.
    void Enter();
    void Leave();

    MemoryBudget& budget_;
    const Drop drop_;
    // Changed under both mutexes.
    uint64_t bytes_ = 0;
    bool is_for_writing_ = false;
    // The sums over parts that no reader holds, and over the others. Guarded by the budget's mutex.
    uint64_t resting_ = 0;
    uint64_t pinned_ = 0;
    // Guarded by the owners' mutex.
    std::vector<std::shared_ptr<MemoryPart>> parts_;
    std::list<Account*>::iterator place_;
  };

  // Accounts that one eviction asks to let go, at most: some ten microseconds.
  static constexpr size_t kMostAsked = 64;

  // limit_bytes: --memory-limit. reading_bytes: the readers' share; writers have the rest. owners:
  // the mutex that guards the accounts; it may not be constructed yet.
  MemoryBudget(uint64_t limit_bytes, uint64_t reading_bytes, const FairMutex& owners)
      : limit_bytes_(limit_bytes),
        shares_{reading_bytes, limit_bytes - reading_bytes},
        owners_(owners) {}
  MemoryBudget(const MemoryBudget&) = delete;
  MemoryBudget& operator=(const MemoryBudget&) = delete;

  // Makes accounts let go, the one not used for longest first, until the rest is within the limit
  // or kMostAsked were asked. One that cannot let go is asked again after all others.
  void Evict(Locked& owners);
  // The same; RESOURCE_EXHAUSTED, with a time to retry, when more than the share of this use is
  // held for it.
  absl::Status Check(Locked& owners, MemoryUse use);
  // The share of a use, and whether more is held for it.
  uint64_t share(MemoryUse use) const { return shares_[static_cast<size_t>(use)]; }
  bool IsOver(MemoryUse use) const;

  MemoryStatistics Statistics() const;

 private:
  friend class MemoryCharge;
  friend class MemoryPart;

  uint64_t Total() const;

  const uint64_t limit_bytes_;
  const std::array<uint64_t, 2> shares_;
  const FairMutex& owners_;
  const std::shared_ptr<Books> books_ = std::make_shared<Books>();
  // The rest is guarded by the owners' mutex. Accounts that hold something, the last used in front.
  std::list<Account*> used_;
  uint64_t evictions_ = 0;
};

// Something that a hull holds and that readers may hold for longer: counted once, however many hold
// it, until nobody does. Thread-safe; may outlive the budget.
class MemoryPart {
 public:
  // what: tells parts of one account from each other; never followed.
  MemoryPart(MemoryBudget& budget, const void* what, uint64_t bytes = 0)
      : books_(budget.books_), what_(what), bytes_(bytes) {}
  MemoryPart(const MemoryPart&) = delete;
  MemoryPart& operator=(const MemoryPart&) = delete;

  const void* what() const { return what_; }
  void SetBytes(uint64_t bytes);

 private:
  friend class MemoryBudget::Account;
  friend class MemoryPin;

  void Pin(bool pins);
  // Require the budget's mutex.
  void Enter();
  void Leave();

  const std::shared_ptr<MemoryBudget::Books> books_;
  const void* const what_;
  // Guarded by the budget's mutex.
  uint64_t bytes_ = 0;
  uint64_t pins_ = 0;
  MemoryBudget::Account* account_ = nullptr;
};

// Readers hold these parts, until it goes. Any thread may end it.
class MemoryPin {
 public:
  explicit MemoryPin(std::vector<std::shared_ptr<MemoryPart>> parts) : parts_(std::move(parts)) {
    for (const auto& part : parts_) part->Pin(true);
  }
  MemoryPin(const MemoryPin&) = delete;
  MemoryPin& operator=(const MemoryPin&) = delete;
  ~MemoryPin() {
    for (const auto& part : parts_) part->Pin(false);
  }

 private:
  const std::vector<std::shared_ptr<MemoryPart>> parts_;
};

// Memory that stays until its owner is done. Counted until it goes. Not thread-safe; the budget
// must outlive it.
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

  // What is held now. Cost: O(1).
  void Set(uint64_t bytes);

 private:
  MemoryBudget* budget_;
  MemoryUse use_;
  uint64_t bytes_ = 0;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_REGISTRY_MEMORY_MEMORY_BUDGET_H_
