#include <gtest/gtest.h>

#include <memory>
#include <vector>

#include "server/store/store.h"

namespace hulld::server {
namespace change_revisions_test {

Change Creation(const std::string& id) {
  Change change;
  change.begins = true;
  change.hull.record.hull_id = id;
  return change;
}

// A chunk of a hull that is at these revisions.
Change Chunk(const std::shared_ptr<const HullRevisions>& before, VertexChange vertices) {
  Change change;
  change.before = before;
  change.vertex_change = vertices;
  change.takes_revision = vertices != VertexChange::kNone;
  return change;
}

uint64_t Number(std::vector<Change>& changes, uint64_t revision) {
  std::vector<Change*> pointers;
  for (Change& change : changes) pointers.push_back(&change);
  return NumberChanges(pointers, revision);
}

TEST(NumberChanges, EachVisibleChangeTakesTheNextRevision) {
  const auto before = std::make_shared<const HullRevisions>(HullRevisions{1, 4, 2});
  std::vector<Change> changes = {Creation("h"), Chunk(before, VertexChange::kNone), Creation("i")};
  EXPECT_EQ(Number(changes, 7), 9);
  EXPECT_EQ(changes[0].hull.record.create_revision, 8);
  EXPECT_EQ(changes[0].hull.record.revision, 8);
  EXPECT_EQ(changes[0].hull.layout.base_revision, 0);
  EXPECT_EQ(changes[1].revision, 8);
  EXPECT_EQ(changes[1].hull.record.create_revision, 1);
  EXPECT_EQ(changes[1].hull.record.revision, 4);
  EXPECT_EQ(changes[2].revision, 9);
}

TEST(NumberChanges, ChunksOfOneHullBuildOnEachOther) {
  const auto before = std::make_shared<const HullRevisions>(HullRevisions{1, 4, 2});
  std::vector<Change> changes = {
      Chunk(before, VertexChange::kReplaced), Chunk(before, VertexChange::kNone),
      Chunk(before, VertexChange::kAdded), Chunk(before, VertexChange::kNone)};
  // Renumbering, as after a peer committed first, replaces the revisions.
  for (const uint64_t revision : {7, 20}) {
    EXPECT_EQ(Number(changes, revision), revision + 2);
    const std::vector<uint64_t> revisions = {revision + 1, revision + 1, revision + 2,
                                             revision + 2};
    for (size_t i = 0; i < changes.size(); ++i) {
      EXPECT_EQ(changes[i].revision, revisions[i]);
      EXPECT_EQ(changes[i].hull.record.revision, revisions[i]);
      EXPECT_EQ(changes[i].hull.layout.base_revision, revision + 1);
      EXPECT_EQ(changes[i].previous_layout.base_revision, i == 0 ? 2 : revision + 1);
    }
  }
  EXPECT_EQ(before->change, 4);
}

TEST(NumberChanges, ABodyKeepsItsCreateRevision) {
  std::vector<Change> changes(2);
  changes[0].body = std::make_shared<StoredBody>();
  changes[0].begins = true;
  changes[1].body = std::make_shared<StoredBody>(StoredBody{{"b", 3, 5}, {}, {}});
  EXPECT_EQ(Number(changes, 7), 9);
  EXPECT_EQ(changes[0].body->record.create_revision, 8);
  EXPECT_EQ(changes[0].body->record.revision, 8);
  EXPECT_EQ(changes[1].body->record.create_revision, 3);
  EXPECT_EQ(changes[1].body->record.revision, 9);
}

TEST(NumberChanges, DeletedEntriesKeepTheirValues) {
  std::vector<Change> changes = {Creation("h"), Creation("i")};
  changes[1].body = std::make_shared<StoredBody>(StoredBody{{"b", 3, 5}, {}, {}});
  for (Change& change : changes) change.deleted = true;
  SetRevisions({1, 4, 2}, &changes[0].hull);
  EXPECT_EQ(Number(changes, 7), 9);
  EXPECT_EQ(changes[0].revision, 8);
  EXPECT_EQ(changes[0].hull.record.revision, 4);
  EXPECT_EQ(changes[1].body->record.revision, 5);
}

}  // namespace change_revisions_test
}  // namespace hulld::server
