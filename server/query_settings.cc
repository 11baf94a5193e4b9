#include "server/query_settings.h"

#include <absl/strings/str_cat.h>

#include "server/decode.h"

namespace hulld::server {

absl::StatusOr<QueryOptions> MakeQueryOptions(v1::Method method, const v1::Wanted& wanted,
                                              const Limits& limits, const CallLifetime& lifetime) {
  const absl::StatusOr<Method> decoded = DecodeMethod(method);
  if (!decoded.ok()) return decoded.status();
  QueryOptions options;
  options.method = *decoded;
  options.want_axis = wanted.axis();
  options.want_analysis = wanted.analysis();
  options.max_textbook_axes = limits.max_textbook_axes;
  options.should_stop = [&lifetime] { return lifetime.ShouldStop(); };
  return options;
}

absl::Status NameQueryLimit(const absl::Status& status) {
  if (status.code() != absl::StatusCode::kResourceExhausted) return status;
  return absl::ResourceExhaustedError(absl::StrCat(status.message(), " (--max-textbook-axes)"));
}

}  // namespace hulld::server
