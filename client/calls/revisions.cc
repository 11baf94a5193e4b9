#include "client/calls/revisions.h"

namespace hulld {

void AskForAtLeast(const v1::ResponseHeader& header, v1::Freshness* freshness) {
  freshness->clear_at_least_revision();
  freshness->clear_store_id();
  if (header.shards().empty() && header.revision() > 0) {
    freshness->set_at_least_revision(header.revision());
    freshness->set_store_id(header.store_id());
  }
  for (const v1::ShardRevision& shard : header.shards()) {
    if (shard.revision() == 0) continue;
    v1::ShardRevision* least = nullptr;
    for (v1::ShardRevision& known : *freshness->mutable_at_least()) {
      if (known.store_id() == shard.store_id()) least = &known;
    }
    *(least != nullptr ? least : freshness->add_at_least()) = shard;
  }
}

void ResumeAfter(const v1::ResponseHeader& header, v1::WatchHullsRequest* request) {
  request->set_after_revision(header.revision());
  request->set_store_id(header.store_id());
  *request->mutable_after() = header.shards();
}

bool IsResumed(const v1::WatchHullsRequest& request) {
  return request.after_revision() > 0 || !request.after().empty();
}

}  // namespace hulld
