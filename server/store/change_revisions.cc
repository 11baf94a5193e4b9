// Revisions of changes.
#include <unordered_map>

#include "core/base/check.h"
#include "server/store/store.h"

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

}  // namespace hulld::server
