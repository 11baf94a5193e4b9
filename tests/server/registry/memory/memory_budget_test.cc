#include "server/registry/memory/memory_budget.h"

#include <absl/status/status.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <memory>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

namespace hulld::server {
namespace memory_budget_test {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

class MemoryBudgetTest : public ::testing::Test {
 protected:
  // Holds bytes, some in use and not evictable.
  struct Owner {
    Owner(MemoryBudgetTest& test, int owner_number, uint64_t in_use_bytes = 0)
        : number(owner_number), in_use(in_use_bytes), account(test.budget_, [this, &test](Locked&) {
            test.evictions_.push_back(number);
            account.Set(in_use, false);
          }) {}
    const int number;
    uint64_t in_use;
    MemoryBudget::Account account;
  };

  void Evict() {
    Locked locked(owners_);
    budget_.Evict(locked);
  }
  absl::Status Check(MemoryUse use) {
    Locked locked(owners_);
    return budget_.Check(locked, use);
  }
  uint64_t bytes() const { return budget_.Statistics().bytes; }
  uint64_t reading() const { return budget_.Statistics().reading_bytes; }
  uint64_t writing() const { return budget_.Statistics().writing_bytes; }

  FairMutex owners_;
  MemoryBudget budget_{100, 40, owners_};
  // Numbers of the owners asked to evict, in order.
  std::vector<int> evictions_;
};

TEST_F(MemoryBudgetTest, CountsAccountsAndCharges) {
  Owner owner(*this, 1);
  owner.account.Set(30, false);
  MemoryCharge charge(budget_, MemoryUse::kWriting, 20);
  EXPECT_EQ(bytes(), 50);
  owner.account.Set(10, false);
  charge.Set(25);
  EXPECT_EQ(bytes(), 35);
  {
    const MemoryCharge moved(std::move(charge));
    EXPECT_EQ(bytes(), 35);
  }
  EXPECT_EQ(bytes(), 10);
  owner.account.Close();
  EXPECT_EQ(bytes(), 0);
}

TEST_F(MemoryBudgetTest, NothingIsEvictedWithinTheLimit) {
  Owner owner(*this, 1);
  owner.account.Set(100, false);
  Evict();
  EXPECT_TRUE(Check(MemoryUse::kWriting).ok());
  EXPECT_THAT(evictions_, ElementsAre());
}

TEST_F(MemoryBudgetTest, TheLeastRecentlyUsedIsEvictedFirstAndNoMoreThanNeeded) {
  Owner a(*this, 1);
  Owner b(*this, 2);
  Owner c(*this, 3);
  for (Owner* owner : {&a, &b, &c}) owner->account.Set(50, false);
  a.account.Set(50, false);
  Evict();
  EXPECT_THAT(evictions_, ElementsAre(2));
  EXPECT_EQ(bytes(), 100);
  EXPECT_EQ(budget_.Statistics().evictions, 1);
}

TEST_F(MemoryBudgetTest, AccountsInUseStayAndAreVisitedAgain) {
  Owner busy(*this, 1, 60);
  Owner idle(*this, 2);
  busy.account.Set(60, false);
  idle.account.Set(60, false);
  Evict();
  EXPECT_THAT(evictions_, ElementsAre(1, 2));
  EXPECT_EQ(bytes(), 60);
  EXPECT_EQ(budget_.Statistics().evictions, 1);
  // It has grown since it was counted.
  busy.in_use = 110;
  MemoryCharge charge(budget_, MemoryUse::kReading, 50);
  Evict();
  EXPECT_THAT(evictions_, ElementsAre(1, 2, 1));
  EXPECT_EQ(bytes(), 160);
  busy.in_use = 0;
  Evict();
  EXPECT_EQ(bytes(), 50);
}

// An owner that cannot evict is asked again only after all others; one eviction asks only a few.
TEST_F(MemoryBudgetTest, AnEvictionVisitsABoundedNumberOfAccounts) {
  std::vector<std::unique_ptr<Owner>> owners;
  for (int i = 0; i < 200; ++i) {
    owners.push_back(std::make_unique<Owner>(*this, i, i < 150 ? 1 : 0));
    owners.back()->account.Set(1, false);
  }
  const MemoryCharge charge(budget_, MemoryUse::kWriting, 50);
  Evict();
  EXPECT_EQ(evictions_.size(), MemoryBudget::kMaxVisited);
  EXPECT_EQ(bytes(), 250);
  for (int i = 0; i < 3; ++i) Evict();
  EXPECT_EQ(bytes(), 200);
}

TEST_F(MemoryBudgetTest, EachUseHasItsOwnShare) {
  MemoryCharge writing(budget_, MemoryUse::kWriting, 60);
  MemoryCharge reading(budget_, MemoryUse::kReading, 40);
  EXPECT_TRUE(Check(MemoryUse::kWriting).ok());
  EXPECT_TRUE(Check(MemoryUse::kReading).ok());
  writing.Set(61);
  const absl::Status refused = Check(MemoryUse::kWriting);
  EXPECT_TRUE(absl::IsResourceExhausted(refused));
  EXPECT_THAT(std::string(refused.message()), HasSubstr("writers use 61 bytes"));
  EXPECT_THAT(std::string(refused.message()), HasSubstr("the limit is 60 (--memory-limit)"));
  EXPECT_TRUE(Check(MemoryUse::kReading).ok());
  writing.Set(60);
  reading.Set(41);
  EXPECT_TRUE(Check(MemoryUse::kWriting).ok());
  EXPECT_THAT(std::string(Check(MemoryUse::kReading).message()), HasSubstr("readers use 41 bytes"));
}

TEST_F(MemoryBudgetTest, APartCountsForReadersWhileAReaderHoldsIt) {
  Owner owner(*this, 1);
  const auto part = std::make_shared<MemoryPart>(budget_, &owner, 30);
  EXPECT_EQ(bytes(), 0);
  owner.account.Set(5, false);
  owner.account.Hold({part});
  EXPECT_EQ(bytes(), 35);
  {
    const MemoryPin pin(std::make_shared<const MemoryParts>(MemoryParts{part}));
    EXPECT_EQ(bytes(), 35);
    EXPECT_EQ(reading(), 30);
    const MemoryPin another(std::make_shared<const MemoryParts>(MemoryParts{part}));
    EXPECT_EQ(reading(), 30);
    part->SetBytes(40);
    EXPECT_EQ(reading(), 40);
    // A writer also needs memory held by readers.
    owner.account.Set(5, true);
    EXPECT_EQ(reading(), 0);
    EXPECT_EQ(writing(), 45);
    owner.account.Hold({});
    EXPECT_EQ(reading(), 40);
    EXPECT_EQ(writing(), 5);
    owner.account.Close();
    EXPECT_EQ(bytes(), 40);
  }
  EXPECT_EQ(bytes(), 0);
}

TEST_F(MemoryBudgetTest, AnEmptyAccountAndAPartMayOutliveTheBudget) {
  auto budget = std::make_unique<MemoryBudget>(100, 50, owners_);
  MemoryBudget::Account account(*budget, [](Locked&) {});
  account.Set(50, false);
  account.Hold({std::make_shared<MemoryPart>(*budget, &account, 10)});
  const MemoryPin pin(account.parts());
  account.Close();
  budget = nullptr;
}

TEST(MemoryBudgetDeathTest, AnEvictionWithoutTheMutexOfTheOwnersEndsTheProcess) {
  FairMutex owners;
  FairMutex another;
  MemoryBudget budget(100, 50, owners);
  Locked locked(another);
  EXPECT_DEATH(budget.Evict(locked), "check failed");
}

TEST_F(MemoryBudgetTest, AgedAccountsAreEvictedFirstAndTouchedOnesLast) {
  std::vector<std::unique_ptr<Owner>> owners;
  for (int i = 0; i < 4; ++i) {
    owners.push_back(std::make_unique<Owner>(*this, i, 25));
    owners.back()->account.Set(25, false);
  }
  owners[0]->account.Touch();
  owners[3]->account.Age();
  const MemoryCharge charge(budget_, MemoryUse::kReading, 100);
  Evict();
  EXPECT_THAT(evictions_, ElementsAre(3, 1, 2, 0));
}

}  // namespace memory_budget_test
}  // namespace hulld::server
