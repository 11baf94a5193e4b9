#ifndef HULLD_SERVER_SHARDS_SHARDS_WATCH_H_
#define HULLD_SERVER_SHARDS_SHARDS_WATCH_H_

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <span>
#include <string>
#include <vector>

#include "server/process/synchronization.h"
#include "server/registry/registry.h"
#include "server/shards/shard_types.h"

namespace hulld::server {

// As WatchStart, with what every shard's watch resumes after.
struct ShardsWatchStart {
  struct After {
    std::string store_id;
    uint64_t revision = 0;
  };

  bool tell_present = false;
  // Empty: it does not resume.
  std::vector<After> after = {};
};

// As WatchPiece: what one shard tells next.
struct ShardsWatchPiece {
  bool waits = false;
  // Whose changes these are.
  size_t shard = 0;
  std::vector<HullChange> changes;
  // As WatchPiece::revision, of all shards that are watched.
  ShardRevisions revisions;
  // Once, when every shard has told what was there.
  bool synced = false;
  // In every shard.
  bool anew = false;
};

// One watch in each of several shards, told as one: pieces come from any that has something to
// tell. Where one has to start anew, all do, so that what was told is forgotten as a whole. With
// one shard it is that shard's watch and nothing else.
class ShardsWatch : public std::enable_shared_from_this<ShardsWatch> {
 public:
  // shard_of: the shard of an ID of the target, and of IDs that come later.
  using ShardOf = std::function<size_t(const std::string&)>;

  // Watches these registries, by their places among all, which outlive this. As
  // Registry::OpenWatch, but on_ready comes on a thread of any of them; one call at a time is due.
  static absl::StatusOr<std::shared_ptr<ShardsWatch>> Open(
      std::span<const std::unique_ptr<Registry>> registries, ShardOf shard_of,
      const WatchTarget& target, const ShardsWatchStart& start, std::function<void()> on_ready);

  // As those of Registry for a ChangeWatch. Requires for TakeChanges that the watch does not wait.
  absl::StatusOr<ShardsWatchPiece> TakeChanges();
  void WatchAlso(std::span<const std::string> added, std::span<const std::string> dropped);
  void Nudge();
  // Nothing of this may be called afterwards. An on_ready that is due by then still comes.
  void Close();

 private:
  // The watch of one shard.
  struct Part {
    size_t shard = 0;
    Registry* registry = nullptr;
    WatchTarget target;
    std::shared_ptr<ChangeWatch> watch;
    // The number of its watches so far; what an earlier one says counts for nothing.
    uint64_t generation = 0;
    // It may have something to tell.
    bool is_ready = true;
    bool is_synced = false;
    uint64_t revision = 0;
  };

  explicit ShardsWatch(std::function<void()> on_ready) : on_ready_(std::move(on_ready)) {}

  absl::Status OpenPart(size_t part, const WatchStart& start);
  absl::Status StartAllAnewBut(size_t part);
  void OnPartReady(size_t part, uint64_t generation);

  const std::function<void()> on_ready_;
  ShardOf shard_of_;
  bool tells_present_ = false;
  // The number of parts and their targets stay the same. Only the thread that takes changes opens
  // and closes the watches of parts, until Close.
  std::vector<Part> parts_;
  // The next to be asked, so that each gets its turn.
  size_t next_ = 0;
  bool says_anew_ = false;

  std::mutex mutex_;
  // Guarded by mutex_, with is_ready, watch and generation of the parts. on_ready_ is due.
  bool waits_ = false;
  bool is_closed_ = false;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_SHARDS_SHARDS_WATCH_H_
