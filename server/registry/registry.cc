#include "server/registry/registry.h"

#include <absl/status/status.h>
#include <absl/strings/str_cat.h>
#include <spdlog/spdlog.h>

#include <utility>

#include "server/contract/error_info.h"
#include "server/contract/limit_error.h"
#include "server/contract/status_map.h"
#include "server/registry/registered_hull.h"
#include "server/settings/memory_limit.h"

namespace hulld::server {

std::string QuotedHull(const std::string& id) { return absl::StrCat("hull \"", id, "\""); }

absl::Status HullNotFound(const std::string& id) {
  return WithReason(
      absl::NotFoundError(absl::StrCat(QuotedHull(id), " not found; create it first")),
      v1::ERROR_REASON_HULL_NOT_FOUND, {{"hull_id", id}});
}

absl::Status RevisionMismatch(const HullRecord& record, uint64_t if_revision) {
  return WithReason(absl::AbortedError(absl::StrCat(QuotedHull(record.hull_id), " is at revision ",
                                                    record.revision, ", not ", if_revision,
                                                    " (if_revision); read it again, then retry")),
                    v1::ERROR_REASON_REVISION_MISMATCH,
                    {{"hull_id", record.hull_id},
                     {"if_revision", if_revision},
                     {"current_revision", record.revision}});
}

namespace {

Limits WithMemoryLimit(Limits limits) {
  if (limits.memory_limit == 0) limits.memory_limit = DefaultMemoryLimit();
  return limits;
}

absl::Status Gone(const std::string& id, const char* how) {
  return WithReason(
      absl::FailedPreconditionError(absl::StrCat(
          QuotedHull(id), " was ", how,
          " while points were streamed into it; open the stream again and start anew")),
      v1::ERROR_REASON_HULL_GONE, {{"hull_id", id}});
}

}  // namespace

Registry::Registry(Store& store, const Limits& limits, WorkerPool& writers)
    : store_(store), limits_(WithMemoryLimit(limits)), writers_(writers) {
  cache_.limit_bytes = limits_.memory_limit;
  committer_ = std::thread([this] { CommitQueued(); });
}

Registry::~Registry() {
  {
    const std::lock_guard lock(mutex_);
    ending_ = true;
  }
  commit_ready_.notify_all();
  committer_.join();
}

absl::Status Registry::Load() {
  Locked locked(mutex_);
  revision_ = assigned_revision_ = store_.revision();
  uint64_t damaged = 0;
  const absl::Status status =
      store_.ForEachHull([&](const std::string& id, absl::StatusOr<StoredHull> stored) {
        if (stored.ok()) {
          Insert(*stored);
          return;
        }
        ++damaged;
        spdlog::error("{}", std::string(stored.status().message()));
        StoredHull nothing;
        nothing.record.hull_id = id;
        Insert(nothing)->damage = stored.status();
        ++cache_.damaged;
      });
  if (damaged > 0) spdlog::error("{} of {} hulls are damaged", damaged, hulls_.size());
  return status;
}

Registry::HullPointer Registry::Find(const std::string& id) const {
  const auto found = hulls_.find(id);
  return found == hulls_.end() ? nullptr : found->second;
}

Registry::HullPointer Registry::FindVisible(const std::string& id) const {
  HullPointer hull = Find(id);
  return hull != nullptr && hull->state == RegisteredHull::State::kPresent ? hull : nullptr;
}

Registry::HullPointer Registry::Insert(const StoredHull& stored) {
  auto hull = std::make_shared<RegisteredHull>();
  hull->committed = hull->head = stored;
  if (stored.record.vertex_count == 0) hull->snapshot = empty_snapshot_;
  vertex_count_ += stored.record.vertex_count;
  hulls_[stored.record.hull_id] = hull;
  return hull;
}

// Takes a hull out of sight.
void Registry::Forget(Locked& locked, const HullPointer& hull, const absl::Status& reason) {
  hull->state = RegisteredHull::State::kGone;
  vertex_count_ -= hull->committed.record.vertex_count;
  hull->released.notify_all();
  const auto found = hulls_.find(hull->committed.record.hull_id);
  if (found != hulls_.end() && found->second == hull) hulls_.erase(found);
  for (auto& [number, on_gone] : hull->watches) {
    locked.Afterwards([on_gone = std::move(on_gone), reason] { on_gone(reason); });
  }
  hull->watches.clear();
  if (!hull->busy) locked.Discard(std::move(hull->builder));
  locked.Discard(std::move(hull->snapshot));
  hull->snapshot = nullptr;
  Charge(locked, *hull);
}

void Registry::Create(const std::string& id, bool if_absent, Reply<CreateResult> done) {
  Locked locked(mutex_);
  CreateLocked(locked, id, if_absent, done);
}

void Registry::CreateLocked(Locked& locked, const std::string& id, bool if_absent,
                            const Reply<CreateResult>& done) {
  const HullPointer existing = Find(id);
  if (existing != nullptr && existing->ending) {
    existing->exclusive.push_back(
        [=, this](Locked& later) { CreateLocked(later, id, if_absent, done); });
    return;
  }
  if (existing != nullptr) {
    absl::StatusOr<CreateResult> result =
        CreateResult{revision_, existing->committed.record, false};
    if (!if_absent) {
      result =
          WithReason(absl::AlreadyExistsError(absl::StrCat(
                         QuotedHull(id), " exists; delete it first, or set if_absent to use it")),
                     v1::ERROR_REASON_HULL_EXISTS, {{"hull_id", id}});
    } else if (!existing->damage.ok()) {
      result = existing->damage;
    }
    locked.Afterwards([done, result] { done(result); });
    return;
  }
  CreateNew(locked, id, [this, id, done](Locked& later, const absl::Status& status) {
    absl::StatusOr<CreateResult> result = ErrorOrEmpty<CreateResult>(status);
    if (status.ok()) result = CreateResult{revision_, Find(id)->committed.record, true};
    later.Afterwards([done, result] { done(result); });
  });
}

// Requires that there is no such hull.
void Registry::CreateNew(Locked& locked, const std::string& id,
                         const std::function<void(Locked&, const absl::Status&)>& done) {
  if (hulls_.size() >= limits_.max_hulls) {
    return done(locked, LimitExceeded(absl::StrCat("the store holds ", hulls_.size(), " hulls"),
                                      limits_.max_hulls, "max-hulls"));
  }
  Change change;
  change.revision = ++assigned_revision_;
  change.hull.record.hull_id = id;
  change.hull.record.create_revision = change.hull.record.revision = change.revision;
  const HullPointer hull = Insert(change.hull);
  hull->state = RegisteredHull::State::kCreating;
  hull->ending = true;
  ++creating_;
  Submit(hull, std::move(change), [this, hull, done](Locked& later, const absl::Status& status) {
    --creating_;
    hull->ending = false;
    if (status.ok()) {
      hull->state = RegisteredHull::State::kPresent;
      revision_ = hull->committed.record.revision;
    } else {
      Forget(later, hull, status);
    }
    done(later, status);
  });
}

void Registry::Delete(const std::string& id, std::optional<uint64_t> if_revision,
                      Reply<uint64_t> done) {
  Locked locked(mutex_);
  DeleteLocked(locked, id, if_revision, done);
}

void Registry::DeleteLocked(Locked& locked, const std::string& id,
                            std::optional<uint64_t> if_revision, const Reply<uint64_t>& done) {
  const HullPointer hull = Find(id);
  absl::Status refusal;
  if (hull == nullptr) {
    refusal = HullNotFound(id);
  } else if (!hull->quiet()) {
    hull->exclusive.push_back(
        [=, this](Locked& later) { DeleteLocked(later, id, if_revision, done); });
    return;
  } else if (if_revision.has_value() && *if_revision != hull->committed.record.revision) {
    refusal = RevisionMismatch(hull->committed.record, *if_revision);
  }
  if (!refusal.ok()) {
    locked.Afterwards([done, refusal] { done(refusal); });
    return;
  }
  Change change;
  change.hull = hull->committed;
  change.revision = ++assigned_revision_;
  change.deleted = true;
  change.former_layout = hull->committed.layout;
  hull->ending = true;
  Submit(
      hull, std::move(change),
      [this, hull, done, revision = assigned_revision_](Locked& later, const absl::Status& status) {
        hull->ending = false;
        absl::StatusOr<uint64_t> result = ErrorOrEmpty<uint64_t>(status);
        if (status.ok()) {
          result = revision_ = revision;
          Forget(later, hull, Gone(hull->committed.record.hull_id, "deleted"));
        }
        later.Afterwards([done, result] { done(result); });
      });
}

void Registry::Replace(Replacement replacement, Reply<ReplaceResult> done) {
  if (store_.keeps_hulls()) replacement.vertices = replacement.builder->Vertices();
  const auto shared = std::make_shared<Replacement>(std::move(replacement));
  Locked locked(mutex_);
  ReplaceLocked(locked, shared, done);
}

void Registry::ReplaceLocked(Locked& locked, const std::shared_ptr<Replacement>& replacement,
                             const Reply<ReplaceResult>& done) {
  const std::string& id = replacement->hull_id;
  const std::optional<uint64_t>& if_revision = replacement->if_revision;
  const HullPointer former = Find(id);
  absl::Status refusal;
  if (former == nullptr) {
    if (if_revision.value_or(0) != 0) {
      refusal = WithReason(
          absl::AbortedError(absl::StrCat(QuotedHull(id), " does not exist, so it is not at ",
                                          "revision ", *if_revision, " (if_revision)")),
          v1::ERROR_REASON_REVISION_MISMATCH,
          {{"hull_id", id}, {"if_revision", *if_revision}, {"current_revision", uint64_t{0}}});
    } else if (!replacement->create_if_absent) {
      refusal = HullNotFound(id);
    } else if (hulls_.size() >= limits_.max_hulls) {
      refusal = LimitExceeded(absl::StrCat("the store holds ", hulls_.size(), " hulls"),
                              limits_.max_hulls, "max-hulls");
    }
  } else if (!former->quiet()) {
    former->exclusive.push_back(
        [=, this](Locked& later) { ReplaceLocked(later, replacement, done); });
    return;
  } else if (if_revision.has_value() && *if_revision != former->committed.record.revision) {
    refusal = RevisionMismatch(former->committed.record, *if_revision);
  }
  if (!refusal.ok()) {
    locked.Afterwards([done, refusal] { done(refusal); });
    return;
  }
  CommitReplacement(former, *replacement, done);
}

// Requires that the mutex is held. former: null when there is none.
void Registry::CommitReplacement(const HullPointer& former, Replacement& replacement,
                                 const Reply<ReplaceResult>& done) {
  Change change;
  change.revision = ++assigned_revision_;
  HullRecord& record = change.hull.record;
  record.hull_id = replacement.hull_id;
  record.create_revision = record.revision = change.revision;
  record.dimension = replacement.builder->dimension();
  record.vertex_count = replacement.builder->vertex_count();
  record.counts = replacement.counts;
  if (former != nullptr) change.replaced = former->committed;
  if (!replacement.vertices.empty()) {
    change.vertex_change = VertexChange::kReplaced;
    change.vertices = std::move(replacement.vertices);
    change.hull.layout = {record.revision, record.vertex_count, 0, 0};
  }
  // The new incarnation is unknown to others until it takes the place of the former.
  auto hull = std::make_shared<RegisteredHull>();
  hull->committed = hull->head = change.hull;
  hull->builder = std::make_unique<HullBuilder>(std::move(*replacement.builder));
  hull->builder_bytes = hull->builder->MemoryBytes();
  if (record.vertex_count == 0) hull->snapshot = empty_snapshot_;
  if (former == nullptr) {
    hull->state = RegisteredHull::State::kCreating;
    hull->ending = true;
    hulls_[record.hull_id] = hull;
    ++creating_;
  } else {
    former->ending = true;
  }
  Submit(former == nullptr ? hull : former, std::move(change),
         [this, hull, former, done](Locked& later, const absl::Status& status) {
           FinishReplacement(later, former, hull, status, done);
         });
}

// hull: what takes the place of `former`, or of none, if the status allows.
void Registry::FinishReplacement(Locked& locked, const HullPointer& former, const HullPointer& hull,
                                 const absl::Status& status, const Reply<ReplaceResult>& done) {
  absl::StatusOr<ReplaceResult> result = ErrorOrEmpty<ReplaceResult>(status);
  const std::string id = hull->committed.record.hull_id;
  if (former == nullptr) --creating_;
  (former == nullptr ? hull : former)->ending = false;
  if (status.ok()) {
    if (former != nullptr) Forget(locked, former, Gone(id, "replaced"));
    hull->state = RegisteredHull::State::kPresent;
    hulls_[id] = hull;
    vertex_count_ += hull->committed.record.vertex_count;
    revision_ = hull->committed.record.revision;
    Charge(locked, *hull);
    Evict(locked);
    result = ReplaceResult{revision_, hull->committed.record, former == nullptr};
  } else if (former == nullptr) {
    vertex_count_ += hull->committed.record.vertex_count;
    Forget(locked, hull, status);
  }
  locked.Afterwards([done, result] { done(result); });
}

HullPage Registry::List(const std::string& prefix, const std::string& after,
                        size_t page_size) const {
  HullPage page;
  const std::lock_guard lock(mutex_);
  page.store_revision = revision_;
  auto next = after.empty() ? hulls_.lower_bound(prefix) : hulls_.upper_bound(after);
  for (; next != hulls_.end() && next->first.starts_with(prefix); ++next) {
    const RegisteredHull& hull = *next->second;
    if (hull.state != RegisteredHull::State::kPresent) continue;
    if (page.hulls.size() == page_size) {
      page.more = true;
      break;
    }
    page.hulls.push_back({hull.committed.record, !hull.damage.ok()});
  }
  return page;
}

RegistrySizes Registry::Sizes() const {
  const std::lock_guard lock(mutex_);
  return {revision_, hulls_.size() - creating_, vertex_count_};
}

CacheStatistics Registry::Cache() const {
  const std::lock_guard lock(mutex_);
  return cache_;
}

CommitStatistics Registry::Commits() const {
  const std::lock_guard lock(mutex_);
  CommitStatistics commits = commits_;
  commits.failing = store_failed_;
  return commits;
}

}  // namespace hulld::server
