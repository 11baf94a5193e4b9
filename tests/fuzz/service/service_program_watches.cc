// Watches, and their events while other calls change hulls and placements move.
#include <absl/strings/str_cat.h>

#include <algorithm>
#include <utility>

#include "tests/fuzz/service/service_program.h"
#include "tests/fuzz/service/watch_check.h"

namespace hulld::fuzz {
namespace {

using server::Rpc;

// The limit of a batch.
constexpr int kMaxComparedPairsOfWatch = 120;

}  // namespace

// Watches until synced, makes a change, waits for its event, and resumes.
void ServiceProgram::WatchHulls() {
  v1::WatchHullsRequest request;
  FillMessage(in_, Hints(), &request);
  const size_t kind = in_.Below(4);
  // Usually from the start, sometimes as after a broken connection.
  if (kind > 0) request.clear_after_revision();
  if (kind == 0) request.set_store_id(service_.store_id_);
  if (kind == 1) request.set_store_id("another");
  if (!request.hull_id().empty() && !in_.OneOf(4)) request.clear_prefix();
  HullWatchCheck check(request);
  if (!WatchHullsOnce(request, true, &check) || !finding_.empty()) return;
  if (check.header().revision() == 0) return;
  request.set_after_revision(check.header().revision());
  request.set_store_id(check.header().store_id());
  HullWatchCheck resumed(request);
  if (!WatchHullsOnce(request, false, &resumed) || !finding_.empty()) return;
  Reach("WatchHulls resumed");
  if (resumed.is_restarted() || !resumed.hulls().empty()) Note("a watch resumes as if it were new");
}

bool ServiceProgram::WatchHullsOnce(const v1::WatchHullsRequest& request, bool then_change,
                                    HullWatchCheck* check) {
  grpc::ClientContext context;
  CallManner manner;
  Hurry(context, manner);
  const auto reader = service_.hulls_->WatchHulls(&context, request);
  bool lasts = true;
  v1::WatchHullsResponse response;
  const auto read_until = [&](const auto& is_done) {
    while (finding_.empty() && !is_done()) {
      lasts = reader->Read(&response);
      if (!lasts) return false;
      SeeStore(response.header());
      Note(check->Received(response));
    }
    return finding_.empty();
  };
  bool reported = read_until([&] { return check->is_synced(); });
  // A resumed watch reports the changes only.
  const bool lists_all = !Resumes(request) || check->is_restarted();
  if (reported && lists_all) CompareWatched(*check);
  if (reported && then_change) {
    const auto before = hulls_;
    watch_ = &context;
    if (in_.OneOf(2)) {
      CreateHull();
    } else if (in_.OneOf(3)) {
      DeleteHull();
    } else {
      AppendPoints();
    }
    // null: another call was abandoned, and this watch with it.
    manner.cancelled = std::exchange(watch_, nullptr) == nullptr;
    reported = !manner.cancelled && doubtful_.empty() && !all_doubtful_;
    for (const std::string& changed :
         reported ? ChangedSince(before) : std::vector<std::string>()) {
      if (!check->Watches(changed)) continue;
      Reach("WatchHulls change");
      const auto seen = [&] {
        const auto now = hulls_.find(changed);
        const auto known = check->hulls().find(changed);
        if (now == hulls_.end()) return known == check->hulls().end();
        return known != check->hulls().end() && known->second.revision() == now->second.revision();
      };
      reported = reported && read_until(seen);
    }
    if (reported && lists_all) CompareWatched(*check);
  }
  manner.cancelled = manner.cancelled || lasts;
  // A watch that has ended returns its status.
  if (lasts) context.TryCancel();
  while (reader->Read(&response)) {
  }
  const grpc::Status status = reader->Finish();
  Ended(Rpc::kWatchHulls, manner, status);
  if (reported) Reach("WatchHulls reported");
  return reported;
}

// Returns the hulls with a revision other than in `before`, created and deleted ones included.
std::vector<std::string> ServiceProgram::ChangedSince(
    const std::map<std::string, v1::HullInfo>& before) const {
  std::vector<std::string> changed;
  for (const auto& [hull_id, hull] : hulls_) {
    const auto known = before.find(hull_id);
    if (known == before.end() || known->second.revision() != hull.revision()) {
      changed.push_back(hull_id);
    }
  }
  for (const auto& [hull_id, hull] : before) {
    if (hulls_.count(hull_id) == 0) changed.push_back(hull_id);
  }
  return changed;
}

// Checks that the watch's state equals the acknowledged state.
void ServiceProgram::CompareWatched(const HullWatchCheck& check) {
  for (const auto& [hull_id, known] : hulls_) {
    const bool is_certain = doubtful_.count(hull_id) == 0 && !all_doubtful_;
    if (is_certain && check.Watches(hull_id) && check.hulls().count(hull_id) == 0) {
      Note(absl::StrCat("hull ", hull_id, " is not reported; acknowledged state: ", Known(known)));
    }
  }
  const uint64_t revision = revision_;
  // Points that change no vertex are reported with the next event.
  for (const auto& [hull_id, reported] : check.hulls()) {
    const auto known = hulls_.find(hull_id);
    const bool only_counted =
        known != hulls_.end() && known->second.revision() == reported.revision();
    if (!only_counted) SeeKnownHull(reported);
  }
  revision_ = revision;
}

v1::WatchCollisionsRequest ServiceProgram::NextWatchMessage(bool first, size_t placements) {
  v1::WatchCollisionsRequest request;
  const MessageHints hints = {revision_, 1, placements, service_.store_id_};
  if (in_.OneOf(24)) {
    FillMessage(in_, hints, &request);
  } else if (first) {
    FillMessage(in_, hints, request.mutable_open());
    // Pairs exclude groups.
    v1::CollisionWatchOpen* const open = request.mutable_open();
    if (in_.OneOf(3)) {
      open->clear_groups();
      open->clear_movers();
    } else if (!in_.OneOf(8)) {
      open->clear_pairs();
    }
  } else {
    FillMessage(in_, hints, request.mutable_update());
  }
  return request;
}

void ServiceProgram::WatchCollisions() {
  grpc::ClientContext context;
  CallManner manner;
  Hurry(context, manner);
  const auto stream = service_.collisions_->WatchCollisions(&context);
  const size_t messages = in_.Below(6);
  const bool stepwise = !in_.OneOf(4);
  const size_t cancel_at = in_.OneOf(12) ? in_.Below(4) : ~size_t{0};
  v1::WatchCollisionsRequest request = NextWatchMessage(true, 0);
  const size_t placements = static_cast<size_t>(request.open().placements_size());
  const bool is_followed = request.has_open() && !request.open().has_packed_placements();
  CollisionWatchCheck check(request.open());
  if (is_followed) {
    if (auto packed = MaybePacked(request.open())) *request.mutable_open() = *std::move(packed);
  }
  v1::WatchCollisionsResponse response;
  const auto receive = [&] {
    SeeStore(response.header());
    if (is_followed) Note(check.Received(response));
  };
  for (size_t i = 0; i < messages; ++i) {
    if (i == cancel_at) {
      manner.cancelled = true;
      context.TryCancel();
    }
    if (i > 0) {
      request = NextWatchMessage(false, placements);
      check.Sent(request.update());
    }
    if (!stream->Write(request)) break;
    if (!stepwise) continue;
    do {
      if (!stream->Read(&response)) break;
      receive();
    } while (!response.synced());
  }
  stream->WritesDone();
  while (stream->Read(&response)) receive();
  const bool ok = Ended(Rpc::kWatchCollisions, manner, stream->Finish());
  if (!ok || messages == 0 || !is_followed || !finding_.empty()) return;
  if (!check.is_settled()) return Note("a watch ends before everything is reported");
  CompareWatchWithBatch(check);
  Reach(messages > 1 ? "WatchCollisions compared after updates" : "WatchCollisions compared");
}

void ServiceProgram::CompareWatchWithBatch(const CollisionWatchCheck& check) {
  const v1::BatchCheckCollisionsRequest batch = check.AsBatch();
  if (batch.pairs_size() > kMaxComparedPairsOfWatch) return;
  const std::vector<v1::Relation> relations = QueryBatch(batch);
  std::map<std::pair<uint32_t, uint32_t>, v1::Relation> expected;
  for (size_t i = 0; i < relations.size(); ++i) {
    const int at = static_cast<int>(2 * i);
    if (!IsCollision(relations[i])) continue;
    expected[std::minmax(batch.pairs(at), batch.pairs(at + 1))] = relations[i];
    Reach(absl::StrCat("WatchCollisions ", v1::Relation_Name(relations[i])));
  }
  if (!expected.empty()) Reach("WatchCollisions collision");
  if (check.Colliding() != expected && finding_.empty()) Note("a watch and a batch disagree");
}

}  // namespace hulld::fuzz
