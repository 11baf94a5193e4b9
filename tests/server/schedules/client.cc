#include "tests/server/schedules/client.h"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <array>
#include <utility>

#include "core/hull/hull.h"

namespace hulld::server {
namespace {

using State = Ledger::State;

std::string Text(const HullRecord& record) {
  return absl::StrCat("hull of ", record.create_revision, " at ", record.revision, " with ",
                      record.vertex_count, " vertices of ", record.counts.received, " points");
}

}  // namespace

void Client::Run() {
  const Plan& plan = simulation_.plan;
  using Method = void (Client::*)();
  const std::array<std::pair<uint32_t, Method>, 8> methods = {
      {{plan.creations, &Client::Create},
       {plan.deletions, &Client::Delete},
       {plan.replacements, &Client::Replace},
       {plan.streams, &Client::AppendStream},
       {plan.reads, &Client::Read},
       {plan.listings, &Client::List},
       {plan.bodies, &Client::UseBodies},
       {plan.pressure, &Client::Press}}};
  uint32_t total = 0;
  for (const auto& [weight, method] : methods) total += weight;
  for (uint32_t calls = 1 + random().Below(kMaxCalls); calls > 0; --calls) {
    uint32_t chosen = random().Below(total);
    for (const auto& [weight, method] : methods) {
      if (chosen < weight) {
        (this->*method)();
        break;
      }
      chosen -= weight;
    }
  }
}

Client::Call Client::Begin(size_t hull) {
  Call call;
  call.hull = hull;
  call.since = ledger().Now();
  call.failures_before = simulation_.store.answered_failures();
  return call;
}

// Empty if the call cannot be stopped.
std::function<bool()> Client::StopOf(const Call& call) {
  if (!random().OneIn(simulation_.plan.cancellations)) return {};
  // Some are stopped from the beginning.
  const uint32_t rarity = 1 + 2 * random().Below(2);
  return [this, rarity, stopped = call.was_stopped] {
    *stopped = *stopped || random().OneIn(rarity);
    return *stopped;
  };
}

std::optional<uint64_t> Client::AnyCondition(size_t hull) {
  if (!random().OneIn(simulation_.plan.conditions)) return std::nullopt;
  if (random().OneIn(4)) return 0;
  return ledger().At(hull, ledger().Now().states[hull]).record.revision;
}

void Client::Fail(const Call& call, const std::string& what) {
  Scheduler::Current().Fail(absl::StrCat(what, "\nthe call began at state ",
                                         call.since.states[call.hull], ", revision ",
                                         call.since.revision, "; ", ledger().Describe(call.hull)));
}

bool Client::MayFail(const Call& call, const absl::Status& status, bool may_be_stopped) {
  const Plan& plan = simulation_.plan;
  const SimulatedStore& store = simulation_.store;
  Reached& reached = simulation_.reached;
  switch (status.code()) {
    case absl::StatusCode::kUnavailable:
      ++reached.refused;
      return store.failed() > call.failures_before;
    case absl::StatusCode::kResourceExhausted:
      ++reached.overloaded;
      return store.was_full() || !plan.has_memory || plan.pressure > 0;
    case absl::StatusCode::kDataLoss:
      ++reached.damaged;
      return store.has_damage();
    case absl::StatusCode::kCancelled:
      ++reached.cancelled;
      return may_be_stopped && *call.was_stopped;
    default:
      return false;
  }
}

void Client::CheckNotFound(const Call& call) {
  if (ledger().Find(call.hull, call.since, [](const State& state) { return !state.exists; })) {
    return;
  }
  Fail(call, "a hull is reported as not found, but it existed throughout the call");
}

void Client::CheckAborted(const Call& call) {
  ++simulation_.reached.aborted;
  const auto differs = [&](const State& state) {
    return state.exists ? state.record.revision != *call.if_revision : *call.if_revision != 0;
  };
  if (call.if_revision.has_value() && ledger().Find(call.hull, call.since, differs)) return;
  Fail(call, "a condition is reported as failed, but it was met throughout the call");
}

void Client::Claim(const Call& call, std::optional<size_t> state, const std::string& what) {
  if (!state.has_value()) Fail(call, absl::StrCat(what, ", but the store has no such change"));
  if (!ledger().Claim(call.hull, *state)) {
    Fail(call, absl::StrCat(what, ", but another call made that change"));
  }
  ledger().Report(call.hull, *state);
  if (!call.if_revision.has_value()) return;
  const State& before = ledger().At(call.hull, *state - 1);
  if (*call.if_revision != (before.exists ? before.record.revision : 0)) {
    Fail(call,
         absl::StrCat(what, " under the condition ", *call.if_revision, ", which was not met"));
  }
}

void Client::Create() {
  const bool if_absent = random().OneIn(2);
  const Call call = Begin(AnyHull());
  Scheduler::Current().Note("creates hull", call.hull, if_absent ? 1 : 0);
  const auto check = [&](const absl::StatusOr<PutHullResult>& result) {
    if (!result.ok()) {
      const auto exists = [](const State& state) { return state.exists; };
      const bool may_exist = absl::IsAlreadyExists(result.status()) && !if_absent &&
                             ledger().Find(call.hull, call.since, exists);
      if (MayBeOther(call, result.status(), true)) return;
      if (may_exist || MayFail(call, result.status(), false)) return;
      Fail(call, absl::StrCat("unexpected error: ", result.status().ToString()));
    }
    const auto is_it = [&](const State& state) {
      return state.exists && state.record == result->hull;
    };
    const auto state = ledger().Find(call.hull, call.since, is_it);
    if (result->created) return Claim(call, state, absl::StrCat("created ", Text(result->hull)));
    if (!state.has_value()) Fail(call, absl::StrCat("no state matches ", Text(result->hull)));
    ledger().Report(call.hull, *state);
  };
  Await<PutHullResult>(
      [&](const Reply<PutHullResult>& done) {
        simulation_.registry.changes().Create(HullName(call.hull), if_absent, done);
      },
      check);
}

void Client::Delete() {
  Call call = Begin(AnyHull());
  call.if_revision = AnyCondition(call.hull);
  Scheduler::Current().Note("deletes hull", call.hull, call.if_revision.value_or(0));
  const auto check = [&](const absl::StatusOr<uint64_t>& result) {
    if (absl::IsNotFound(result.status())) return CheckNotFound(call);
    if (absl::IsAborted(result.status())) return CheckAborted(call);
    if (!result.ok()) {
      if (MayFail(call, result.status(), false)) return;
      Fail(call, absl::StrCat("unexpected error: ", result.status().ToString()));
    }
    const auto is_it = [&](const State& state) {
      return !state.exists && state.revision == *result;
    };
    Claim(call, ledger().Find(call.hull, call.since, is_it), absl::StrCat("deleted at ", *result));
  };
  Await<uint64_t>(
      [&](const Reply<uint64_t>& done) {
        simulation_.registry.changes().Delete("hull", HullName(call.hull), call.if_revision, done);
      },
      check);
}

void Client::Replace() {
  Call call = Begin(AnyHull());
  call.if_revision = AnyCondition(call.hull);
  const auto points = static_cast<CurveSet>(random().Next()) & 0x1E;
  Replacement replacement;
  replacement.hull_id = HullName(call.hull);
  replacement.if_revision = call.if_revision;
  replacement.create_if_absent = random().OneIn(2);
  replacement.builder = std::make_shared<HullBuilder>();
  replacement.counts = *replacement.builder->Add(PointsOf(points));
  const bool creates = replacement.create_if_absent;
  Scheduler::Current().Note("replaces hull", call.hull, points, call.if_revision.value_or(0));
  const auto check = [&](const absl::StatusOr<PutHullResult>& result) {
    if (absl::IsNotFound(result.status()) && !creates) return CheckNotFound(call);
    if (absl::IsAborted(result.status())) return CheckAborted(call);
    if (creates && MayBeOther(call, result.status(), true)) return;
    if (!result.ok()) {
      if (MayFail(call, result.status(), false)) return;
      Fail(call, absl::StrCat("unexpected error: ", result.status().ToString()));
    }
    const auto is_it = [&](const State& state) {
      return state.exists && state.record == result->hull && state.points == points;
    };
    const auto state = ledger().Find(call.hull, call.since, is_it);
    Claim(call, state, absl::StrCat("replaced by ", Text(result->hull)));
    if (result->created == ledger().At(call.hull, *state - 1).exists) {
      Fail(call, "a replacement reports incorrectly whether a hull existed");
    }
  };
  Await<PutHullResult>(
      [&](const Reply<PutHullResult>& done) {
        simulation_.registry.changes().Replace(std::move(replacement), done);
      },
      check);
}

void Client::List() {
  Call call = Begin(0);
  Scheduler::Current().Note("lists hulls");
  if (const absl::Status fresh = simulation_.registry.peers().AwaitPeers({}); !fresh.ok()) {
    if (MayFail(call, fresh, false)) return;
    Fail(call, absl::StrCat("unexpected error: ", fresh.ToString()));
  }
  const absl::StatusOr<RecordPage> listed_page =
      simulation_.registry.records().List("", "", kHulls);
  if (!listed_page.ok()) {
    if (MayFail(call, listed_page.status(), false)) return;
    Fail(call, absl::StrCat("unexpected error: ", listed_page.status().ToString()));
  }
  const RecordPage& page = *listed_page;
  for (call.hull = 0; call.hull < kHulls; ++call.hull) {
    const auto listed = std::ranges::find_if(page.entries, [&](const HullChange& hull) {
      return hull.record.hull_id == HullName(call.hull);
    });
    const bool is_there = listed != page.entries.end();
    const auto is_it = [&](const State& state) {
      return state.exists == is_there && (!is_there || state.record == listed->record);
    };
    const auto state = ledger().FindAt(call.hull, call.since, page.store_revision, is_it);
    if (!state.has_value()) {
      Fail(call, absl::StrCat("the list of revision ", page.store_revision, " is wrong"));
    }
    ledger().Report(call.hull, *state);
  }
  ledger().ReportRevision(page.store_revision);
  ++simulation_.reached.answers;
}

// Waits for freshness as a call without a thread does. Returns true if the registry reported it.
bool Client::AwaitFresh(const Freshness& freshness) {
  const auto notified = std::make_shared<Event>();
  const auto fresh = std::make_shared<absl::Status>();
  PeerSync& peers = simulation_.registry.peers();
  if (peers.TryFresh(freshness).has_value()) return false;
  peers.StartFetch([=](const absl::Status& status) {
    if (notified->is_set()) Scheduler::Current().Fail("a reader is notified twice");
    *fresh = status;
    notified->Set();
  });
  notified->Wait();
  return fresh->ok();
}

// Reads all hulls, or one, in one of the three ways.
void Client::Read() {
  const Plan& plan = simulation_.plan;
  std::vector<std::string> ids;
  for (size_t hull = 0; hull < plan.hulls; ++hull) ids.push_back(HullName(hull));
  const uint32_t way = random().Below(4);
  if (way == 0) ids = {HullName(AnyHull())};
  ReadPlan read_plan;
  if (random().OneIn(plan.preparations)) read_plan = {1'000'000, random().OneIn(2)};
  Call call = Begin(0);
  const std::function<bool()> stop = StopOf(call);
  Scheduler::Current().Note("reads hulls in way", way, ids.size());
  absl::StatusOr<Resolved> resolved = absl::UnknownError("");
  if (way == 1) {
    read_plan.freshness.began = SteadyClock::now();
    read_plan.may_wait = false;
    resolved = simulation_.registry.Resolve(ids, {}, read_plan);
    if (!resolved.ok() && AwaitFresh(read_plan.freshness)) {
      resolved = simulation_.registry.Resolve(ids, {}, read_plan);
    }
    if (!resolved.ok()) return;
  } else if (way == 2) {
    resolved = simulation_.registry.reader().Refresh(ids, known_, stop, read_plan);
  } else {
    resolved = simulation_.registry.Resolve(ids, stop, read_plan);
  }
  ++simulation_.reached.answers;
  if (!resolved.ok()) {
    if (MayFail(call, resolved.status(), true)) return;
    Fail(call, absl::StrCat("unexpected error: ", resolved.status().ToString()));
  }
  for (size_t i = 0; i < ids.size(); ++i) {
    call.hull = static_cast<size_t>(ids[i][0] - 'a');
    CheckView(call, resolved->as_of.revision, resolved->hulls[i]);
  }
  ledger().ReportRevision(resolved->as_of.revision);
  const absl::StatusOr<HullView>& view = resolved->hulls.back();
  if (view.ok() && random().OneIn(2)) MakeCanonical(call, *view);
}

void Client::CheckView(const Call& call, uint64_t revision, const absl::StatusOr<HullView>& view) {
  if (revision < call.since.revision || revision > ledger().revision()) {
    Fail(call, absl::StrCat("an answer has revision ", revision));
  }
  const bool is_there = view.ok();
  if (!is_there && !absl::IsNotFound(view.status())) {
    if (MayFail(call, view.status(), true)) return;
    Fail(call, absl::StrCat("unexpected error: ", view.status().ToString()));
  }
  const auto is_it = [&](const State& state) {
    return state.exists == is_there && (!is_there || state.record == view->record);
  };
  const auto state = ledger().FindAt(call.hull, call.since, revision, is_it);
  if (!state.has_value()) {
    Fail(call, absl::StrCat("at revision ", revision, " a reader receives ",
                            is_there ? Text(view->record) : "no hull"));
  }
  ledger().Report(call.hull, *state);
  if (is_there) CheckServed(call, ledger().At(call.hull, *state), *view);
  ++simulation_.reached.reads;
}

// The points are those of the record, regardless of later changes.
void Client::CheckServed(const Call& call, const State& state, const HullView& view) {
  const ServedHull& served = *view.served;
  if (served.empty() != (state.points == 0))
    Fail(call, "a reader receives points of an empty hull, or none of a nonempty hull");
  if (served.empty()) return;
  const QueryHull& version = served.query_hull();
  CurveSet points = 0;
  bool is_right = version.dimension() == state.record.dimension;
  for (uint32_t i = 0; i < version.point_count(); ++i) {
    is_right = AddPoint(version.point(i), points) && is_right;
  }
  if (!is_right || points != state.points) {
    Fail(call, absl::StrCat("a reader receives points ", absl::Hex(points), " for ",
                            Ledger::Describe(state)));
  }
  const std::vector<Vector> expected = PointsOf(points);
  if (served.low() != expected.front() || served.high() != expected.back()) {
    Fail(call, "a reader receives a box that does not match the points");
  }
}

void Client::MakeCanonical(const Call& before, const HullView& view) {
  Call call = Begin(before.hull);
  const std::function<bool()> stop = StopOf(call);
  Scheduler::Current().Note("creates a snapshot of hull", call.hull, view.record.revision);
  const absl::StatusOr<const Hull*> made = simulation_.registry.reader().Canonical(view, stop);
  if (!made.ok()) {
    if (MayFail(call, made.status(), true)) return;
    Fail(call, absl::StrCat("unexpected error: ", made.status().ToString()));
  }
  const std::optional<CurveSet> points = SetOf((*made)->vertices());
  const bool is_right =
      points.has_value() && (*made)->vertices().size() == view.record.vertex_count;
  if (!is_right) Fail(call, "the vertices of a snapshot do not match its record");
  ++simulation_.reached.snapshots;
}

// Evicts everything unused; calls that need more memory concurrently are refused.
void Client::Press() {
  const bool reads = random().OneIn(2);
  Scheduler::Current().Note("fills the memory");
  const MemoryCharge charge(simulation_.registry.memory(),
                            reads ? MemoryUse::kReading : MemoryUse::kWriting,
                            simulation_.plan.memory_limit + 1);
  simulation_.registry.CheckMemory(reads ? MemoryUse::kWriting : MemoryUse::kReading).IgnoreError();
  Scheduler::Current().Note("releases the memory");
}

void Client::CheckAll() {
  for (size_t hull = 0; hull < kHulls; ++hull) {
    ledger().Report(hull, ledger().size(hull) - 1);
    Call call = Begin(hull);
    const std::vector<std::string> ids = {HullName(hull)};
    const absl::StatusOr<Resolved> resolved = simulation_.registry.Resolve(ids, {});
    // Memory may be too small for the hull, and points may be damaged.
    if (resolved.ok()) {
      CheckView(call, resolved->as_of.revision, resolved->hulls[0]);
    } else if (!MayFail(call, resolved.status(), false)) {
      Fail(call, absl::StrCat("unexpected error: ", resolved.status().ToString()));
    }
    CheckSequences(hull);
  }
  List();
}

}  // namespace hulld::server
