// Reads of several shards.
//
// How versions are proven to be of one instant. A look asks every shard of the call for what was
// committed by then, all at once, and looks up the hulls of the call. So each version was current
// at some time during the look. The next look begins when the one before has ended. A shard whose
// hulls are the same in both had them all the while between, as versions never come back. If no
// shard's hulls changed, all versions were current when the first of the two looks ended.
//
// If those of one shard alone change from each look to the next, take three looks: what that shard
// had at the time of the second was current then, and what the others had is the same before and
// after it. So a hull that changes all the time does not hold up a call that asks about it and one
// of another shard that does not change.
//
// Where those of two shards change all the time, looking does not come to an end. After
// Shards::kLooks, all shards of the call but one are held: nothing is committed there. What they
// have then was current as well when the last one was asked. They are held one after the other in
// the order of their stores' IDs, which is the same in all servers, so that those who hold do not
// wait for each other in a circle.
#include <absl/status/status.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <utility>

#include "core/base/check.h"
#include "server/contract/stopped_call.h"
#include "server/process/synchronization.h"
#include "server/shards/shards.h"

namespace hulld::server {
namespace {

// holds: as Shards::Refresh.
absl::Status CheckThat(const std::function<bool()>& holds) {
  if (!holds || holds()) return absl::OkStatus();
  return absl::AbortedError("bodies changed meanwhile");
}

// What several registries were asked for.
struct Answers {
  Mutex mutex;
  ConditionVariable changed;
  size_t due = 0;
  absl::Status status;
};

// The same where nobody waits for them.
struct Asked {
  explicit Asked(std::function<void(const absl::Status&)> to_tell) : done(std::move(to_tell)) {}

  void Tell(const absl::Status& answer) {
    {
      const std::lock_guard lock(mutex);
      status.Update(answer);
    }
    // The last one sees what all have left.
    if (--due == 0) done(status);
  }

  const std::function<void(const absl::Status&)> done;
  // One of them is the asking thread.
  std::atomic<size_t> due = 1;
  Mutex mutex;
  absl::Status status;
};

bool IsSame(const absl::StatusOr<HullView>& a, const absl::StatusOr<HullView>& b) {
  if (!a.ok() || !b.ok()) return a.status().code() == b.status().code();
  return a->record.create_revision == b->record.create_revision &&
         a->record.revision == b->record.revision;
}

}  // namespace

// Those that have to be asked are asked at the same time.
absl::StatusOr<std::chrono::nanoseconds> Shards::AwaitFreshIn(
    std::span<const size_t> shards, const ShardsFreshness& freshness,
    const std::function<bool()>& should_stop) {
  ShardsFreshness wanted = freshness;
  // So that what is asked now suffices.
  if (!wanted.began.has_value()) wanted.began = SteadyClock::now();
  const auto answers = std::make_shared<Answers>();
  for (const size_t shard : shards) {
    if (at(shard).TryFresh(wanted.Of(shard)).has_value()) continue;
    {
      const std::lock_guard lock(answers->mutex);
      ++answers->due;
    }
    at(shard).StartFollow([answers](const absl::Status& status) {
      const std::lock_guard lock(answers->mutex);
      answers->status.Update(status);
      --answers->due;
      answers->changed.notify_all();
    });
  }
  {
    std::unique_lock lock(answers->mutex);
    const auto is_over = [&] { return answers->due == 0; };
    while (!is_over()) {
      answers->changed.wait_for(lock, kStopPoll, is_over);
      if (is_over()) break;
      lock.unlock();
      if (Stopped(should_stop)) return Cancelled();
      lock.lock();
    }
    if (!answers->status.ok()) return answers->status;
  }
  std::chrono::nanoseconds staleness{0};
  for (const size_t shard : shards) {
    const auto part = at(shard).AwaitFresh(wanted.Of(shard), should_stop);
    if (!part.ok()) return part.status();
    staleness = std::max(staleness, *part);
  }
  return staleness;
}

absl::Status Shards::AwaitOthers(const std::function<bool()>& should_stop) {
  if (size() == 1) return at(0).AwaitOthers(should_stop);
  return AwaitFresh(ShardsFreshness(), should_stop).status();
}

absl::StatusOr<std::chrono::nanoseconds> Shards::AwaitFresh(
    const ShardsFreshness& freshness, const std::function<bool()>& should_stop) {
  if (size() == 1) return at(0).AwaitFresh(freshness, should_stop);
  std::vector<size_t> all(size());
  for (size_t shard = 0; shard < size(); ++shard) all[shard] = shard;
  return AwaitFreshIn(all, freshness, should_stop);
}

std::optional<std::chrono::nanoseconds> Shards::TryFresh(const ShardsFreshness& freshness) {
  std::chrono::nanoseconds staleness{0};
  for (size_t shard = 0; shard < size(); ++shard) {
    const auto part = at(shard).TryFresh(freshness.Of(shard));
    if (!part.has_value()) return std::nullopt;
    staleness = std::max(staleness, *part);
  }
  return staleness;
}

bool Shards::StartFresh(std::span<const std::string> ids, const ShardsFreshness& freshness,
                        std::function<void(const absl::Status&)> done) {
  if (size() == 1) return at(0).StartFresh(freshness.Of(0), std::move(done));
  std::vector<bool> is_named(size());
  for (const std::string& id : ids) is_named[shard_of(id)] = true;
  if (ids.empty()) is_named[0] = true;
  const auto asked = std::make_shared<Asked>(std::move(done));
  bool asks = false;
  for (size_t shard = 0; shard < size(); ++shard) {
    if (!is_named[shard]) continue;
    ++asked->due;
    const bool asks_it = at(shard).StartFresh(freshness.Of(shard),
                                              [asked](const absl::Status& s) { asked->Tell(s); });
    if (!asks_it) --asked->due;
    asks |= asks_it;
  }
  if (asks) asked->Tell(absl::OkStatus());
  return asks;
}

// Finds out which shards the call concerns; once. A call that names nothing concerns the first.
void Shards::Begin(std::span<const std::string> ids, std::span<const std::string> also,
                   KnownInShards& known) const {
  if (std::exchange(known.has_begun_, true) || size() == 1) return;
  constexpr uint32_t kNoPart = UINT32_MAX;
  std::vector<uint32_t> part_of(size(), kNoPart);
  for (const auto& some : {ids, also}) {
    for (const std::string& id : some) part_of[shard_of(id)] = 0;
  }
  uint32_t parts = 0;
  for (size_t shard = 0; shard < size(); ++shard) {
    if (part_of[shard] == kNoPart) continue;
    part_of[shard] = parts++;
    known.only_shard_ = shard;
    known.parts_.push_back({.shard = shard});
  }
  if (parts <= 1) return known.parts_.clear();
  known.place_of_.reserve(ids.size());
  for (const std::string& id : ids) {
    const uint32_t part = part_of[shard_of(id)];
    std::vector<std::string>& of_part = known.parts_[part].ids;
    known.place_of_.emplace_back(part, static_cast<uint32_t>(of_part.size()));
    of_part.push_back(id);
  }
}

absl::StatusOr<Shards::Look> Shards::LookOnce(KnownInShards& known,
                                              const std::function<bool()>& should_stop,
                                              const ShardsPlan& plan,
                                              const std::function<bool()>& holds) {
  std::vector<size_t> shards;
  for (const Part& part : known.parts_) shards.push_back(part.shard);
  absl::StatusOr<Look> look = LookAt(known, shards, should_stop, plan);
  if (!look.ok()) return look;
  if (absl::Status s = CheckThat(holds); !s.ok()) return s;
  return look;
}

// to_ask: those shards of the call that are still to become as fresh as the plan says; the others
// are.
absl::StatusOr<Shards::Look> Shards::LookAt(KnownInShards& known, std::span<const size_t> to_ask,
                                            const std::function<bool()>& should_stop,
                                            const ShardsPlan& plan) {
  const auto staleness = AwaitFreshIn(to_ask, plan.freshness, should_stop);
  if (!staleness.ok()) return staleness.status();
  Look look;
  look.staleness = *staleness;
  ReadPlan of_what_is_here = plan.Of(0);
  of_what_is_here.freshness = Freshness::OfWhatIsHere();
  for (Part& part : known.parts_) {
    absl::StatusOr<Resolved> resolved =
        at(part.shard).Refresh(part.ids, part.known, should_stop, of_what_is_here);
    if (!resolved.ok()) return resolved.status();
    look.parts.push_back(*std::move(resolved));
    look.lookups.push_back(part.known.lookups());
    if (on_part_) on_part_();
  }
  return look;
}

// ABORTED: changes could not be held back, or not for as long as the look took.
absl::StatusOr<Shards::Look> Shards::LookWhileHeld(KnownInShards& known,
                                                   const std::function<bool()>& should_stop,
                                                   const ShardsPlan& plan) {
  struct Holds {
    ~Holds() { EndAll(); }
    // Whether all have lasted.
    bool EndAll() {
      bool lasted = true;
      for (const auto& hold : std::exchange(all, {})) lasted = hold->End() && lasted;
      return lasted;
    }
    std::vector<std::shared_ptr<CommitHold>> all;
  };
  std::vector<size_t> shards;
  for (const Part& part : known.parts_) shards.push_back(part.shard);
  std::ranges::sort(shards, {}, [this](size_t shard) { return store_ids_[shard]; });
  Holds held;
  for (const size_t shard : std::span(shards).first(shards.size() - 1)) {
    held.all.push_back(std::make_shared<CommitHold>());
    at(shard).Hold(held.all.back());
    const absl::Status status = held.all.back()->Await(should_stop);
    if (absl::IsCancelled(status)) return status;
    if (!status.ok()) return absl::AbortedError(status.message());
  }
  for (const auto& hold : held.all) hold->Extend();
  if (on_part_) on_part_();
  ShardsPlan now = plan;
  // The one that is not held is asked while the others are.
  now.freshness.began = SteadyClock::now();
  absl::StatusOr<Look> look = LookAt(known, std::span(shards).last(1), should_stop, now);
  if (look.ok() && !held.EndAll()) return absl::AbortedError("changes were held back too long");
  return look;
}

// Whether hulls of a part may have changed from one look to the next. What there is none of, or
// what is damaged, has no version to compare: then nothing may have been looked up anew.
bool Shards::HasChanged(const Look& before, const Look& now, size_t part) {
  const auto& hulls = now.parts[part].hulls;
  if (!std::ranges::equal(before.parts[part].hulls, hulls,
                          [](const auto& a, const auto& b) { return IsSame(a, b); })) {
    return true;
  }
  const bool has_all = std::ranges::all_of(hulls, [](const auto& hull) { return hull.ok(); });
  return !has_all && before.lookups[part] != now.lookups[part];
}

absl::StatusOr<Shards::Look> Shards::LookUntilOneInstant(KnownInShards& known, Look before,
                                                         const std::function<bool()>& should_stop,
                                                         ShardsPlan plan,
                                                         const std::function<bool()>& holds) {
  const size_t parts = known.parts_.size();
  // Those that changed before the look that is `before`; at first, nothing is known of that.
  std::vector<bool> changed_before(parts, true);
  for (int looks = 1;; ++looks) {
    if (Stopped(should_stop)) return Cancelled();
    // The question is to be asked after the last look.
    plan.freshness.began = SteadyClock::now();
    if (looks % kLooks == 0) {
      absl::StatusOr<Look> held = LookWhileHeld(known, should_stop, plan);
      if (held.ok()) {
        if (absl::Status s = CheckThat(holds); !s.ok()) return s;
        return held;
      }
      if (!absl::IsAborted(held.status())) return held;
      plan.freshness.began = SteadyClock::now();
    }
    absl::StatusOr<Look> now = LookOnce(known, should_stop, plan, holds);
    if (!now.ok()) return now;
    std::vector<bool> changed(parts);
    size_t count = 0;
    size_t last = 0;
    for (size_t i = 0; i < parts; ++i) {
      changed[i] = HasChanged(before, *now, i);
      if (!changed[i]) continue;
      ++count;
      last = i;
    }
    if (count == 0) return now;
    const bool others_stood_still = [&] {
      for (size_t i = 0; i < parts; ++i) {
        if (i != last && changed_before[i]) return false;
      }
      return true;
    }();
    if (count == 1 && others_stood_still) {
      now->parts[last] = std::move(before.parts[last]);
      return now;
    }
    before = *std::move(now);
    changed_before = std::move(changed);
  }
}

// In the order of the IDs.
ShardsResolved Shards::Join(std::span<const std::string> ids, const KnownInShards& known,
                            Look look) {
  ShardsResolved joined;
  joined.as_of.staleness = look.staleness;
  for (size_t i = 0; i < look.parts.size(); ++i) {
    joined.as_of.revisions.push_back({known.parts_[i].shard, look.parts[i].store_revision});
  }
  HULLD_CHECK(ids.size() == known.place_of_.size());
  joined.hulls.reserve(ids.size());
  for (const auto& [part, place] : known.place_of_) {
    joined.hulls.push_back(std::move(look.parts[part].hulls[place]));
  }
  return joined;
}

absl::StatusOr<ShardsResolved> Shards::Refresh(std::span<const std::string> ids,
                                               KnownInShards& known,
                                               const std::function<bool()>& should_stop,
                                               const ShardsPlan& plan,
                                               std::span<const std::string> also,
                                               const std::function<bool()>& holds) {
  Begin(ids, also, known);
  if (known.parts_.empty()) {
    const size_t shard = known.only_shard_;
    absl::StatusOr<Resolved> resolved =
        at(shard).Refresh(ids, known.only_, should_stop, plan.Of(shard));
    if (!resolved.ok()) return resolved.status();
    if (absl::Status s = CheckThat(holds); !s.ok()) return s;
    return ShardsResolved{{{{shard, resolved->store_revision}}, resolved->staleness},
                          std::move(resolved->hulls)};
  }
  absl::StatusOr<Look> look = LookOnce(known, should_stop, plan, holds);
  if (look.ok() && plan.freshness.is_linearizable()) {
    look = LookUntilOneInstant(known, *std::move(look), should_stop, plan, holds);
  }
  if (!look.ok()) return look.status();
  return Join(ids, known, *std::move(look));
}

// Where others commit to the stores, the second look has to ask.
std::optional<ShardsResolved> Shards::TryResolve(std::span<const std::string> ids,
                                                 const ShardsPlan& plan) {
  KnownInShards known;
  Begin(ids, {}, known);
  if (known.parts_.empty()) {
    const size_t shard = known.only_shard_;
    std::optional<Resolved> resolved = at(shard).TryResolve(ids, plan.Of(shard));
    if (!resolved.has_value()) return std::nullopt;
    return ShardsResolved{{{{shard, resolved->store_revision}}, resolved->staleness},
                          std::move(resolved->hulls)};
  }
  const bool is_linearizable = plan.freshness.is_linearizable();
  const auto try_look = [&](Look* look) {
    for (const Part& part : known.parts_) {
      if (is_linearizable && at(part.shard).store().is_shared()) return false;
      std::optional<Resolved> resolved = at(part.shard).TryResolve(part.ids, plan.Of(part.shard));
      if (!resolved.has_value()) return false;
      look->staleness = std::max(look->staleness, resolved->staleness);
      look->parts.push_back(*std::move(resolved));
      if (on_part_) on_part_();
    }
    return true;
  };
  Look look;
  if (!try_look(&look)) return std::nullopt;
  if (is_linearizable) {
    Look again;
    if (!try_look(&again)) return std::nullopt;
    for (size_t i = 0; i < look.parts.size(); ++i) {
      // What there is none of may have come and gone.
      for (size_t k = 0; k < look.parts[i].hulls.size(); ++k) {
        if (!again.parts[i].hulls[k].ok()) return std::nullopt;
        if (!IsSame(look.parts[i].hulls[k], again.parts[i].hulls[k])) return std::nullopt;
      }
    }
    look = std::move(again);
  }
  return Join(ids, known, std::move(look));
}

}  // namespace hulld::server
