#include "server/registry/catalog/hull_state.h"

#include <absl/status/status.h>
#include <gtest/gtest.h>

namespace hulld::server {
namespace hull_state_test {

using Life = HullState::Life;
using Work = HullState::Work;

HullState Building() {
  HullState state = HullState::Present();
  state.Schedule();
  state.StartBuilding();
  return state;
}

// With one chunk in flight.
HullState Growing() {
  HullState state = Building();
  state.Submit();
  state.EndWork();
  return state;
}

HullState Ending() {
  HullState state = HullState::Present();
  state.StartEnding();
  return state;
}

HullState Gone() {
  HullState state = Ending();
  state.Commit();
  return state;
}

HullState Damaged() {
  HullState state = HullState::Present();
  state.Damage(absl::DataLossError("damaged"));
  return state;
}

TEST(HullState, ACreationIsCommittedOrLeavesNothing) {
  HullState created = HullState::Creating();
  EXPECT_FALSE(created.visible());
  EXPECT_TRUE(created.changing_life());
  EXPECT_FALSE(created.can_schedule());
  created.Commit();
  EXPECT_EQ(created.life(), Life::kPresent);
  EXPECT_TRUE(created.visible());
  EXPECT_TRUE(created.quiet());

  HullState refused = HullState::Creating();
  refused.Refuse();
  EXPECT_TRUE(refused.gone());
  EXPECT_FALSE(refused.visible());
}

TEST(HullState, AnEndIsCommittedOrTheHullStays) {
  HullState state = Ending();
  EXPECT_TRUE(state.visible());
  EXPECT_TRUE(state.changing_life());
  EXPECT_FALSE(state.quiet());
  EXPECT_FALSE(state.can_schedule());
  state.Refuse();
  EXPECT_EQ(state.life(), Life::kPresent);
  EXPECT_TRUE(state.quiet());
  state.StartEnding();
  state.Commit();
  EXPECT_TRUE(state.gone());
  EXPECT_TRUE(state.quiet());
}

TEST(HullState, ChunksOverlapUpToTheirLimit) {
  HullState state = HullState::Present();
  for (int i = 1; i <= HullState::kMaxInFlight; ++i) {
    ASSERT_TRUE(state.can_schedule());
    state.Schedule();
    EXPECT_EQ(state.work(), Work::kScheduled);
    state.StartBuilding();
    EXPECT_EQ(state.work(), Work::kBuilding);
    state.Submit();
    EXPECT_EQ(state.work(), Work::kBuilding);
    state.EndWork();
    EXPECT_EQ(state.in_flight(), i);
  }
  EXPECT_FALSE(state.can_schedule());
  state.Commit();
  EXPECT_TRUE(state.can_schedule());
  while (state.in_flight() > 0) state.Commit();
  EXPECT_TRUE(state.quiet());
}

TEST(HullState, ARefusalReachesTheThreadThatBuildsOnIt) {
  HullState state = Growing();
  state.Schedule();
  state.StartBuilding();
  state.Refuse();
  EXPECT_EQ(state.work(), Work::kReverting);
  state.EndWork();
  EXPECT_TRUE(state.quiet());
}

// It finds the builder dropped, and starts from the committed state.
TEST(HullState, ARefusalDoesNotConcernAThreadThatHasNotBegun) {
  HullState state = Growing();
  state.Schedule();
  state.Refuse();
  EXPECT_EQ(state.work(), Work::kScheduled);
  state.StartBuilding();
  state.Submit();
  EXPECT_EQ(state.work(), Work::kBuilding);
  state.EndWork();
}

TEST(HullState, AScheduledChunkMayEndWithoutBeingBuilt) {
  HullState state = HullState::Present();
  state.Schedule();
  EXPECT_EQ(state.work(), Work::kScheduled);
  state.EndWork();
  EXPECT_TRUE(state.quiet());
}

TEST(HullState, ADamagedHullCanOnlyEnd) {
  HullState state = Damaged();
  EXPECT_TRUE(state.visible());
  EXPECT_TRUE(state.damaged());
  EXPECT_FALSE(state.can_schedule());
  state.StartEnding();
  state.Commit();
  EXPECT_TRUE(state.gone());
}

TEST(HullState, DamageIsFoundByAThreadThatWorks) {
  HullState state = Building();
  state.Damage(absl::DataLossError("damaged"));
  EXPECT_EQ(state.work(), Work::kBuilding);
  state.EndWork();
  EXPECT_EQ(state.damage(), absl::DataLossError("damaged"));
}

TEST(HullState, APeerChangeReachesTheThreadThatBuilds) {
  HullState state = Building();
  state.Supersede();
  EXPECT_EQ(state.work(), Work::kReverting);
  state.EndWork();
  EXPECT_EQ(state.life(), Life::kPresent);

  // It has not started, and finds the new version.
  state.Schedule();
  state.Supersede();
  EXPECT_EQ(state.work(), Work::kScheduled);

  // It has not started, and finds no hull.
  state.Vanish();
  EXPECT_TRUE(state.gone());
  EXPECT_EQ(state.work(), Work::kScheduled);
  state.EndWork();

  HullState building = Building();
  building.Vanish();
  EXPECT_TRUE(building.gone());
  EXPECT_EQ(building.work(), Work::kReverting);
  building.EndWork();
}

using HullStateDeathTest = ::testing::Test;

TEST(HullStateDeathTest, AChunkStartsOnlyInAHullThatIsIdleAndSound) {
  EXPECT_DEATH(HullState::Creating().Schedule(), "check failed");
  EXPECT_DEATH(Building().Schedule(), "check failed");
  EXPECT_DEATH(Ending().Schedule(), "check failed");
  EXPECT_DEATH(Gone().Schedule(), "check failed");
  EXPECT_DEATH(Damaged().Schedule(), "check failed");
  EXPECT_DEATH(HullState::Present().StartBuilding(), "check failed");
}

TEST(HullStateDeathTest, OnlyChangesBuiltOnTheCurrentStateAreSubmitted) {
  EXPECT_DEATH(HullState::Present().Submit(), "check failed");
  HullState reverting = Growing();
  reverting.Schedule();
  reverting.StartBuilding();
  reverting.Refuse();
  EXPECT_DEATH(reverting.Submit(), "check failed");
}

TEST(HullStateDeathTest, OnlyAQuietHullEnds) {
  EXPECT_DEATH(HullState::Creating().StartEnding(), "check failed");
  EXPECT_DEATH(Growing().StartEnding(), "check failed");
  EXPECT_DEATH(Building().StartEnding(), "check failed");
  EXPECT_DEATH(Ending().StartEnding(), "check failed");
  EXPECT_DEATH(Gone().StartEnding(), "check failed");
}

TEST(HullStateDeathTest, OnlyStartedWorkIsReturned) {
  EXPECT_DEATH(HullState::Present().EndWork(), "check failed");
  EXPECT_DEATH(HullState::Present().Commit(), "check failed");
  EXPECT_DEATH(HullState::Present().Refuse(), "check failed");
  EXPECT_DEATH(Gone().Commit(), "check failed");
}

TEST(HullStateDeathTest, PeerChangesApplyOnlyWithNothingInFlight) {
  EXPECT_DEATH(HullState::Creating().Supersede(), "check failed");
  EXPECT_DEATH(Growing().Supersede(), "check failed");
  EXPECT_DEATH(Ending().Vanish(), "check failed");
  EXPECT_DEATH(Gone().Vanish(), "check failed");
}

TEST(HullStateDeathTest, DamageHasOneCause) {
  EXPECT_DEATH(Damaged().Damage(absl::DataLossError("again")), "check failed");
  EXPECT_DEATH(HullState::Present().Damage(absl::OkStatus()), "check failed");
  EXPECT_DEATH(Gone().Damage(absl::DataLossError("damaged")), "check failed");
}

}  // namespace hull_state_test
}  // namespace hulld::server
