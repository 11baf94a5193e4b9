#include "tests/server/schedules/ledger.h"

#include <algorithm>
#include <utility>

#include "core/base/check.h"

namespace hulld::server {
namespace {

size_t NumberOf(const std::string& name, char first, size_t count) {
  HULLD_CHECK(name.size() == 1 && name[0] >= first && name[0] < first + static_cast<int>(count));
  return static_cast<size_t>(name[0] - first);
}

size_t HullOf(const std::string& id) { return NumberOf(id, 'a', kHulls); }
size_t WriterOf(const std::string& id) { return NumberOf(id, 'u', kWriters); }

// Points of the curve are in general position.
bool HasSize(const HullRecord& record, CurveSet points) {
  const uint64_t count = CountOf(points);
  return record.vertex_count == count &&
         record.dimension == static_cast<int>(std::min<uint64_t>(count, 4)) - 1;
}

// Returns true if the appended or rewritten vertices are all correct.
bool HasVertices(const Change& change, CurveSet expected) {
  const std::optional<CurveSet> set = SetOf(change.vertices);
  return set.has_value() && *set == expected;
}

}  // namespace

std::string HullName(size_t hull) { return std::string(1, static_cast<char>('a' + hull)); }
std::string WriterName(size_t writer) { return std::string(1, static_cast<char>('u' + writer)); }

// One or two points, some shared with other chunks.
CurveSet ChunkPoints(size_t writer, uint64_t sequence) {
  const uint64_t first = (sequence * 5 + writer * 3) % kCurvePoints;
  const uint64_t second = (sequence * 7 + writer) % kCurvePoints;
  return CurveSet{2} << first | (sequence % 2 == 0 ? 0 : CurveSet{2} << second);
}

Ledger::Ledger() {
  for (std::vector<State>& states : states_) {
    states.reserve(16);
    states.emplace_back().is_claimed = true;
  }
}

std::optional<std::string> Ledger::Keep(const Change& change, bool nobody_waits) {
  const size_t hull = HullOf(change.id());
  State state = Last(hull);
  state.is_claimed = nobody_waits;
  std::string fault;
  if (change.body != nullptr) {
    fault = KeepBody(change, state);
  } else if (change.deleted) {
    fault = KeepEnd(change, state);
  } else if (change.writer.has_value()) {
    fault = KeepChunk(change, state);
  } else {
    fault = KeepBeginning(change, state);
  }
  const bool is_new = state.revision != Last(hull).revision;
  if (fault.empty() && is_new && state.revision <= revision_) fault = "its revision is not new";
  if (!fault.empty()) {
    return absl::StrCat("the store received an incorrect change of hull ", change.id(),
                        " at revision ", change.revision, ": ", fault, "\n", Describe(hull));
  }
  revision_ = std::max(revision_, state.revision);
  states_[hull].push_back(std::move(state));
  return std::nullopt;
}

std::string Ledger::KeepEnd(const Change& change, State& state) {
  if (!state.exists) return "there is nothing to delete";
  if (change.hull.record != state.record)
    return "it deletes a different hull than the existing one";
  state =
      State{.record = state.record, .revision = change.revision, .is_claimed = state.is_claimed};
  return {};
}

// Records a creation, or a replacement with or without an existing hull.
std::string Ledger::KeepBeginning(const Change& change, State& state) {
  const HullRecord& record = change.hull.record;
  if (state.is_body) return "the ID belongs to a body";
  if (change.replaced.has_value() != state.exists)
    return "it replaces a hull that does not exist, or creates one that exists";
  if (state.exists && change.replaced->record != state.record)
    return "it replaces a different hull than the existing one";
  const std::optional<CurveSet> points = SetOf(change.vertices);
  if (!points.has_value()) return "its vertices are not among those sent";
  if (record.create_revision != change.revision || record.revision != change.revision) {
    return "its record has a different revision";
  }
  if (!HasSize(record, *points)) return "its record has an incorrect number of vertices";
  state = State{.exists = true,
                .record = record,
                .revision = change.revision,
                .points = *points,
                .is_claimed = state.is_claimed};
  return {};
}

// Records a put or a deletion.
std::string Ledger::KeepBody(const Change& change, State& state) {
  const BodyRecord& record = change.body->record;
  if (state.exists) return "the ID belongs to a hull";
  if (change.deleted && !state.is_body) return "there is no body to delete";
  const bool is_it = record.create_revision == state.record.create_revision &&
                     record.revision == state.record.revision;
  if (change.deleted && !is_it) return "it deletes a different body than the existing one";
  if (!change.deleted) {
    const uint64_t created = state.is_body ? state.record.create_revision : change.revision;
    if (record.create_revision != created) return "the body has a different create_revision";
    if (record.revision != change.revision) return "its record has a different revision";
  }
  HullRecord now;
  now.hull_id = record.body_id;
  now.create_revision = record.create_revision;
  now.revision = record.revision;
  state = State{.is_body = !change.deleted,
                .record = now,
                .revision = change.revision,
                .is_claimed = state.is_claimed};
  return {};
}

std::string Ledger::KeepChunk(const Change& change, State& state) {
  const HullRecord& record = change.hull.record;
  if (!state.exists) return "the hull of the chunk does not exist";
  if (record.create_revision != state.record.create_revision) return "the hull has been replaced";
  uint64_t& last = state.sequences[WriterOf(change.writer->writer_id)];
  if (change.writer->sequence != last + 1) {
    return absl::StrCat("chunk ", change.writer->sequence, " of writer ", change.writer->writer_id,
                        " follows chunk ", last);
  }
  last = change.writer->sequence;
  const CurveSet sent = ChunkPoints(WriterOf(change.writer->writer_id), last);
  const CurveSet added = sent & ~state.points;
  state.points |= sent;
  PointCounts counts = state.record.counts;
  counts.received += CountOf(sent);
  counts.outside += CountOf(added);
  counts.duplicate += CountOf(sent) - CountOf(added);
  if (record.counts != counts) return "its record has incorrect point counts";
  if (!HasSize(record, state.points)) return "its record has an incorrect number of vertices";
  switch (change.vertex_change) {
    case VertexChange::kNone:
      if (added != 0) return "it contains none of the new vertices";
      break;
    case VertexChange::kAdded:
      if (!HasVertices(change, added)) return "it adds different vertices than those sent";
      break;
    case VertexChange::kReplaced:
      if (!HasVertices(change, state.points)) return "its vertices are not those of the hull";
      break;
  }
  const uint64_t revision = added == 0 ? state.record.revision : change.revision;
  if (record.revision != revision) return "its record has a different revision";
  state.revision = revision;
  state.record = record;
  return {};
}

bool Ledger::IsCurrentAt(size_t hull, size_t index, uint64_t revision) const {
  const std::vector<State>& states = states_[hull];
  const uint64_t own = states[index].revision;
  // Chunks without new vertices share the revision of the state that they were added to.
  size_t next = index + 1;
  while (next < states.size() && states[next].revision == own) ++next;
  return own <= revision && (next == states.size() || states[next].revision > revision);
}

void Ledger::Report(size_t hull, size_t index) {
  reported_.states[hull] = std::max(reported_.states[hull], index);
  ReportRevision(states_[hull][index].revision);
}

void Ledger::ReportRevision(uint64_t revision) {
  reported_.revision = std::max(reported_.revision, revision);
}

bool Ledger::Claim(size_t hull, size_t index) {
  return !std::exchange(states_[hull][index].is_claimed, true);
}

std::optional<std::string> Ledger::Unclaimed() const {
  for (size_t hull = 0; hull < kHulls; ++hull) {
    for (const State& state : states_[hull]) {
      if (state.is_claimed) continue;
      return absl::StrCat("the store has a change of hull ", HullName(hull),
                          " whose call was refused: ", Describe(state), "\n", Describe(hull));
    }
  }
  return std::nullopt;
}

std::string Ledger::Describe(const State& state) {
  std::string text = absl::StrCat(state.exists    ? "hull of "
                                  : state.is_body ? "body of "
                                                  : "none, of ",
                                  state.record.create_revision, " at ", state.revision, ", points ",
                                  absl::Hex(state.points), ", received ",
                                  state.record.counts.received, ", sequences");
  for (const uint64_t sequence : state.sequences) absl::StrAppend(&text, " ", sequence);
  return text;
}

std::string Ledger::Describe(size_t hull) const {
  std::string text = absl::StrCat("hull ", HullName(hull), " has the stored states:");
  for (const State& state : states_[hull]) absl::StrAppend(&text, "\n  ", Describe(state));
  return text;
}

}  // namespace hulld::server
