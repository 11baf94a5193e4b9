#include "server/registry/changes/hull_changes.h"

#include "core/base/check.h"
#include "server/registry/catalog/registered_hull.h"

namespace hulld::server {

// Submits a change that follows all earlier changes of its hull. Requires: the state of `hull`
// counts it as in flight. finish: called after the state's transition, before waiting tasks resume.
void HullChanges::Submit(Locked& locked, const HullPointer& hull, Change change,
                         Committer::Completion finish) {
  HULLD_CHECK(hull->state.in_flight() > 0);
  const auto charge = std::make_shared<MemoryCharge>(state_.memory, MemoryUse::kWriting,
                                                     change.vertices.capacity() * sizeof(Vector));
  committer_.Submit(locked, std::move(change),
                    [this, hull, charge, finish = std::move(finish)](
                        Locked& later, const absl::Status& status, Change& committed) {
                      charge->Set(0);
                      status.ok() ? hull->state.Commit() : hull->state.Refuse();
                      finish(later, status, committed);
                      // The peer change must be applied first.
                      if (Committer::IsSuperseded(status)) {
                        return barrier_.Defer([this, hull](Locked& next) { Advance(next, hull); });
                      }
                      // A hull at rest may be evicted.
                      if (hull->state.quiet() && !hull->state.gone()) {
                        hull->DiscardUnneededBuilder(later);
                        hull->NoteUse();
                        state_.memory.Evict(later);
                      }
                      Advance(later, hull);
                      state_.catalog.hulls().RestSome();
                    });
}

// Resumes the tasks that wait for the hull.
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
    writers_.Submit([this, hull] { RefuseChunks(hull); }, hull->chunks.front().session.client);
    return;
  }
  if (!hull->state.can_schedule() || !hull->exclusive.empty()) return;
  const PendingChunk& next = hull->chunks.front();
  const bool repeated = next.chunk.sequence <= hull->HeadSequence(next.session.writer_id);
  // These chunks depend on the committed state.
  if (hull->state.in_flight() > 0 && (repeated || next.chunk.if_revision.has_value())) return;
  hull->state.Schedule();
  writers_.Submit([this, hull] { RunNextChunk(hull); }, next.session.client);
}

void HullChanges::OnPeerChange(Locked& /*locked*/, const std::string& /*id*/,
                               const HullPointer& hull) {
  if (hull != nullptr) barrier_.Defer([this, hull](Locked& later) { Advance(later, hull); });
}

}  // namespace hulld::server
