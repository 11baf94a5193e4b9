#ifndef HULLD_TESTS_SERVER_REGISTRY_REGISTRY_INTERLEAVING_H_
#define HULLD_TESTS_SERVER_REGISTRY_REGISTRY_INTERLEAVING_H_

#include <absl/status/status.h>
#include <gtest/gtest.h>

#include <atomic>
#include <functional>
#include <future>
#include <map>
#include <memory>
#include <mutex>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "server/process/task_pool.h"
#include "server/registry/registry.h"
#include "server/store/memory_store.h"
#include "tests/server/harness/store_fixture.h"

// A registry over a store that blocks at points chosen by a test.
namespace hulld::server {

// Keeps hulls in memory, and calls a test's hooks at defined points.
class ScriptedStore : public MemoryStore {
 public:
  // A one-shot hook, called without a lock by the next call of a kind.
  template <typename Result>
  class Hook {
   public:
    void Set(std::function<Result()> hook) {
      const std::lock_guard lock(mutex_);
      hook_ = std::move(hook);
    }
    std::function<Result()> Take() {
      const std::lock_guard lock(mutex_);
      return std::exchange(hook_, nullptr);
    }

   private:
    std::mutex mutex_;
    std::function<Result()> hook_;
  };

  bool keeps_hulls() const override { return true; }

  absl::StatusOr<std::vector<Vector>> LoadVertices(const StoredHull& hull) override {
    ++loads;
    if (const auto hook = before_load.Take()) hook();
    const std::lock_guard lock(mutex_);
    const auto found = vertices_.find(hull.record.create_revision);
    if (found == vertices_.end()) return absl::DataLossError("there is none");
    return found->second;
  }

  absl::StatusOr<uint64_t> LoadSequence(const HullRecord& hull,
                                        const std::string& writer_id) override {
    if (const auto hook = before_load_sequence.Take()) hook();
    uint64_t sequence = 0;
    {
      const std::lock_guard lock(mutex_);
      sequence = sequences_[{hull.create_revision, writer_id}];
    }
    if (const auto hook = after_load_sequence.Take()) hook();
    return sequence;
  }

  absl::Status Commit(std::span<Change* const> changes) override {
    if (const auto hook = before_commit.Take()) {
      const absl::Status status = hook();
      if (!status.ok()) return status;
    }
    if (refused_of_1000 > 0) {
      const std::lock_guard lock(mutex_);
      if (random_() % 1000 < refused_of_1000) return absl::UnavailableError("a moment");
    }
    {
      const std::lock_guard lock(mutex_);
      if (absl::Status s = MemoryStore::Commit(changes); !s.ok()) return s;
      for (const Change* change : changes) Apply(*change);
    }
    if (const auto hook = after_commit.Take()) hook();
    return absl::OkStatus();
  }

  // Inject damage: the points of this incarnation are missing; one of them is replaced by an
  // interior point; all of them are coplanar.
  void Lose(const HullRecord& hull) {
    const std::lock_guard lock(mutex_);
    vertices_.erase(hull.create_revision);
  }
  void Dent(const HullRecord& hull) {
    const std::lock_guard lock(mutex_);
    vertices_[hull.create_revision].back() = Vector(0.5, 0.5, 0.5);
  }

  void Flatten(const HullRecord& hull) {
    const std::lock_guard lock(mutex_);
    for (Vector& vertex : vertices_[hull.create_revision]) vertex.z() = 0;
  }

  // Before the points are looked up.
  Hook<void> before_load;
  Hook<void> before_load_sequence;
  Hook<void> after_load_sequence;
  Hook<absl::Status> before_commit;
  // The store has the change, and the registry has not applied it yet.
  Hook<void> after_commit;
  std::atomic<uint64_t> refused_of_1000 = 0;
  std::atomic<int> loads = 0;

 private:
  void Apply(const Change& change) {
    const uint64_t incarnation = change.hull.record.create_revision;
    if (change.replaced.has_value()) vertices_.erase(change.replaced->record.create_revision);
    if (change.deleted) {
      vertices_.erase(incarnation);
      std::erase_if(sequences_,
                    [&](const auto& entry) { return entry.first.first == incarnation; });
      return;
    }
    std::vector<Vector>& vertices = vertices_[incarnation];
    if (change.vertex_change == VertexChange::kReplaced) vertices.clear();
    vertices.insert(vertices.end(), change.vertices.begin(), change.vertices.end());
    if (!change.writer.has_value()) return;
    sequences_[{incarnation, change.writer->writer_id}] = change.writer->sequence;
  }

  std::mutex mutex_;
  std::map<uint64_t, std::vector<Vector>> vertices_;
  std::map<std::pair<uint64_t, std::string>, uint64_t> sequences_;
  std::mt19937_64 random_{811};
};

// A point where a thread blocks until the test opens it.
class Gate {
 public:
  // Called by the thread.
  void Stop() {
    reached_.set_value();
    open_.get_future().wait();
  }
  // Called by the test.
  void WaitUntilReached() { reached_.get_future().wait(); }
  void Open() { open_.set_value(); }

 private:
  std::promise<void> reached_;
  std::promise<void> open_;
};

class RegistryInterleaving : public ::testing::Test {
 protected:
  AppendSession Open(const std::string& id, const std::string& writer) {
    return OpenResultOf(id, writer).session;
  }
  OpenResult OpenResultOf(const std::string& id, const std::string& writer) {
    return *DurableRegistry::Wait<OpenResult>([&](Reply<OpenResult> done) {
      registry_.changes().OpenAppend(
          id, writer, true, [](const absl::Status&) {}, std::move(done));
    });
  }
  std::future<absl::StatusOr<ChunkResult>> StartAppend(const AppendSession& session,
                                                       uint64_t sequence,
                                                       std::vector<Vector> points,
                                                       std::function<void()> on_built = {}) {
    const auto promise = std::make_shared<std::promise<absl::StatusOr<ChunkResult>>>();
    registry_.changes().Append(
        session, {sequence, std::move(points), std::nullopt}, {}, std::move(on_built),
        [promise](absl::StatusOr<ChunkResult> result) { promise->set_value(std::move(result)); });
    return promise->get_future();
  }
  absl::StatusOr<ChunkResult> Append(const AppendSession& session, uint64_t sequence,
                                     std::vector<Vector> points) {
    return StartAppend(session, sequence, std::move(points)).get();
  }

  absl::StatusOr<uint64_t> Delete(const std::string& id) {
    return DurableRegistry::Wait<uint64_t>([&](const Reply<uint64_t>& done) {
      registry_.changes().Delete("hull", id, std::nullopt, done);
    });
  }
  std::future<absl::StatusOr<Resolved>> StartResolve(std::vector<std::string> ids,
                                                     std::function<bool()> should_stop) {
    return std::async(std::launch::async,
                      [this, ids = std::move(ids), should_stop = std::move(should_stop)] {
                        return registry_.Resolve(ids, should_stop);
                      });
  }
  // Evicts all unused hulls.
  void DropAll() {
    const MemoryCharge charge(registry_.memory(), MemoryUse::kReading,
                              registry_.Cache().limit_bytes);
    EXPECT_TRUE(registry_.CheckMemory(MemoryUse::kWriting).ok());
  }

  ScriptedStore store_;
  TaskPool writers_{2};
  Registry registry_{store_, Limits(), writers_};
};

}  // namespace hulld::server

#endif  // HULLD_TESTS_SERVER_REGISTRY_REGISTRY_INTERLEAVING_H_
