#include "client/hullctl/view/hull_follower.h"

#include <absl/strings/str_cat.h>

#include <chrono>
#include <utility>

namespace hulld {
namespace {

constexpr std::chrono::seconds kPauseBetweenWatches{1};

}  // namespace

HullFollower::HullFollower(const Client& client, v1::WatchHullsRequest request, Receiver receive,
                           ReportError report_error)
    : client_(client),
      request_(std::move(request)),
      receive_(std::move(receive)),
      report_error_(std::move(report_error)),
      thread_([this] {
        Run();
        finished_ = true;
      }) {}

HullFollower::~HullFollower() {
  Cancel();
  thread_.join();
}

void HullFollower::Cancel() {
  {
    const std::lock_guard lock(mutex_);
    ended_ = true;
    if (watch_ != nullptr) watch_->Cancel();
  }
  changed_.notify_all();
}

void HullFollower::Run() {
  std::string last_error;
  while (true) {
    {
      const std::lock_guard lock(mutex_);
      if (ended_) return;
      watch_ = client_.WatchHulls(request_);
    }
    const absl::Status status = Follow(watch_.get());
    const bool is_unknown = absl::IsUnimplemented(status);
    const std::string error =
        absl::StrCat("Hull changes are currently not shown: ",
                     is_unknown ? "this hulld does not implement WatchHulls" : status.message());
    {
      const std::lock_guard lock(mutex_);
      if (ended_) return;
    }
    // May block, so it is called without the mutex, which Cancel needs.
    if (error != std::exchange(last_error, error)) report_error_(error);
    if (is_unknown) return;
    std::unique_lock lock(mutex_);
    if (changed_.wait_for(lock, kPauseBetweenWatches, [this] { return ended_; })) return;
  }
}

absl::Status HullFollower::Follow(HullWatch* watch) {
  while (true) {
    const auto response = watch->Next();
    if (!response.ok()) return response.status();
    Take(*response);
  }
}

void HullFollower::Take(const v1::WatchHullsResponse& response) {
  if (response.restarted()) {
    seen_since_restart_.clear();
    synced_ = false;
  }
  for (const v1::HullEvent& event : response.events()) {
    const std::string& id = event.hull().hull_id();
    if (event.kind() == v1::HULL_EVENT_KIND_DELETED) {
      present_.erase(id);
      seen_since_restart_.erase(id);
    } else {
      present_.insert(id);
      if (!synced_) seen_since_restart_.insert(id);
    }
    receive_(event, synced_);
  }
  if (response.synced() && !synced_) {
    synced_ = true;
    std::erase_if(present_, [&](const std::string& id) {
      if (seen_since_restart_.contains(id)) return false;
      v1::HullEvent gone;
      gone.set_kind(v1::HULL_EVENT_KIND_DELETED);
      gone.mutable_hull()->set_hull_id(id);
      gone.mutable_hull()->set_revision(response.header().revision());
      receive_(gone, synced_);
      return true;
    });
    seen_since_restart_.clear();
  }
  request_.set_after_revision(response.header().revision());
  request_.set_store_id(response.header().store_id());
}

}  // namespace hulld
