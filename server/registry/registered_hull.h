#ifndef HULLD_SERVER_REGISTRY_REGISTERED_HULL_H_
#define HULLD_SERVER_REGISTRY_REGISTERED_HULL_H_

#include <absl/status/status.h>

#include <condition_variable>
#include <functional>
#include <list>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <unordered_map>
#include <utility>
#include <vector>

#include "server/registry/registry.h"

namespace hulld::server {

// The registry's mutex, held, and what is to be done once it is not: callbacks, and the end of
// large objects.
class Registry::Locked {
 public:
  explicit Locked(std::mutex& mutex) : lock_(mutex) {}
  Locked(const Locked&) = delete;
  Locked& operator=(const Locked&) = delete;
  ~Locked() {
    if (lock_.owns_lock()) Unlock();
  }

  void Unlock() {
    std::vector<std::function<void()>> afterwards = std::move(afterwards_);
    afterwards_.clear();
    lock_.unlock();
    for (const auto& task : afterwards) task();
  }
  void Lock() { lock_.lock(); }
  std::unique_lock<std::mutex>& lock() { return lock_; }

  void Afterwards(std::function<void()> task) { afterwards_.push_back(std::move(task)); }
  template <typename T>
  void Discard(std::unique_ptr<T> object) {
    if (object != nullptr) Discard(std::shared_ptr<T>(std::move(object)));
  }
  template <typename T>
  void Discard(std::shared_ptr<T> object) {
    if (object != nullptr) afterwards_.push_back([kept = std::move(object)] {});
  }

 private:
  std::unique_lock<std::mutex> lock_;
  std::vector<std::function<void()>> afterwards_;
};

struct Registry::PendingChunk {
  AppendSession session;
  Chunk chunk;
  std::function<bool()> should_stop;
  std::function<void()> on_built;
  Reply<ChunkResult> done;
  // What the cache counts for its points.
  uint64_t charged_bytes = 0;
};

// A change on its way to the store.
struct Registry::PendingCommit {
  Change change;
  HullPointer hull;
  Finish finish;
  // What the cache counts for its vertices.
  uint64_t charged_bytes = 0;
};

struct Registry::OpenRequest {
  std::string hull_id;
  std::string writer_id;
  bool create_if_absent = false;
  bool created_hull = false;
  std::function<void(const absl::Status&)> on_gone;
  Reply<OpenResult> done;
};

struct RegisteredHull {
  enum class State { kCreating, kPresent, kGone };
  // The last sequence of a writer.
  struct Sequences {
    uint64_t committed = 0;
    // With the chunks on their way.
    uint64_t head = 0;
  };

  State state = State::kPresent;
  StoredHull committed;
  // With the changes on their way.
  StoredHull head;
  // Of committed.record.revision; null when nobody has asked since the last change.
  std::shared_ptr<const ServedHull> served;
  // Not OK when the store cannot give the hull back.
  absl::Status damage;
  // Those in use; the store has the others.
  std::unordered_map<std::string, Sequences> writers;
  // One per open session.
  std::map<uint64_t, std::function<void(const absl::Status&)>> watches;

  // Whoever set `busy` owns the builder, without the registry's mutex.
  bool busy = false;
  // The hull with the changes on their way; null when it is to be read from the store.
  std::unique_ptr<HullBuilder> builder;
  // Changes on their way, and whether they are a creation, a deletion or a replacement.
  int in_flight = 0;
  bool ending = false;
  // How often changes on their way were refused and the hull went back to `committed`.
  uint64_t reverts = 0;
  // Readers that need the builder; the next chunk waits for them.
  int pins = 0;
  std::condition_variable released;
  std::list<Registry::PendingChunk> chunks;
  // What waits until the hull is neither busy nor a change of it on its way; goes before chunks.
  std::list<std::function<void(Registry::Locked&)>> exclusive;

  // What the registry's cache counts for it.
  size_t charged_bytes = 0;
  size_t builder_bytes = 0;
  bool in_used_list = false;
  std::list<RegisteredHull*>::iterator used_place;

  bool quiet() const { return !busy && in_flight == 0; }
};

// The error, or a result that is still to be filled in.
template <typename T>
absl::StatusOr<T> ErrorOrEmpty(const absl::Status& status) {
  if (!status.ok()) return status;
  return T();
}

std::string QuotedHull(const std::string& id);
absl::Status HullNotFound(const std::string& id);
absl::Status RevisionMismatch(const HullRecord& record, uint64_t if_revision);

}  // namespace hulld::server

#endif  // HULLD_SERVER_REGISTRY_REGISTERED_HULL_H_
