#include "client/hullctl/view/edit_feed.h"

#include <absl/strings/str_cat.h>

#include <utility>

#include "client/check.h"
#include "client/hullctl/printing/json.h"
#include "client/point_messages.h"
#include "client/status_macros.h"

namespace hulld {
namespace {

absl::StatusOr<std::string> ApplyAppend(const Client& client, const ViewEdit& edit) {
  HULLD_ASSIGN_OR_RETURN(const auto appender, client.OpenAppend(edit.hull_id));
  HULLD_RETURN_IF_ERROR(SendInMessages(
      edit.points, [&](v1::PointBlock points) { return appender->Append(std::move(points)); }));
  HULLD_RETURN_IF_ERROR(appender->Finish());
  const AppendTotals& totals = appender->totals();
  return absl::StrCat(edit.hull_id, ": ", totals.counts.received(), " appended, ",
                      totals.counts.outside(), " outside; now at revision ", totals.hull_revision);
}

absl::StatusOr<std::string> ApplyDelete(const Client& client, const ViewEdit& edit) {
  HULLD_ASSIGN_OR_RETURN(const auto deleted, client.DeleteHull(edit.hull_id));
  return absl::StrCat(edit.hull_id, " was deleted");
}

std::string EditedMessage(const ViewEdit& edit, const absl::StatusOr<std::string>& outcome) {
  const std::string message = outcome.ok() ? *outcome : std::string(outcome.status().message());
  return TextMessage("edited", {{"hullId", QuoteJson(edit.hull_id)},
                                {"done", outcome.ok() ? "true" : "false"},
                                {"message", QuoteJson(message)}});
}

}  // namespace

bool EditQueue::Add(ViewEdit edit) {
  const auto last = last_.find(edit.hull_id);
  const bool joins = last != last_.end() && last->second->action == edit.action;
  const size_t numbers = joins ? edit.points.size() : NumbersOf(edit);
  if (numbers > kMaxNumbers - numbers_) return false;
  numbers_ += numbers;
  if (joins) {
    std::vector<double>& points = last->second->points;
    points.insert(points.end(), edit.points.begin(), edit.points.end());
    return true;
  }
  const std::string hull_id = edit.hull_id;
  edits_.push_back(std::move(edit));
  last_[hull_id] = std::prev(edits_.end());
  return true;
}

ViewEdit EditQueue::Take() {
  HULLD_CLIENT_CHECK(!empty());
  const auto last = last_.find(edits_.front().hull_id);
  if (last->second == edits_.begin()) last_.erase(last);
  ViewEdit edit = std::move(edits_.front());
  edits_.pop_front();
  numbers_ -= NumbersOf(edit);
  return edit;
}

EditFeed::EditFeed(const Client& client, std::shared_ptr<PageChannel> page)
    : client_(client), page_(std::move(page)), thread_([this] { Run(); }) {}

EditFeed::~EditFeed() {
  {
    const std::lock_guard lock(mutex_);
    ended_ = true;
  }
  changed_.notify_all();
  thread_.join();
}

void EditFeed::Ask(ViewEdit edit) {
  ViewEdit refused{edit.action, edit.hull_id, {}};
  {
    const std::lock_guard lock(mutex_);
    if (waiting_.Add(std::move(edit))) {
      changed_.notify_all();
      return;
    }
  }
  page_->SendText(EditedMessage(refused, absl::ResourceExhaustedError(absl::StrCat(
                                             refused.hull_id,
                                             ": too many edits are pending; nothing was changed; "
                                             "try again after the server has answered"))));
}

void EditFeed::Run() {
  while (true) {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [this] { return !waiting_.empty() || ended_; });
    if (waiting_.empty()) return;
    const ViewEdit edit = waiting_.Take();
    lock.unlock();
    const bool is_delete = edit.action == ViewEdit::Action::kDelete;
    page_->SendText(
        EditedMessage(edit, is_delete ? ApplyDelete(client_, edit) : ApplyAppend(client_, edit)));
  }
}

}  // namespace hulld
