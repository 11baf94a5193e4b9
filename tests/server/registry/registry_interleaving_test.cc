// Moments between two steps of one call in which another call comes.
#include <absl/status/status.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>
#include <future>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "server/process/worker_pool.h"
#include "server/registry/registry.h"
#include "server/store/memory_store.h"
#include "tests/server/harness/store_fixture.h"

namespace hulld::server {
namespace {

// Keeps hulls in memory so that they can be read back, and calls a test at the moments that it
// waits for.
class ScriptedStore : public MemoryStore {
 public:
  bool keeps_hulls() const override { return true; }

  absl::StatusOr<std::vector<Vector>> LoadVertices(const StoredHull& hull) override {
    const std::lock_guard lock(mutex_);
    return vertices_[hull.record.create_revision];
  }

  absl::StatusOr<uint64_t> LoadSequence(const HullRecord& hull,
                                        const std::string& writer_id) override {
    uint64_t sequence = 0;
    {
      const std::lock_guard lock(mutex_);
      sequence = sequences_[{hull.create_revision, writer_id}];
    }
    if (after_load_sequence) std::exchange(after_load_sequence, nullptr)();
    return sequence;
  }

  absl::Status Commit(std::span<const Change* const> changes) override {
    if (before_commit) {
      const absl::Status status = std::exchange(before_commit, nullptr)();
      if (!status.ok()) return status;
    }
    const std::lock_guard lock(mutex_);
    for (const Change* change : changes) {
      const uint64_t incarnation = change->hull.record.create_revision;
      std::vector<Vector>& vertices = vertices_[incarnation];
      if (change->vertex_change == VertexChange::kReplaced) vertices.clear();
      vertices.insert(vertices.end(), change->vertices.begin(), change->vertices.end());
      if (!change->writer.has_value()) continue;
      sequences_[{incarnation, change->writer->writer_id}] = change->writer->sequence;
    }
    return absl::OkStatus();
  }

  // Each is called once, without a lock, by the next call of its kind. Set while none is running.
  std::function<void()> after_load_sequence;
  std::function<absl::Status()> before_commit;

 private:
  std::mutex mutex_;
  std::map<uint64_t, std::vector<Vector>> vertices_;
  std::map<std::pair<uint64_t, std::string>, uint64_t> sequences_;
};

class RegistryInterleaving : public ::testing::Test {
 protected:
  AppendSession Open(const std::string& id, const std::string& writer) {
    return OpenResultOf(id, writer).session;
  }
  OpenResult OpenResultOf(const std::string& id, const std::string& writer) {
    return *DurableRegistry::Wait<OpenResult>([&](Reply<OpenResult> done) {
      registry_.OpenAppend(
          id, writer, true, [](const absl::Status&) {}, std::move(done));
    });
  }
  std::future<absl::StatusOr<ChunkResult>> StartAppend(const AppendSession& session,
                                                       uint64_t sequence,
                                                       std::vector<Vector> points) {
    const auto promise = std::make_shared<std::promise<absl::StatusOr<ChunkResult>>>();
    registry_.Append(
        session, {sequence, std::move(points), std::nullopt}, {}, {},
        [promise](absl::StatusOr<ChunkResult> result) { promise->set_value(std::move(result)); });
    return promise->get_future();
  }
  absl::StatusOr<ChunkResult> Append(const AppendSession& session, uint64_t sequence,
                                     std::vector<Vector> points) {
    return StartAppend(session, sequence, std::move(points)).get();
  }

  ScriptedStore store_;
  WorkerPool writers_{2};
  Registry registry_{store_, Limits(), writers_};
};

// Enough facets that making the canonical hull asks now and then whether to stop.
std::vector<Vector> Paraboloid() {
  std::vector<Vector> points;
  for (int i = -30; i <= 30; ++i) {
    for (int j = -30; j <= 30; ++j) points.emplace_back(i, j, i * i + j * j);
  }
  return points;
}

// The second hull is current when the reader starts, and changed while it makes the first.
TEST_F(RegistryInterleaving, AReaderThatIsCancelledHoldsNoWriterBack) {
  const AppendSession a = Open("a", "w");
  const AppendSession b = Open("b", "w");
  ASSERT_TRUE(Append(a, 1, Paraboloid()).ok());
  ASSERT_TRUE(Append(b, 1, Paraboloid()).ok());
  int polls_of_one = 0;
  const auto count = [&] {
    ++polls_of_one;
    return false;
  };
  ASSERT_TRUE(registry_.Resolve("b", count).ok());
  ASSERT_GT(polls_of_one, 1);

  const std::vector<std::string> ids = {"a", "b"};
  std::future<absl::StatusOr<ChunkResult>> next;
  int polls = 0;
  const auto resolved = registry_.Resolve(ids, [&] {
    ++polls;
    if (polls == 1) {
      EXPECT_TRUE(Append(b, 2, {{0, 0, 5000}}).ok());
    }
    // The first time that it asks while it makes the second hull.
    if (polls == polls_of_one + 1) next = StartAppend(b, 3, {{0, 0, 6000}});
    return polls > polls_of_one;
  });
  EXPECT_TRUE(absl::IsCancelled(resolved.status())) << resolved.status();
  ASSERT_TRUE(next.valid());
  EXPECT_TRUE(next.get().ok());
}

TEST_F(RegistryInterleaving, ASequenceThatIsReadWhileAnotherIsCommittedIsTheNewer) {
  const AppendSession first = Open("h", "w");
  ASSERT_TRUE(Append(first, 1, {{0, 0, 0}}).ok());
  registry_.CloseAppend(first);
  store_.after_load_sequence = [this] {
    const OpenResult other = OpenResultOf("h", "w");
    EXPECT_EQ(other.last_sequence, 1);
    EXPECT_TRUE(Append(other.session, 2, {{1, 0, 0}}).ok());
    registry_.CloseAppend(other.session);
  };
  const OpenResult opened = OpenResultOf("h", "w");
  EXPECT_EQ(opened.last_sequence, 2);
  const absl::StatusOr<ChunkResult> repeated = Append(opened.session, 2, {{1, 0, 0}});
  ASSERT_TRUE(repeated.ok()) << repeated.status();
  EXPECT_TRUE(repeated->already_applied);
  registry_.CloseAppend(opened.session);
}

// The chunk is already with a thread, which has not begun, when the batch before it fails.
TEST_F(RegistryInterleaving, AChunkIsNotBuiltOnOneThatWasRefused) {
  const AppendSession refused = Open("h", "refused");
  const AppendSession kept = Open("h", "kept");
  std::promise<void> committing;
  std::promise<void> fail;
  store_.before_commit = [&] {
    committing.set_value();
    fail.get_future().wait();
    return absl::UnavailableError("the disk is gone for a moment");
  };
  auto first = StartAppend(refused, 1, {{0, 0, 0}});
  committing.get_future().wait();
  std::promise<void> go;
  const std::shared_future<void> gone = go.get_future().share();
  for (int thread = 0; thread < 2; ++thread) writers_.Submit([gone] { gone.wait(); });
  auto second = StartAppend(kept, 1, {{1, 0, 0}});
  fail.set_value();
  EXPECT_TRUE(absl::IsUnavailable(first.get().status()));
  go.set_value();
  const absl::StatusOr<ChunkResult> result = second.get();
  ASSERT_TRUE(result.ok()) << result.status();
  EXPECT_EQ(result->vertex_count, 1);
  EXPECT_EQ(registry_.Resolve("h", {})->second.record.counts.received, 1);
}

}  // namespace
}  // namespace hulld::server
