// Calls about bodies; they share IDs with hulls.
#include <absl/strings/str_cat.h>

#include <algorithm>
#include <utility>

#include "tests/server/schedules/client.h"

namespace hulld::server {
namespace {

using State = Ledger::State;

bool IsOf(const State& state, const HullChange& body) {
  return state.is_body && state.record.create_revision == body.record.create_revision &&
         state.record.revision == body.record.revision;
}

}  // namespace

bool Client::MayBeOther(const Call& call, const absl::Status& status, bool is_body) {
  const auto is_other = [is_body](const State& state) {
    return is_body ? state.is_body : state.exists;
  };
  if (!absl::IsAlreadyExists(status) || !ledger().Find(call.hull, call.since, is_other)) {
    return false;
  }
  ++simulation_.reached.kinds_refused;
  return true;
}

void Client::UseBodies() {
  switch (random().Below(5)) {
    case 0:
    case 1:
      return PutBody();
    case 2:
      return DeleteBody();
    case 3:
      return FindBodies();
    default:
      return ListBodies();
  }
}

void Client::PutBody() {
  Call call = Begin(AnyHull());
  call.if_revision = AnyCondition(call.hull);
  StoredBody body;
  body.record.body_id = HullName(call.hull);
  body.hull_ids = {"piece"};
  if (simulation_.plan.has_collision_watch && !random().OneIn(4)) {
    body.hull_ids = {HullName(1 - call.hull)};
  }
  body.pieces.resize(1);
  Scheduler::Current().Note("puts body", call.hull, call.if_revision.value_or(0));
  const auto check = [&](const absl::StatusOr<PutBodyResult>& result) {
    if (absl::IsAborted(result.status())) {
      const auto differs = [&](const State& state) {
        return !state.exists && *call.if_revision != (state.is_body ? state.record.revision : 0);
      };
      if (call.if_revision.has_value() && ledger().Find(call.hull, call.since, differs)) return;
      Fail(call, "a condition on a body is reported as failed, but it was met throughout the call");
    }
    if (!result.ok()) {
      if (MayBeOther(call, result.status(), false)) return;
      if (MayFail(call, result.status(), false)) return;
      Fail(call, absl::StrCat("unexpected error: ", result.status().ToString()));
    }
    const auto state = ledger().Find(call.hull, call.since,
                                     [&](const State& one) { return IsOf(one, result->body); });
    const std::string what = absl::StrCat("put a body at ", result->body.record.revision);
    if (!state.has_value()) Fail(call, absl::StrCat(what, ", but the store has no such body"));
    if (!ledger().Claim(call.hull, *state))
      Fail(call, absl::StrCat(what, ", but another call made that change"));
    ledger().Report(call.hull, *state);
    const State& before = ledger().At(call.hull, *state - 1);
    if (result->created == before.is_body)
      Fail(call, "a put reports incorrectly whether a body existed");
    const uint64_t revision = before.is_body ? before.record.revision : 0;
    if (call.if_revision.value_or(revision) != revision) {
      Fail(call, absl::StrCat(what, " under a condition that was not met"));
    }
    ++simulation_.reached.bodies_put;
  };
  Await<PutBodyResult>(
      [&](const Reply<PutBodyResult>& done) {
        simulation_.registry.changes().PutBody(std::move(body), call.if_revision, done);
      },
      check);
}

void Client::DeleteBody() {
  const Call call = Begin(AnyHull());
  Scheduler::Current().Note("deletes body", call.hull);
  const auto check = [&](const absl::StatusOr<uint64_t>& result) {
    if (absl::IsNotFound(result.status())) return CheckBody(call, std::nullopt, std::nullopt);
    if (!result.ok()) {
      if (MayFail(call, result.status(), false)) return;
      Fail(call, absl::StrCat("unexpected error: ", result.status().ToString()));
    }
    const auto is_it = [&](const State& state) {
      return !state.exists && !state.is_body && state.revision == *result;
    };
    Claim(call, ledger().Find(call.hull, call.since, is_it), absl::StrCat("deleted at ", *result));
    ++simulation_.reached.bodies_deleted;
  };
  Await<uint64_t>(
      [&](const Reply<uint64_t>& done) {
        simulation_.registry.changes().Delete("body", HullName(call.hull), std::nullopt, done);
      },
      check);
}

// body: null for none. revision: the answer's, if it has one.
void Client::CheckBody(const Call& call, std::optional<uint64_t> revision,
                       const std::optional<HullChange>& body) {
  const auto is_it = [&](const State& state) {
    return body.has_value() ? IsOf(state, *body) : !state.is_body;
  };
  const auto state = revision.has_value() ? ledger().FindAt(call.hull, call.since, *revision, is_it)
                                          : ledger().Find(call.hull, call.since, is_it);
  if (!state.has_value()) {
    Fail(call, absl::StrCat("a call receives ",
                            !body.has_value() ? "no body"
                                              : absl::StrCat("a body at ", body->record.revision),
                            " at revision ", revision.value_or(0)));
  }
  ledger().Report(call.hull, *state);
}

void Client::FindBodies() {
  Call call = Begin(0);
  const std::function<bool()> stop = StopOf(call);
  std::vector<std::string> ids;
  for (size_t hull = 0; hull < simulation_.plan.hulls; ++hull) ids.push_back(HullName(hull));
  Scheduler::Current().Note("looks for bodies", ids.size());
  if (const absl::Status fresh = simulation_.registry.peers().AwaitPeers({}); !fresh.ok()) {
    if (MayFail(call, fresh, false)) return;
    Fail(call, absl::StrCat("unexpected error: ", fresh.ToString()));
  }
  const bool may_wait = !random().OneIn(3);
  const FoundBodies found = simulation_.registry.records().FindBodies(ids, stop, may_wait);
  if (!may_wait && !found.status.ok()) return;
  ++simulation_.reached.answers;
  if (!found.status.ok()) {
    if (MayFail(call, found.status, true)) return;
    Fail(call, absl::StrCat("unexpected error: ", found.status.ToString()));
  }
  for (call.hull = 0; call.hull < ids.size(); ++call.hull) {
    const bool is_last = call.hull + 1 == ids.size();
    const std::shared_ptr<const Body>& body = found.bodies[call.hull];
    CheckBody(call, is_last ? std::optional(found.store_revision) : std::nullopt,
              body == nullptr ? std::nullopt : std::optional(body->Describe()));
    simulation_.reached.bodies_found += body != nullptr;
  }
}

void Client::ListBodies() {
  Call call = Begin(0);
  Scheduler::Current().Note("lists bodies");
  if (const absl::Status fresh = simulation_.registry.peers().AwaitPeers({}); !fresh.ok()) {
    if (MayFail(call, fresh, false)) return;
    Fail(call, absl::StrCat("unexpected error: ", fresh.ToString()));
  }
  const absl::StatusOr<RecordPage> page =
      simulation_.registry.records().List("", "", kHulls, {}, {.bodies = true});
  ++simulation_.reached.answers;
  if (!page.ok()) {
    if (MayFail(call, page.status(), false)) return;
    Fail(call, absl::StrCat("unexpected error: ", page.status().ToString()));
  }
  for (call.hull = 0; call.hull < kHulls; ++call.hull) {
    const auto listed = std::ranges::find_if(page->entries, [&](const HullChange& body) {
      return body.record.hull_id == HullName(call.hull);
    });
    CheckBody(call, page->store_revision,
              listed == page->entries.end() ? std::nullopt : std::optional(*listed));
  }
  ledger().ReportRevision(page->store_revision);
}

}  // namespace hulld::server
