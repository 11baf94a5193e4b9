// IDs: which hulls there are, and how they begin and end.
#include "server/registry/registry.h"

#include <absl/status/status.h>
#include <absl/strings/str_cat.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <utility>

#include "core/base/check.h"
#include "server/contract/error_info.h"
#include "server/contract/limit_error.h"
#include "server/registry/catalog/registered_hull.h"
#include "server/settings/cpu_limit.h"
#include "server/settings/memory_limit.h"

namespace hulld::server {
namespace {

Limits WithMemoryLimit(Limits limits) {
  if (limits.memory_limit == 0) limits.memory_limit = DefaultMemoryLimit();
  return limits;
}

// The rest is for writers, whose hulls stay in memory where no store keeps them.
uint64_t ReadersShare(uint64_t memory_limit, const Store& store) {
  return memory_limit / (store.keeps_hulls() ? 2 : 4);
}

}  // namespace

Registry::Registry(Store& store, const Limits& limits, WorkerPool& writers,
                   std::optional<PoolMetrics> preparers, std::optional<PoolMetrics> loaders)
    : store_(store),
      limits_(WithMemoryLimit(limits)),
      writers_(writers),
      memory_(limits_.memory_limit, ReadersShare(limits_.memory_limit, store), mutex_),
      catalog_(store, limits_, memory_),
      feed_(mutex_, memory_, Config::kWatchMarkInterval),
      committer_(store, mutex_),
      preparer_(mutex_, catalog_, memory_, preparers),
      loaders_(std::in_place, std::max(1, DefaultThreads() - 1), loaders),
      freshness_(store, mutex_, catalog_, committer_),
      gate_(mutex_, catalog_, committer_, freshness_),
      records_(store, mutex_, catalog_, memory_, gate_, *loaders_),
      lister_(store, mutex_, catalog_, memory_, feed_, gate_, *loaders_),
      reader_(store, limits_, mutex_, catalog_, memory_, freshness_, records_, preparer_,
              *loaders_) {
  if (!store.is_shared()) return;
  committer_.SetOthers(
      [this](Locked& locked, const OtherChanges& others) { TakeOver(locked, others); },
      [this](Locked&, const OtherChanges& others) { return GrownHulls(others); });
}

Registry::~Registry() {
  store_.OnOthers(nullptr);
  {
    const std::lock_guard lock(mutex_);
    preparer_.Stop();
  }
  // Its thread takes over what other servers did, into what is closed here.
  committer_.End();
  preparer_.End();
  loaders_.reset();
  // Closed sessions may hold hulls for longer.
  const std::lock_guard lock(mutex_);
  for (const auto& [id, hull] : catalog_.hulls().entries()) {
    if (hull.awake() != nullptr) hull.awake()->account.Close();
  }
}

absl::Status Registry::Load() {
  Locked locked(mutex_);
  catalog_.Begin(store_.revision());
  feed_.Begin(catalog_.revision());
  absl::Status status;
  if (catalog_.is_cache()) {
    catalog_.SetTotals(store_.totals());
  } else {
    status = store_.ForEachHull([this](const std::string& id, absl::StatusOr<StoredHull> stored) {
      catalog_.AddStored(id, stored);
    });
  }
  if (catalog_.statistics().damaged > 0) {
    spdlog::error("{} of {} hulls are damaged", catalog_.statistics().damaged,
                  catalog_.hulls().size());
  }
  if (!status.ok()) return status;
  if (!catalog_.is_cache()) status = LoadBodies(locked);
  if (!status.ok() || !store_.is_shared()) return status;
  // What was read was not of one moment.
  const SteadyClock::time_point asked = SteadyClock::now();
  const absl::Status followed = store_.Follow();
  TakeOver(locked, store_.TakeOthers());
  if (followed.ok()) committer_.NoteCaughtUp(locked, asked);
  store_.OnOthers([this] { committer_.FollowSoon(); });
  return followed;
}

void Registry::Create(const std::string& id, bool if_absent, Reply<CreateResult> done) {
  freshness_.WhenFresh(done,
                       [=, this](Locked& locked) { CreateLocked(locked, id, if_absent, done); });
}

void Registry::CreateLocked(Locked& locked, const std::string& id, bool if_absent,
                            const Reply<CreateResult>& done) {
  if (!catalog_.IsKnown(id)) {
    return records_.WhenKnown(
        locked, id, done, [=, this](Locked& later) { CreateLocked(later, id, if_absent, done); });
  }
  if (BodyTable::Entry* const body = catalog_.BodyInFlight(id); body != nullptr) {
    body->waiting.push_back([=, this](Locked& later) { CreateLocked(later, id, if_absent, done); });
    return;
  }
  const HullPointer existing = catalog_.Find(id);
  if (existing == nullptr) {
    return CreateNew(locked, id, [=, this](Locked& later, const absl::StatusOr<HullPointer>& hull) {
      if (Committer::IsSuperseded(hull.status())) {
        return later.AfterwardsLocked(
            [=, this](Locked& again) { CreateLocked(again, id, if_absent, done); });
      }
      if (!hull.ok()) return Answer<CreateResult>(later, done, hull.status());
      Answer<CreateResult>(later, done,
                           CreateResult{catalog_.revision(), (*hull)->committed.record, true});
    });
  }
  if (existing->state.changing_life()) {
    existing->exclusive.push_back(
        [=, this](Locked& later) { CreateLocked(later, id, if_absent, done); });
  } else if (!if_absent) {
    Answer<CreateResult>(
        locked, done,
        WithReason(absl::AlreadyExistsError(absl::StrCat(
                       QuotedHull(id), " exists; delete it first, or set if_absent to use it")),
                   v1::ERROR_REASON_HULL_EXISTS, {{"hull_id", id}}));
  } else if (existing->state.damaged()) {
    Answer<CreateResult>(locked, done, existing->state.damage());
  } else {
    Answer<CreateResult>(locked, done,
                         CreateResult{catalog_.revision(), existing->committed.record, false});
  }
}

// There must be no such hull, which Insert checks.
void Registry::CreateNew(Locked& locked, const std::string& id,
                         const std::function<void(Locked&, absl::StatusOr<HullPointer>)>& done) {
  if (catalog_.bodies().contains(id)) return done(locked, BodyExists(id));
  if (absl::Status s = catalog_.CheckHullCount(); !s.ok()) return done(locked, s);
  Change change;
  change.begins = true;
  change.hull.record.hull_id = id;
  const HullPointer hull = catalog_.hulls().Insert(change.hull, HullState::Creating());
  catalog_.BeginCreatingHull();
  Submit(locked, hull, std::move(change),
         [this, hull, done](Locked& later, const absl::Status& status, const Change& creation) {
           catalog_.EndCreatingHull(status.ok());
           if (!status.ok()) {
             catalog_.Forget(later, hull, status);
             return done(later, status);
           }
           hull->SetStored(creation.hull);
           catalog_.Publish(hull->committed.record.revision);
           catalog_.NoteChange(*hull);
           feed_.NoteCreated(later, hull);
           done(later, hull);
         });
}

void Registry::Delete(const std::string& id, std::optional<uint64_t> if_revision,
                      Reply<uint64_t> done) {
  freshness_.WhenFresh(done,
                       [=, this](Locked& locked) { DeleteLocked(locked, id, if_revision, done); });
}

void Registry::DeleteLocked(Locked& locked, const std::string& id,
                            std::optional<uint64_t> if_revision, const Reply<uint64_t>& done) {
  if (!catalog_.IsKnown(id)) {
    return records_.WhenKnown(
        locked, id, done, [=, this](Locked& later) { DeleteLocked(later, id, if_revision, done); });
  }
  const HullPointer hull = catalog_.Find(id);
  if (hull == nullptr) return Answer<uint64_t>(locked, done, catalog_.NoSuchHull(id));
  if (!hull->state.quiet()) {
    hull->exclusive.push_back(
        [=, this](Locked& later) { DeleteLocked(later, id, if_revision, done); });
    return;
  }
  const StoredHull& committed = hull->committed;
  if (if_revision.has_value() && *if_revision != committed.record.revision) {
    return Answer<uint64_t>(locked, done, RevisionMismatch(committed.record, *if_revision));
  }
  Change change;
  change.hull = committed;
  change.deleted = true;
  change.former_layout = committed.layout;
  hull->state.StartEnding();
  Submit(locked, hull, std::move(change),
         [=, this](Locked& later, const absl::Status& status, const Change& deletion) {
           if (Committer::IsSuperseded(status)) {
             return later.AfterwardsLocked(
                 [=, this](Locked& again) { DeleteLocked(again, id, if_revision, done); });
           }
           if (!status.ok()) return Answer<uint64_t>(later, done, status);
           const uint64_t revision = deletion.revision;
           catalog_.Publish(revision);
           catalog_.NoteVertices(hull->committed.record.vertex_count, 0);
           catalog_.NoteHullEnded();
           catalog_.NoteChange(*hull);
           feed_.NoteDeleted(later, hull->committed.record, revision);
           catalog_.Forget(later, hull, Gone(hull->committed.record.hull_id, "deleted"));
           Answer<uint64_t>(later, done, revision);
         });
}

void Registry::Replace(Replacement replacement, Reply<ReplaceResult> done) {
  HULLD_CHECK(replacement.builder != nullptr);
  std::vector<Vector> vertices = replacement.builder->Vertices();
  if (store_.keeps_hulls()) replacement.vertices = vertices;
  replacement.live =
      std::make_shared<LiveHull>(std::move(vertices), replacement.builder->dimension());
  const auto shared = std::make_shared<Replacement>(std::move(replacement));
  freshness_.WhenFresh(done, [=, this](Locked& locked) { ReplaceLocked(locked, shared, done); });
}

void Registry::ReplaceLocked(Locked& locked, const std::shared_ptr<Replacement>& replacement,
                             const Reply<ReplaceResult>& done) {
  const std::string& id = replacement->hull_id;
  if (!catalog_.IsKnown(id)) {
    return records_.WhenKnown(
        locked, id, done, [=, this](Locked& later) { ReplaceLocked(later, replacement, done); });
  }
  if (BodyTable::Entry* const body = catalog_.BodyInFlight(id); body != nullptr) {
    body->waiting.push_back([=, this](Locked& later) { ReplaceLocked(later, replacement, done); });
    return;
  }
  const HullPointer former = catalog_.Find(id);
  if (former != nullptr && !former->state.quiet()) {
    former->exclusive.push_back(
        [=, this](Locked& later) { ReplaceLocked(later, replacement, done); });
    return;
  }
  if (absl::Status s = CheckReplacement(former.get(), *replacement); !s.ok()) {
    return Answer<ReplaceResult>(locked, done, s);
  }
  CommitReplacement(locked, former, replacement, done);
}

// Whether the rules allow it. former: null when there is none.
absl::Status Registry::CheckReplacement(const RegisteredHull* former,
                                        const Replacement& replacement) const {
  const std::string& id = replacement.hull_id;
  const std::optional<uint64_t>& if_revision = replacement.if_revision;
  if (former != nullptr) {
    if (!if_revision.has_value() || *if_revision == former->committed.record.revision) {
      return absl::OkStatus();
    }
    return RevisionMismatch(former->committed.record, *if_revision);
  }
  if (if_revision.value_or(0) != 0) {
    return WithReason(
        absl::AbortedError(absl::StrCat(QuotedHull(id), " does not exist, so it is not at ",
                                        "revision ", *if_revision, " (if_revision)")),
        v1::ERROR_REASON_REVISION_MISMATCH,
        {{"hull_id", id}, {"if_revision", *if_revision}, {"current_revision", uint64_t{0}}});
  }
  if (!replacement.create_if_absent) return catalog_.NoSuchHull(id);
  if (catalog_.bodies().contains(id)) return BodyExists(id);
  return catalog_.CheckHullCount();
}

// former: null when there is none. Takes the replacement's vertices.
Change Registry::MakeChange(const RegisteredHull* former, Replacement& replacement) {
  Change change;
  change.begins = true;
  HullRecord& record = change.hull.record;
  record.hull_id = replacement.hull_id;
  record.dimension = replacement.builder->dimension();
  record.vertex_count = replacement.builder->vertex_count();
  record.counts = replacement.counts;
  if (former != nullptr) change.replaced = former->committed;
  if (!replacement.vertices.empty()) {
    change.vertex_change = VertexChange::kReplaced;
    change.vertices = std::move(replacement.vertices);
    change.hull.layout.base_vertices = record.vertex_count;
  }
  return change;
}

// former: null when there is none, else quiet. Takes the replacement's builder and points.
void Registry::CommitReplacement(Locked& locked, const HullPointer& former,
                                 const std::shared_ptr<Replacement>& replacement,
                                 const Reply<ReplaceResult>& done) {
  Change change = MakeChange(former.get(), *replacement);
  HullPointer hull;
  if (former == nullptr) {
    hull = catalog_.hulls().Insert(change.hull, HullState::Creating());
    catalog_.BeginCreatingHull();
  } else {
    // Unknown to others until it takes the place of the former.
    hull = std::make_shared<RegisteredHull>(change.hull, HullState::Creating(),
                                            store_.keeps_hulls(), memory_);
    former->state.StartEnding();
  }
  hull->SetLive(std::move(replacement->live));
  hull->builder = std::make_unique<HullBuilder>(std::move(*replacement->builder));
  hull->builder_bytes = hull->builder->MemoryBytes();
  Submit(locked, former == nullptr ? hull : former, std::move(change),
         [=, this](Locked& later, const absl::Status& status, Change& replaced) {
           const bool again = Committer::IsSuperseded(status);
           if (again) TakeBack(*hull, replaced, *replacement);
           absl::StatusOr<ReplaceResult> result =
               FinishReplacement(later, former, hull, status, replaced);
           if (!again) return Answer(later, done, std::move(result));
           later.AfterwardsLocked(
               [=, this](Locked& once_more) { ReplaceLocked(once_more, replacement, done); });
         });
}

// The replacement is to be submitted again.
void Registry::TakeBack(RegisteredHull& hull, Change& change, Replacement& replacement) {
  *replacement.builder = std::move(*hull.builder);
  replacement.live = hull.live;
  if (change.vertex_change == VertexChange::kReplaced) {
    replacement.vertices = std::move(change.vertices);
  }
}

// hull: what takes the place of `former`, or of none, if the status allows.
absl::StatusOr<ReplaceResult> Registry::FinishReplacement(Locked& locked, const HullPointer& former,
                                                          const HullPointer& hull,
                                                          const absl::Status& status,
                                                          const Change& change) {
  if (status.ok()) hull->SetStored(change.hull);
  const HullRecord& record = hull->committed.record;
  if (former == nullptr) {
    catalog_.EndCreatingHull(status.ok());
    if (!status.ok()) catalog_.Forget(locked, hull, status);
  } else if (status.ok()) {
    hull->state.Commit();
    catalog_.NoteVertices(former->committed.record.vertex_count, 0);
    catalog_.Forget(locked, former, Gone(record.hull_id, "replaced"));
    catalog_.hulls().Insert(hull);
  }
  if (!status.ok()) return status;
  catalog_.NoteVertices(0, record.vertex_count);
  catalog_.Publish(record.revision);
  catalog_.NoteChange(*hull);
  if (former == nullptr) {
    feed_.NoteCreated(locked, hull);
  } else {
    feed_.NoteReplaced(locked, hull);
  }
  hull->NoteUse();
  memory_.Evict(locked);
  return ReplaceResult{catalog_.revision(), record, former == nullptr};
}

// Submits a change that follows all changes of its hull submitted before; `hull` is in the state
// that says so. finish: called after the step of the state, before what waits for the hull goes on.
void Registry::Submit(Locked& locked, const HullPointer& hull, Change change,
                      Committer::Completion finish) {
  HULLD_CHECK(hull->state.in_flight() > 0);
  const auto charge = std::make_shared<MemoryCharge>(memory_, MemoryUse::kWriting,
                                                     change.vertices.capacity() * sizeof(Vector));
  committer_.Submit(locked, std::move(change),
                    [this, hull, charge, finish = std::move(finish)](
                        Locked& later, const absl::Status& status, Change& committed) {
                      charge->Set(0);
                      if (status.ok()) {
                        hull->state.Commit();
                      } else {
                        hull->state.Refuse();
                      }
                      finish(later, status, committed);
                      // What other servers did comes first.
                      if (Committer::IsSuperseded(status)) return AdvanceLater(hull);
                      // One that has come to rest may be dropped.
                      if (hull->state.quiet() && !hull->state.gone()) {
                        hull->NoteUse();
                        memory_.Evict(later);
                      }
                      Advance(later, hull);
                      catalog_.hulls().RestSome();
                    });
}

// Lets whatever waits for the hull go on. Called after each step of its state.
void Registry::Advance(Locked& locked, const HullPointer& hull) {
  hull->changed.notify_all();
  while (hull->state.quiet() && !hull->exclusive.empty()) {
    const auto next = std::move(hull->exclusive.front());
    hull->exclusive.pop_front();
    next(locked);
  }
  if (hull->chunks.empty()) return;
  if (hull->state.gone() || hull->state.damaged()) {
    // Where a thread is at work, it comes here once it has ended.
    if (hull->state.work() != HullState::Work::kIdle) return;
    // Replies come on other threads than the one that asks.
    writers_.Submit([this, hull] { RefuseChunks(hull); }, hull->chunks.front().session.client);
    return;
  }
  if (!hull->state.can_schedule() || !hull->exclusive.empty()) return;
  const PendingChunk& next = hull->chunks.front();
  const bool repeated = next.chunk.sequence <= hull->HeadSequence(next.session.writer_id);
  // What such a chunk finds must be committed.
  if (hull->state.in_flight() > 0 && (repeated || next.chunk.if_revision.has_value())) return;
  hull->state.Schedule();
  writers_.Submit([this, hull] { RunNextChunk(hull); }, next.session.client);
}

absl::StatusOr<Resolved> Registry::Resolve(std::span<const std::string> ids,
                                           const std::function<bool()>& should_stop,
                                           const ReadPlan& plan) {
  KnownHulls known;
  return reader_.Refresh(ids, known, should_stop, plan);
}

absl::StatusOr<std::pair<AsOf, HullView>> Registry::Resolve(
    const std::string& id, const std::function<bool()>& should_stop, const Freshness& freshness) {
  absl::StatusOr<Resolved> resolved =
      Resolve(std::span(&id, 1), should_stop, {.freshness = freshness});
  if (!resolved.ok()) return resolved.status();
  absl::StatusOr<HullView>& hull = resolved->hulls.front();
  if (!hull.ok()) return hull.status();
  return std::pair(resolved->as_of(), *std::move(hull));
}

absl::StatusOr<HullPage> Registry::List(const std::string& prefix, const std::string& after,
                                        size_t page_size,
                                        const std::function<bool()>& should_stop) {
  if (catalog_.is_cache()) return lister_.ListHulls(prefix, after, page_size, should_stop);
  HullPage page;
  const std::lock_guard lock(mutex_);
  page.store_revision = catalog_.revision();
  const HullTable::Entries& all = catalog_.hulls().entries();
  auto next = after.empty() ? all.lower_bound(prefix) : all.upper_bound(after);
  for (; next != all.end() && next->first.starts_with(prefix); ++next) {
    if (!next->second.visible()) continue;
    if (page.hulls.size() == page_size) {
      page.more = true;
      break;
    }
    HullChange hull = next->second.Describe(next->first);
    page.hulls.push_back({std::move(hull.record), hull.damaged});
  }
  return page;
}

HoldStatistics Registry::Holds() const {
  const std::lock_guard lock(mutex_);
  return mutex_.Statistics();
}

RegistrySizes Registry::Sizes() const {
  const std::lock_guard lock(mutex_);
  return catalog_.Sizes();
}

CacheStatistics Registry::Cache() const {
  const std::lock_guard lock(mutex_);
  const MemoryStatistics memory = memory_.Statistics();
  CacheStatistics cache = catalog_.statistics();
  cache.bytes = memory.bytes;
  cache.reading_bytes = memory.reading;
  cache.writing_bytes = memory.writing;
  cache.limit_bytes = memory.limit_bytes;
  cache.evictions = memory.evictions;
  return cache;
}

absl::Status Registry::CheckMemory(MemoryUse use) {
  Locked locked(mutex_);
  return memory_.Check(locked, use);
}

}  // namespace hulld::server
