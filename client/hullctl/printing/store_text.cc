#include "client/hullctl/printing/store_text.h"

#include <absl/strings/str_cat.h>

namespace hulld {

std::string StoresText(const v1::ResponseHeader& header) {
  std::string text = header.store_id();
  for (const v1::ShardRevision& shard : header.shards()) {
    absl::StrAppend(&text, text.empty() ? "" : " ", shard.store_id());
  }
  return text;
}

std::string RevisionsText(const v1::ResponseHeader& header) {
  if (header.shards().empty()) return std::to_string(header.revision());
  std::string text;
  for (const v1::ShardRevision& shard : header.shards()) {
    absl::StrAppend(&text, text.empty() ? "" : " ", shard.store_id(), ":", shard.revision());
  }
  return text;
}

}  // namespace hulld
