#include "server/registry/changes/hull_changes.h"

#include "core/base/check.h"
#include "server/registry/catalog/registered_hull.h"

namespace hulld::server {

void HullChanges::Submit(Locked& locked, const HullPointer& hull, Change change,
                         Committer::Completion finish) {
  HULLD_CHECK(hull->state.in_flight() > 0);
  const auto charge = std::make_shared<MemoryCharge>(memory_, MemoryUse::kWriting,
                                                     change.vertices.capacity() * sizeof(Vector));
  committer_.Submit(locked, std::move(change),
                    [this, hull, charge, finish = std::move(finish)](
                        Locked& later, const absl::Status& status, Change& committed) {
                      charge->Set(0);
                      if (status.ok()) {
                        hull->state.Commit();
                      } else {
                        hull->state.Refuse();
                      }
                      finish(later, status, committed);
                      // Peer changes must be applied first.
                      if (Committer::IsSuperseded(status)) return AdvanceLater(hull);
                      // A hull at rest may be evicted.
                      if (hull->state.quiet() && !hull->state.gone()) {
                        hull->NoteUse();
                        memory_.Evict(later);
                      }
                      Advance(later, hull);
                      catalog_.hulls().RestSome();
                    });
}

void HullChanges::Advance(Locked& locked, const HullPointer& hull) {
  hull->changed.notify_all();
  while (hull->state.quiet() && !hull->exclusive.empty()) {
    const auto next = std::move(hull->exclusive.front());
    hull->exclusive.pop_front();
    next(locked);
  }
  if (hull->chunks.empty()) return;
  if (hull->state.gone() || hull->state.damaged()) {
    // A thread at work calls this again when it ends.
    if (hull->state.work() != HullState::Work::kIdle) return;
    // Replies must run on a thread other than the caller's.
    writers_.Submit([this, hull] { refuse_chunks_(hull); }, hull->chunks.front().session.client);
    return;
  }
  if (!hull->state.can_schedule() || !hull->exclusive.empty()) return;
  const PendingChunk& next = hull->chunks.front();
  const bool repeated = next.chunk.sequence <= hull->HeadSequence(next.session.writer_id);
  // These chunks depend on the committed state.
  if (hull->state.in_flight() > 0 && (repeated || next.chunk.if_revision.has_value())) return;
  hull->state.Schedule();
  writers_.Submit([this, hull] { run_chunk_(hull); }, next.session.client);
}

void HullChanges::AdvanceLater(const HullPointer& hull) {
  after_others_.Add([this, hull](Locked& locked) { Advance(locked, hull); });
}

}  // namespace hulld::server
