#include "server/store/store.h"

#include <unordered_map>

#include "core/base/check.h"
#include "core/base/status_macros.h"

namespace hulld::server {
namespace {

// Revisions of hulls after the changes so far.
using Grown = std::unordered_map<const HullRevisions*, HullRevisions>;

void NumberBody(Change& change) {
  if (change.deleted) return;
  BodyRecord& record = change.body->record;
  record.revision = change.revision;
  if (change.begins) record.create_revision = change.revision;
}

void NumberHull(Change& change, Grown& grown) {
  if (change.deleted) return;
  HullRevisions now{.create = change.revision, .change = change.revision};
  if (!change.begins) {
    HULLD_CHECK(change.before != nullptr);
    now = grown.try_emplace(change.before.get(), *change.before).first->second;
    change.previous_layout.base_revision = now.base;
    if (change.takes_revision) now.change = change.revision;
  }
  if (change.vertex_change == VertexChange::kReplaced) now.base = change.revision;
  if (!change.begins) grown[change.before.get()] = now;
  SetRevisions(now, &change.hull);
}

}  // namespace

uint64_t NumberChanges(std::span<Change* const> changes, uint64_t revision) {
  Grown grown;
  for (Change* change : changes) {
    if (change->takes_revision) ++revision;
    change->revision = revision;
    if (change->body != nullptr) {
      NumberBody(*change);
    } else {
      NumberHull(*change, grown);
    }
  }
  return revision;
}

// Reads hulls and bodies separately: a damaged store may contain both under one ID.
absl::Status Store::ForEachRecord(const StoredHullVisitor& visit_hull,
                                  const StoredBodyVisitor& visit_body) {
  // About 100 bytes each, except bodies with many pieces.
  constexpr size_t kRecordsPerPage = 4096;
  for (const RecordKinds kinds : {RecordKinds{.hulls = true}, RecordKinds{.bodies = true}}) {
    std::string last;
    for (bool more = true; more;) {
      HULLD_ASSIGN_OR_RETURN(const FoundRecords page,
                             ListRecords("", last, kRecordsPerPage, kinds));
      for (const auto& [id, hull] : page.hulls) visit_hull(last = id, hull);
      for (const auto& [id, body] : page.bodies) visit_body(last = id, body);
      more = page.more;
    }
  }
  return absl::OkStatus();
}

}  // namespace hulld::server
