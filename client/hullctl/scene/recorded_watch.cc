#include "client/hullctl/scene/recorded_watch.h"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <string_view>

#include "client/base/status_macros.h"
#include "client/formats/byte_source.h"
#include "client/formats/text_number.h"
#include "client/hullctl/printing/json.h"
#include "hulld/v1/collision.pb.h"
#include "hulld/v1/hull.pb.h"

namespace hulld {
namespace {

// Adds a message unless it reports nothing but progress.
template <typename Message>
void Keep(const Message& message, RecordedWatch* watch) {
  if (message.events().empty() && !message.synced()) return;
  watch->messages.push_back(MessageJson(message));
}

// Adds the message of a line. INVALID_ARGUMENT: it is not of the same type as the previous ones.
absl::Status AddLine(const std::string& line, bool is_first, RecordedWatch* watch) {
  v1::WatchCollisionsResponse of_pairs;
  v1::WatchHullsResponse of_hulls;
  if (is_first) watch->is_of_pairs = ParseJson(line, UnknownFields::kRefuse, &of_pairs).ok();
  if (!watch->is_of_pairs) {
    const absl::Status parsed = ParseJson(line, UnknownFields::kRefuse, &of_hulls);
    if (parsed.ok()) Keep(of_hulls, watch);
    return parsed;
  }
  HULLD_RETURN_IF_ERROR(ParseJson(line, UnknownFields::kRefuse, &of_pairs));
  Keep(of_pairs, watch);
  for (const v1::CollisionEvent& event : of_pairs.events()) {
    const uint64_t highest = std::max(event.placement_a(), event.placement_b());
    watch->placements = std::max(watch->placements, highest + 1);
  }
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<RecordedWatch> ReadRecordedWatch(const std::string& path) {
  HULLD_ASSIGN_OR_RETURN(const auto source, ByteSource::Open(path));
  RecordedWatch watch;
  bool is_first = true;
  for (std::string_view line; source->ReadLine(&line);) {
    const std::string_view text = Trim(line);
    if (text.empty()) continue;
    if (watch.messages.size() == kMaxRecordedMessages) {
      return source->ErrorAtLine(absl::StrCat("the viewer plays up to ", kMaxRecordedMessages,
                                              " messages with events; remove the rest"));
    }
    const absl::Status added = AddLine(std::string(text), is_first, &watch);
    if (!added.ok()) {
      return source->ErrorAtLine(absl::StrCat("not a line of 'hullctl watch --output json': ",
                                              std::string(added.message())));
    }
    is_first = false;
  }
  if (!source->status().ok()) return source->status();
  if (!watch.messages.empty()) return watch;
  return absl::InvalidArgumentError(
      absl::StrCat(path, ": contains no events; write it with 'hullctl watch --output json'"));
}

}  // namespace hulld
