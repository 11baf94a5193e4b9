#include "server/shards/shards_watch.h"

#include <absl/status/status.h>

#include <algorithm>
#include <utility>

#include "server/shards/shards.h"

namespace hulld::server {

absl::StatusOr<std::shared_ptr<ShardsWatch>> Shards::OpenWatch(const WatchTarget& target,
                                                               const ShardsWatchStart& start,
                                                               std::function<void()> on_ready) {
  return ShardsWatch::Open(
      registries_, [this](const std::string& id) { return shard_of(id); }, target, start,
      std::move(on_ready));
}

absl::StatusOr<std::shared_ptr<ShardsWatch>> ShardsWatch::Open(
    std::span<const std::unique_ptr<Registry>> registries, ShardOf shard_of,
    const WatchTarget& target, const ShardsWatchStart& start, std::function<void()> on_ready) {
  const std::shared_ptr<ShardsWatch> watch(new ShardsWatch(std::move(on_ready)));
  watch->shard_of_ = std::move(shard_of);
  watch->tells_present_ = start.tell_present;
  const bool is_of_one = target.ids.size() == 1 && !target.varies;
  for (size_t shard = 0; shard < registries.size(); ++shard) {
    if (is_of_one && watch->shard_of_(target.ids.front()) != shard) continue;
    Part& part = watch->parts_.emplace_back();
    part.shard = shard;
    part.registry = registries[shard].get();
    part.target = target;
    part.is_synced = !start.tell_present;
    if (registries.size() == 1 || target.ids.empty() || is_of_one) continue;
    std::erase_if(part.target.ids,
                  [&](const std::string& id) { return watch->shard_of_(id) != shard; });
    // No hull has this ID.
    if (part.target.ids.empty()) part.target.ids.emplace_back();
  }
  bool resumes = !start.after.empty();
  std::vector<WatchStart> starts;
  for (const Part& part : watch->parts_) {
    WatchStart& of_part = starts.emplace_back(WatchStart{.tell_present = start.tell_present});
    for (const ShardsWatchStart::After& after : start.after) {
      const bool is_its = after.store_id == part.registry->store().id();
      // One alone is told, too, where it is of another store.
      if (!is_its && (watch->parts_.size() > 1 || of_part.after_revision > 0)) continue;
      of_part.after_revision = after.revision;
      of_part.store_id = after.store_id;
    }
    resumes &= of_part.after_revision > 0;
  }
  // Not all are named: what is known of the others cannot be told apart.
  watch->says_anew_ = !start.after.empty() && !resumes;
  for (size_t part = 0; part < watch->parts_.size(); ++part) {
    const WatchStart fresh = {.tell_present = start.tell_present};
    absl::Status opened = watch->OpenPart(part, watch->says_anew_ ? fresh : starts[part]);
    if (opened.ok()) continue;
    watch->Close();
    return opened;
  }
  return watch;
}

// The former watch of the part, if any, must be closed.
absl::Status ShardsWatch::OpenPart(size_t part, const WatchStart& start) {
  Part& opened = parts_[part];
  uint64_t generation = 0;
  {
    const std::lock_guard lock(mutex_);
    generation = ++opened.generation;
    opened.is_ready = true;
  }
  absl::StatusOr<std::shared_ptr<ChangeWatch>> watch = opened.registry->OpenWatch(
      opened.target, start,
      [self = shared_from_this(), part, generation] { self->OnPartReady(part, generation); });
  if (!watch.ok()) return watch.status();
  opened.is_synced = !start.tell_present;
  opened.revision = start.after_revision;
  bool is_closed = false;
  {
    const std::lock_guard lock(mutex_);
    is_closed = is_closed_;
    if (!is_closed) opened.watch = *watch;
  }
  if (is_closed) opened.registry->CloseWatch(*watch);
  return absl::OkStatus();
}

void ShardsWatch::OnPartReady(size_t part, uint64_t generation) {
  {
    const std::lock_guard lock(mutex_);
    if (parts_[part].generation != generation) return;
    parts_[part].is_ready = true;
    if (!std::exchange(waits_, false)) return;
  }
  on_ready_();
}

absl::Status ShardsWatch::StartAllAnewBut(size_t part) {
  for (size_t other = 0; other < parts_.size(); ++other) {
    if (other == part) continue;
    std::shared_ptr<ChangeWatch> former;
    {
      const std::lock_guard lock(mutex_);
      former = std::exchange(parts_[other].watch, nullptr);
    }
    if (former != nullptr) parts_[other].registry->CloseWatch(former);
    const absl::Status opened = OpenPart(other, {.tell_present = tells_present_});
    if (!opened.ok()) return opened;
  }
  return absl::OkStatus();
}

absl::StatusOr<ShardsWatchPiece> ShardsWatch::TakeChanges() {
  while (true) {
    std::shared_ptr<ChangeWatch> watch;
    size_t chosen = 0;
    {
      const std::lock_guard lock(mutex_);
      for (size_t i = 0; i < parts_.size() && watch == nullptr; ++i) {
        chosen = (next_ + i) % parts_.size();
        if (!parts_[chosen].is_ready) continue;
        // Before it is asked, as it may say so again at once.
        parts_[chosen].is_ready = false;
        watch = parts_[chosen].watch;
      }
      if (watch == nullptr) {
        waits_ = true;
        ShardsWatchPiece nothing;
        nothing.waits = true;
        return nothing;
      }
    }
    Part& part = parts_[chosen];
    absl::StatusOr<WatchPiece> piece = part.registry->TakeChanges(*watch);
    if (!piece.ok()) return piece.status();
    if (piece->waits) {
      next_ = chosen + 1;
      continue;
    }
    {
      const std::lock_guard lock(mutex_);
      part.is_ready = true;
    }
    // What is there is told by one shard after the other.
    next_ = part.is_synced ? chosen + 1 : chosen;
    if (piece->anew) {
      part.is_synced = false;
      if (absl::Status s = StartAllAnewBut(chosen); !s.ok()) return s;
    }
    part.revision = piece->revision;
    ShardsWatchPiece told;
    told.shard = part.shard;
    told.changes = std::move(piece->changes);
    told.anew = piece->anew || std::exchange(says_anew_, false);
    if (piece->synced) {
      part.is_synced = true;
      told.synced = std::ranges::all_of(parts_, [](const Part& one) { return one.is_synced; });
    }
    for (const Part& one : parts_) told.revisions.push_back({one.shard, one.revision});
    return told;
  }
}

void ShardsWatch::WatchAlso(std::span<const std::string> added,
                            std::span<const std::string> dropped) {
  if (parts_.size() == 1) {
    return parts_[0].registry->WatchAlso(*parts_[0].watch, added, dropped);
  }
  const auto of_part = [this](std::span<const std::string> ids, const Part& part) {
    std::vector<std::string> its;
    for (const std::string& id : ids) {
      if (shard_of_(id) == part.shard) its.push_back(id);
    }
    return its;
  };
  for (const Part& part : parts_) {
    part.registry->WatchAlso(*part.watch, of_part(added, part), of_part(dropped, part));
  }
}

void ShardsWatch::Nudge() {
  std::shared_ptr<ChangeWatch> watch;
  {
    const std::lock_guard lock(mutex_);
    watch = parts_.front().watch;
  }
  if (watch != nullptr) parts_.front().registry->NudgeWatch(watch);
}

void ShardsWatch::Close() {
  std::vector<std::pair<Registry*, std::shared_ptr<ChangeWatch>>> open;
  {
    const std::lock_guard lock(mutex_);
    is_closed_ = true;
    for (Part& part : parts_) {
      if (part.watch != nullptr) open.emplace_back(part.registry, std::exchange(part.watch, {}));
    }
  }
  for (const auto& [registry, watch] : open) registry->CloseWatch(watch);
}

}  // namespace hulld::server
