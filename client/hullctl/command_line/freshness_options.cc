#include "client/hullctl/command_line/freshness_options.h"

#include <absl/status/status.h>
#include <absl/strings/numbers.h>
#include <absl/strings/str_cat.h>

#include <chrono>
#include <cstdint>
#include <string>

#include "client/formats/text_number.h"
#include "client/hullctl/command_line/arguments.h"

namespace hulld {
namespace {

// Returns the freshness of the invocation for options to fill.
v1::Freshness* FreshnessOf(Invocation* invocation) {
  if (!invocation->freshness.has_value()) invocation->freshness.emplace();
  return &*invocation->freshness;
}

absl::Status TakeBound(const std::string& text, v1::Freshness* freshness) {
  const absl::StatusOr<std::chrono::milliseconds> bound = ParseDuration(text);
  if (!bound.ok()) return bound.status();
  freshness->mutable_max_staleness()->set_seconds(bound->count() / 1000);
  freshness->mutable_max_staleness()->set_nanos(static_cast<int32_t>(bound->count() % 1000) *
                                                1'000'000);
  return absl::OkStatus();
}

absl::Status TakeRevision(const std::string& text, v1::Freshness* freshness) {
  const size_t colon = text.rfind(':');
  uint64_t revision = 0;
  const bool is_read = colon != std::string::npos && colon > 0 &&
                       absl::SimpleAtoi(text.substr(colon + 1), &revision);
  if (!is_read) {
    return absl::InvalidArgumentError(
        absl::StrCat(Quoted(text),
                     " is not STORE:REVISION, the storeId and the revision of an answer's header "
                     "(--output json)"));
  }
  freshness->set_store_id(text.substr(0, colon));
  freshness->set_at_least_revision(revision);
  return absl::OkStatus();
}

}  // namespace

void AddFreshnessOptions(Command command, Invocation* invocation) {
  command
      .AddParsed(
          "--max-staleness",
          [invocation](const std::string& text) {
            return TakeBound(text, FreshnessOf(invocation));
          },
          "With several servers over one store: accept answers that are at most this old, such as "
          "200ms (default: answers include every acknowledged change)")
      .ValueName("TIME");
  command
      .AddParsed(
          "--at-least",
          [invocation](const std::string& text) {
            return TakeRevision(text, FreshnessOf(invocation));
          },
          "Accept this revision of the store or a later one; it is in the header of an earlier "
          "answer")
      .ValueName("STORE:REVISION");
}

}  // namespace hulld
