#include "tests/server/harness/history/hull_specification.h"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <bit>
#include <optional>
#include <set>

#include "core/base/check.h"

namespace hulld::server {

std::string SpecifiedHull::Key() const {
  std::string key = absl::StrCat(exists, ",", create_revision, ",", create_revision_known, ",",
                                 revision, ",", revision_known, ",", grown, ",", points, ",",
                                 received, ",", outside, ",", duplicate);
  for (const auto& [writer, sequence] : writers) absl::StrAppend(&key, ",", writer, ":", sequence);
  for (const std::string& piece : pieces) absl::StrAppend(&key, ",", piece);
  return key;
}

namespace {

using Kind = Operation::Kind;
using Outcome = Operation::Outcome;

bool AgreeOnIncarnation(SpecifiedHull& state, uint64_t create_revision) {
  if (!state.create_revision_known) {
    state.create_revision = create_revision;
    state.create_revision_known = true;
  }
  return state.create_revision == create_revision;
}

// Fixes the hull's revision to the answered one. Returns false if they contradict.
bool Agree(SpecifiedHull& state, uint64_t revision) {
  if (state.revision_known) return state.revision == revision;
  if (revision <= state.revision) return false;
  if (!state.grown && !AgreeOnIncarnation(state, revision)) return false;
  state.revision = revision;
  state.revision_known = true;
  return true;
}

// Applies a change with this revision, or, if the answer did not contain it, with an unknown later
// one. Returns false if impossible.
bool Advance(SpecifiedHull& state, const Operation& operation, uint64_t revision) {
  if (operation.outcome == Outcome::kUnknown || operation.shares_later_ack) {
    state.revision_known = false;
    return true;
  }
  if (revision <= state.revision) return false;
  state.revision = revision;
  state.revision_known = true;
  return true;
}

// Starts a new, empty incarnation that replaces any existing one.
bool Create(SpecifiedHull& state, const Operation& operation) {
  const uint64_t revision = state.revision;
  const bool known = state.revision_known;
  state = SpecifiedHull();
  state.revision = revision;
  state.revision_known = known;
  if (!Advance(state, operation, operation.create_revision)) return false;
  state.exists = true;
  state.create_revision = state.revision;
  state.create_revision_known = state.revision_known;
  return true;
}

// Returns true if the condition may have failed. After a lost answer the revision is unknown.
bool Mismatch(const SpecifiedHull& state, const Operation& operation) {
  if (!operation.if_revision) return false;
  return !state.revision_known || *operation.if_revision != state.revision;
}

// Returns true if the condition may have held.
bool Match(const SpecifiedHull& state, const Operation& operation) {
  if (!operation.if_revision) return true;
  return state.revision_known ? *operation.if_revision == state.revision
                              : *operation.if_revision > state.revision;
}

bool SameCounts(const SpecifiedHull& state, const Operation& operation) {
  return operation.received == state.received && operation.outside == state.outside &&
         operation.duplicate == state.duplicate &&
         operation.vertex_count == static_cast<uint64_t>(std::popcount(state.points));
}

bool StepCreateOrOpen(SpecifiedHull& state, const Operation& operation) {
  const bool open = operation.kind == Kind::kOpen;
  switch (operation.outcome) {
    case Outcome::kNotFound:
      return open && !operation.if_absent && !state.exists;
    case Outcome::kAlreadyExists:
      return !open && !operation.if_absent && state.exists;
    case Outcome::kUnknown:
      return !state.exists && (!open || operation.if_absent) && Create(state, operation);
    case Outcome::kOk:
      break;
    default:
      return false;
  }
  // The opening of a stream does not report creation, so the absence of the hull decides.
  if (open ? operation.if_absent && !state.exists : operation.created) {
    return !state.exists && Create(state, operation) && SameCounts(state, operation) &&
           operation.revision == operation.create_revision && operation.last_sequence == 0;
  }
  if (!state.exists || (!open && !operation.if_absent)) return false;
  if (!Agree(state, operation.revision)) return false;
  if (!AgreeOnIncarnation(state, operation.create_revision)) return false;
  if (!SameCounts(state, operation)) return false;
  return !open || operation.last_sequence == state.LastSequence(operation.writer);
}

bool StepAppend(SpecifiedHull& state, const Operation& operation) {
  if (!state.exists || !AgreeOnIncarnation(state, operation.incarnation)) return false;
  const uint64_t last = state.LastSequence(operation.writer);
  const bool is_applied_already = operation.shares_later_ack || operation.covers_earlier_chunks
                                      ? operation.sequence <= last
                                      : operation.already_applied;
  if (operation.outcome == Outcome::kOk && is_applied_already) {
    return operation.sequence <= last &&
           (operation.shares_later_ack || Agree(state, operation.revision));
  }
  if (operation.sequence != last + 1) return false;
  if (operation.outcome == Outcome::kAborted) return Mismatch(state, operation);
  if (!Match(state, operation)) return false;
  const PointSet added = operation.points & ~state.points;
  const uint64_t outside = static_cast<uint64_t>(std::popcount(added));
  const bool lost = operation.outcome == Outcome::kUnknown || operation.shares_later_ack;
  if (!lost && operation.outcome != Outcome::kOk) return false;
  if (added != 0) {
    if (!Advance(state, operation, operation.revision)) return false;
  } else if (!lost && !Agree(state, operation.revision)) {
    return false;
  }
  state.points |= added;
  state.grown = state.grown || added != 0;
  state.received += operation.sent;
  state.outside += outside;
  state.duplicate += operation.sent - outside;
  state.writers[operation.writer] = operation.sequence;
  if (lost) return true;
  if (operation.vertex_count != static_cast<uint64_t>(std::popcount(state.points))) return false;
  if (operation.covers_earlier_chunks) return true;
  return operation.received == operation.sent && operation.outside == outside &&
         operation.duplicate == operation.sent - outside;
}

// One atomic change: the hull always has either the old or the new points.
bool StepReplace(SpecifiedHull& state, const Operation& operation) {
  const bool absent_fits = operation.if_revision.value_or(0) == 0;
  switch (operation.outcome) {
    case Outcome::kNotFound:
      return !state.exists && absent_fits && !operation.if_absent;
    case Outcome::kAborted:
      return state.exists ? Mismatch(state, operation) : !absent_fits;
    case Outcome::kOk:
    case Outcome::kUnknown:
      break;
    default:
      return false;
  }
  const bool existed = state.exists;
  if (existed ? !Match(state, operation) : !absent_fits || !operation.if_absent) return false;
  if (!Create(state, operation)) return false;
  state.points = operation.points;
  state.received = operation.sent;
  state.outside = static_cast<uint64_t>(std::popcount(operation.points));
  state.duplicate = operation.sent - state.outside;
  if (operation.outcome == Outcome::kUnknown) return true;
  return operation.created == !existed && operation.revision == operation.create_revision &&
         SameCounts(state, operation);
}

// Puts all pieces at once. An existing body keeps its incarnation.
bool StepPut(SpecifiedHull& state, const Operation& operation) {
  const bool absent_fits = operation.if_revision.value_or(0) == 0;
  if (operation.outcome == Outcome::kAborted) {
    return state.exists ? Mismatch(state, operation) : !absent_fits;
  }
  if (operation.outcome != Outcome::kOk && operation.outcome != Outcome::kUnknown) return false;
  const bool existed = state.exists;
  if (existed ? !Match(state, operation) : !absent_fits) return false;
  if (existed) {
    if (!Advance(state, operation, operation.revision)) return false;
    state.grown = true;
  } else if (!Create(state, operation)) {
    return false;
  }
  state.pieces = operation.pieces;
  if (operation.outcome == Outcome::kUnknown) return true;
  return operation.created == !existed && Agree(state, operation.revision) &&
         AgreeOnIncarnation(state, operation.create_revision);
}

bool StepDelete(SpecifiedHull& state, const Operation& operation) {
  if (operation.outcome == Outcome::kNotFound) return !state.exists;
  if (!state.exists) return false;
  if (operation.outcome == Outcome::kAborted) return Mismatch(state, operation);
  if (operation.outcome != Outcome::kOk && operation.outcome != Outcome::kUnknown) return false;
  if (!Match(state, operation) || !Advance(state, operation, operation.store_revision)) {
    return false;
  }
  state.exists = false;
  return true;
}

bool Has(const SpecifiedHull& state, int point) { return (state.points >> point & 1) != 0; }

bool StepRead(SpecifiedHull& state, const Operation& operation) {
  if (operation.outcome == Outcome::kNotFound) return !state.exists;
  if (operation.outcome != Outcome::kOk || !state.exists) return false;
  if (!Agree(state, operation.revision)) return false;
  switch (operation.kind) {
    case Kind::kGet:
      return AgreeOnIncarnation(state, operation.create_revision) && SameCounts(state, operation);
    case Kind::kMesh:
      return operation.points == state.points;
    case Kind::kGetBody:
      return AgreeOnIncarnation(state, operation.create_revision) &&
             operation.pieces == state.pieces;
    default:
      return operation.touching == Has(state, operation.probe);
  }
}

bool AgreeOnVersion(SpecifiedHull& state, uint64_t create_revision, uint64_t revision) {
  return state.exists && Agree(state, revision) && AgreeOnIncarnation(state, create_revision);
}

bool StepPair(SpecifiedHull& hull, const Operation& operation, const FindSpecified& find) {
  const Seen& seen = operation.others.front();
  SpecifiedHull& other = find(seen.hull_id);
  if (operation.outcome == Outcome::kNotFound) return !hull.exists || !other.exists;
  if (operation.outcome != Outcome::kOk) return false;
  return AgreeOnVersion(hull, operation.create_revision, operation.revision) &&
         AgreeOnVersion(other, seen.create_revision, seen.revision);
}

bool HasPiece(const SpecifiedHull& body, const std::string& hull_id) {
  return std::find(body.pieces.begin(), body.pieces.end(), hull_id) != body.pieces.end();
}

bool StepBodyQuery(SpecifiedHull& body, const Operation& operation, const FindSpecified& find) {
  if (operation.outcome == Outcome::kNotFound) {
    if (operation.missing.empty()) return !body.exists;
    return body.exists && HasPiece(body, operation.missing) && !find(operation.missing).exists;
  }
  if (operation.outcome != Outcome::kOk) return false;
  if (!AgreeOnVersion(body, operation.create_revision, operation.revision)) return false;
  if (operation.lists_pieces) {
    const std::set<std::string> pieces(operation.pieces.begin(), operation.pieces.end());
    if (pieces != std::set<std::string>(body.pieces.begin(), body.pieces.end())) return false;
  }
  for (const Seen& seen : operation.others) {
    if (!HasPiece(body, seen.hull_id)) return false;
    if (!AgreeOnVersion(find(seen.hull_id), seen.create_revision, seen.revision)) return false;
  }
  bool touching = false;
  for (const std::string& piece : body.pieces) {
    if (!find(piece).exists) return false;
    touching |= Has(find(piece), operation.probe);
  }
  if (touching != operation.touching) return false;
  return !touching ||
         (HasPiece(body, operation.deciding) && Has(find(operation.deciding), operation.probe));
}

// Returns the points of a hull, or of all pieces of a body; nullopt if a piece lacks its hull.
std::optional<PointSet> PointsOf(const SpecifiedHull& state, const FindSpecified& find) {
  PointSet points = state.points;
  for (const std::string& piece : state.pieces) {
    if (!find(piece).exists) return std::nullopt;
    points |= find(piece).points;
  }
  return points;
}

bool StepSeen(const Seen& seen, const FindSpecified& find) {
  SpecifiedHull& state = find(seen.hull_id);
  if (seen.is_missing) return !state.exists;
  if (!seen.missing_piece.empty()) {
    return state.exists && HasPiece(state, seen.missing_piece) && !find(seen.missing_piece).exists;
  }
  if (seen.lacks_answer) return false;
  if (!AgreeOnVersion(state, seen.create_revision, seen.revision)) return false;
  const auto vertices = static_cast<uint64_t>(std::popcount(state.points));
  if (seen.size && *seen.size != vertices + state.pieces.size()) return false;
  if (seen.probed == 0) return true;
  const std::optional<PointSet> points = PointsOf(state, find);
  return points.has_value() && (*points & seen.probed) == seen.touched;
}

bool StepBatch(const Operation& operation, const FindSpecified& find) {
  return operation.outcome == Outcome::kOk &&
         std::all_of(operation.others.begin(), operation.others.end(),
                     [&](const Seen& seen) { return StepSeen(seen, find); });
}

}  // namespace

bool Step(SpecifiedHull& state, const Operation& operation) {
  switch (operation.kind) {
    case Kind::kCreate:
    case Kind::kOpen:
      return StepCreateOrOpen(state, operation);
    case Kind::kAppend:
      return StepAppend(state, operation);
    case Kind::kReplace:
      return StepReplace(state, operation);
    case Kind::kDelete:
      return StepDelete(state, operation);
    case Kind::kGet:
    case Kind::kMesh:
    case Kind::kProbe:
    case Kind::kGetBody:
      return StepRead(state, operation);
    case Kind::kPut:
      return StepPut(state, operation);
    case Kind::kPair:
    case Kind::kBodyQuery:
    case Kind::kBatch:
      break;
  }
  HULLD_UNREACHABLE();
}

bool StepJoint(SpecifiedHull& hull, const Operation& operation, const FindSpecified& find) {
  switch (operation.kind) {
    case Kind::kPair:
      return StepPair(hull, operation, find);
    case Kind::kBodyQuery:
      return StepBodyQuery(hull, operation, find);
    default:
      return StepBatch(operation, find);
  }
}

bool IsRead(const Operation& operation) {
  switch (operation.kind) {
    case Kind::kCreate:
    case Kind::kOpen:
    case Kind::kAppend:
    case Kind::kReplace:
    case Kind::kDelete:
    case Kind::kPut:
      return false;
    case Kind::kGet:
    case Kind::kMesh:
    case Kind::kProbe:
    case Kind::kPair:
    case Kind::kGetBody:
    case Kind::kBodyQuery:
    case Kind::kBatch:
      return true;
  }
  HULLD_UNREACHABLE();
}

}  // namespace hulld::server
