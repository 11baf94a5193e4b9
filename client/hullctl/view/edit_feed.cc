#include "client/hullctl/view/edit_feed.h"

#include <absl/strings/str_cat.h>

#include <utility>

#include "client/hullctl/printing/json.h"

namespace hulld {
namespace {

// A hand makes one at a time.
constexpr size_t kMostEdits = 64;

absl::StatusOr<std::string> Append(const Client& client, const ViewEdit& edit) {
  const auto appender = client.OpenAppend(edit.hull_id);
  if (!appender.ok()) return appender.status();
  v1::PointBlock block;
  block.mutable_xyz()->Add(edit.points.begin(), edit.points.end());
  if (absl::Status status = (*appender)->Append(std::move(block)); !status.ok()) return status;
  if (absl::Status status = (*appender)->Finish(); !status.ok()) return status;
  const AppendTotals& totals = (*appender)->totals();
  return absl::StrCat(edit.hull_id, ": ", totals.counts.received(), " appended, ",
                      totals.counts.outside(), " outside; now at revision ", totals.hull_revision);
}

absl::StatusOr<std::string> Delete(const Client& client, const ViewEdit& edit) {
  const auto deleted = client.DeleteHull(edit.hull_id);
  if (!deleted.ok()) return deleted.status();
  return absl::StrCat(edit.hull_id, " is deleted");
}

std::string EditedMessage(const ViewEdit& edit, const absl::StatusOr<std::string>& outcome) {
  const std::string message = outcome.ok() ? *outcome
                                           : std::string(outcome.status().message().data(),
                                                         outcome.status().message().size());
  return TextMessage("edited", {{"hullId", QuoteJson(edit.hull_id)},
                                {"done", outcome.ok() ? "true" : "false"},
                                {"message", QuoteJson(message)}});
}

}  // namespace

EditFeed::EditFeed(const Client& client, std::shared_ptr<PageChannel> page)
    : worker_(kMostEdits, [&client, page = std::move(page)](const ViewEdit& edit) {
        const bool is_delete = edit.action == ViewEdit::Action::kDelete;
        const auto outcome = is_delete ? Delete(client, edit) : Append(client, edit);
        return page->SendText(EditedMessage(edit, outcome));
      }) {}

}  // namespace hulld
