#include "server/registry/memory_budget.h"

#include <absl/status/status.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <memory>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

namespace hulld::server {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

class MemoryBudgetTest : public ::testing::Test {
 protected:
  // Holds bytes, some of which are in use and stay.
  struct Owner {
    Owner(MemoryBudgetTest& test, int owner_number, uint64_t in_use_bytes = 0)
        : number(owner_number), in_use(in_use_bytes), account(test.budget_, [this, &test](Locked&) {
            test.asked_.push_back(number);
            return in_use;
          }) {}
    const int number;
    uint64_t in_use;
    MemoryBudget::Account account;
  };

  void Evict() {
    Locked locked(owners_);
    budget_.Evict(locked);
  }
  absl::Status Check() {
    Locked locked(owners_);
    return budget_.Check(locked);
  }
  uint64_t bytes() const { return budget_.Statistics().bytes; }

  FairMutex owners_;
  MemoryBudget budget_{100, owners_};
  // The numbers of the owners that were asked to let go, in order.
  std::vector<int> asked_;
};

TEST_F(MemoryBudgetTest, CountsAccountsAndCharges) {
  Owner owner(*this, 1);
  owner.account.Set(30);
  MemoryCharge charge(budget_, 20);
  EXPECT_EQ(bytes(), 50);
  owner.account.Set(10);
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

TEST_F(MemoryBudgetTest, NoAccountLetsGoWithinTheLimit) {
  Owner owner(*this, 1);
  owner.account.Set(100);
  Evict();
  EXPECT_TRUE(Check().ok());
  EXPECT_THAT(asked_, ElementsAre());
}

TEST_F(MemoryBudgetTest, TheOneNotUsedForLongestGoesFirstAndNoMoreThanNeeded) {
  Owner a(*this, 1);
  Owner b(*this, 2);
  Owner c(*this, 3);
  for (Owner* owner : {&a, &b, &c}) owner->account.Set(50);
  a.account.Set(50);
  Evict();
  EXPECT_THAT(asked_, ElementsAre(2));
  EXPECT_EQ(bytes(), 100);
  EXPECT_EQ(budget_.Statistics().evictions, 1);
}

TEST_F(MemoryBudgetTest, WhatIsInUseStaysAndIsAskedAgain) {
  Owner busy(*this, 1, 60);
  Owner idle(*this, 2);
  busy.account.Set(60);
  idle.account.Set(60);
  Evict();
  EXPECT_THAT(asked_, ElementsAre(1, 2));
  EXPECT_EQ(bytes(), 60);
  EXPECT_EQ(budget_.Statistics().evictions, 1);
  // It grew since it was counted.
  busy.in_use = 110;
  MemoryCharge charge(budget_, 50);
  Evict();
  EXPECT_THAT(asked_, ElementsAre(1, 2, 1));
  EXPECT_EQ(bytes(), 160);
  busy.in_use = 0;
  Evict();
  EXPECT_EQ(bytes(), 50);
}

TEST_F(MemoryBudgetTest, RefusesOnceNoAccountCanLetGoOfMore) {
  Owner owner(*this, 1, 40);
  owner.account.Set(80);
  MemoryCharge charge(budget_, 60);
  EXPECT_TRUE(Check().ok());
  charge.Set(61);
  const absl::Status refused = Check();
  EXPECT_TRUE(absl::IsResourceExhausted(refused));
  EXPECT_THAT(std::string(refused.message()), HasSubstr("hold 101 bytes"));
  EXPECT_THAT(std::string(refused.message()), HasSubstr("--memory-limit"));
}

TEST_F(MemoryBudgetTest, AnEmptyAccountMayOutliveTheBudget) {
  auto budget = std::make_unique<MemoryBudget>(100, owners_);
  MemoryBudget::Account account(*budget, [](Locked&) { return 0; });
  account.Set(50);
  account.Close();
  budget = nullptr;
}

TEST(MemoryBudgetDeathTest, AnEvictionWithoutTheMutexOfTheOwnersEndsTheProcess) {
  FairMutex owners;
  FairMutex another;
  MemoryBudget budget(100, owners);
  Locked locked(another);
  EXPECT_DEATH(budget.Evict(locked), "check failed");
}

}  // namespace
}  // namespace hulld::server
