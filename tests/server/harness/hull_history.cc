#include "tests/server/harness/hull_history.h"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <bit>
#include <optional>
#include <unordered_set>
#include <utility>

namespace hulld::server {
namespace {

using Kind = Operation::Kind;
using Outcome = Operation::Outcome;

// One hull as the specification has it.
struct State {
  bool exists = false;
  uint64_t create_revision = 0;
  // Of the last change, a deletion included. When not known: a change whose answer was lost gave
  // it a greater one, which the next answer tells.
  uint64_t revision = 0;
  bool revision_known = true;
  bool create_revision_known = true;
  // Whether vertices came since its creation: until then both revisions are the same.
  bool grown = false;
  PointSet points = 0;
  uint64_t received = 0;
  uint64_t outside = 0;
  uint64_t duplicate = 0;
  std::map<std::string, uint64_t> writers;

  uint64_t LastSequence(const std::string& writer) const {
    const auto found = writers.find(writer);
    return found == writers.end() ? 0 : found->second;
  }

  std::string Key() const {
    std::string key = absl::StrCat(exists, ",", create_revision, ",", create_revision_known, ",",
                                   revision, ",", revision_known, ",", grown, ",", points, ",",
                                   received, ",", outside, ",", duplicate);
    for (const auto& [writer, sequence] : writers)
      absl::StrAppend(&key, ",", writer, ":", sequence);
    return key;
  }
};

bool AgreeOnIncarnation(State& state, uint64_t create_revision) {
  if (!state.create_revision_known) {
    state.create_revision = create_revision;
    state.create_revision_known = true;
  }
  return state.create_revision == create_revision;
}

// Whether an answer may say that the hull is at this revision; from then on it is.
bool Agree(State& state, uint64_t revision) {
  if (state.revision_known) return state.revision == revision;
  if (revision <= state.revision) return false;
  if (!state.grown && !AgreeOnIncarnation(state, revision)) return false;
  state.revision = revision;
  state.revision_known = true;
  return true;
}

// A change that was answered with this revision, or, when lost, had a later one than before.
bool Advance(State& state, const Operation& operation, uint64_t revision) {
  if (operation.outcome == Outcome::kUnknown) {
    state.revision_known = false;
    return true;
  }
  if (revision <= state.revision) return false;
  state.revision = revision;
  state.revision_known = true;
  return true;
}

// A new incarnation, of no points, in the place of whatever there was.
bool Create(State& state, const Operation& operation) {
  const uint64_t revision = state.revision;
  const bool known = state.revision_known;
  state = State();
  state.revision = revision;
  state.revision_known = known;
  if (!Advance(state, operation, operation.create_revision)) return false;
  state.exists = true;
  state.create_revision = state.revision;
  state.create_revision_known = state.revision_known;
  return true;
}

// Whether the condition may have failed. A lost answer leaves open which revision it is.
bool Mismatch(const State& state, const Operation& operation) {
  if (!operation.if_revision) return false;
  return !state.revision_known || *operation.if_revision != state.revision;
}

// Whether the condition may have held.
bool Match(const State& state, const Operation& operation) {
  if (!operation.if_revision) return true;
  return state.revision_known ? *operation.if_revision == state.revision
                              : *operation.if_revision > state.revision;
}

bool SameCounts(const State& state, const Operation& operation) {
  return operation.received == state.received && operation.outside == state.outside &&
         operation.duplicate == state.duplicate &&
         operation.vertex_count == static_cast<uint64_t>(std::popcount(state.points));
}

bool StepCreateOrOpen(State& state, const Operation& operation) {
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
  // The opening of a stream does not say whether it created the hull; that there was none does.
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

bool StepAppend(State& state, const Operation& operation) {
  if (!state.exists || !AgreeOnIncarnation(state, operation.incarnation)) return false;
  const uint64_t last = state.LastSequence(operation.writer);
  if (operation.outcome == Outcome::kOk && operation.already_applied) {
    return operation.sequence <= last && Agree(state, operation.revision);
  }
  if (operation.sequence != last + 1) return false;
  if (operation.outcome == Outcome::kAborted) return Mismatch(state, operation);
  if (!Match(state, operation)) return false;
  const PointSet added = operation.points & ~state.points;
  const uint64_t outside = static_cast<uint64_t>(std::popcount(added));
  const bool lost = operation.outcome == Outcome::kUnknown;
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
  return operation.received == operation.sent && operation.outside == outside &&
         operation.duplicate == operation.sent - outside &&
         operation.vertex_count == static_cast<uint64_t>(std::popcount(state.points));
}

// One change, in which the hull is never without the new points or with others.
bool StepReplace(State& state, const Operation& operation) {
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

bool StepDelete(State& state, const Operation& operation) {
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

bool StepRead(State& state, const Operation& operation) {
  if (operation.outcome == Outcome::kNotFound) return !state.exists;
  if (operation.outcome != Outcome::kOk || !state.exists) return false;
  if (!Agree(state, operation.revision)) return false;
  switch (operation.kind) {
    case Kind::kGet:
      return AgreeOnIncarnation(state, operation.create_revision) && SameCounts(state, operation);
    case Kind::kMesh:
      return operation.points == state.points;
    default:
      return operation.touching == ((state.points >> operation.probe & 1) != 0);
  }
}

// Whether the hull may answer so; if so, `state` is what it is then.
bool Step(State& state, const Operation& operation) {
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
      return StepRead(state, operation);
  }
  return false;
}

bool IsOptional(const Operation& operation) { return operation.outcome == Outcome::kUnknown; }

const char* Name(Kind kind) {
  constexpr const char* kNames[] = {"create", "open", "append", "replace",
                                    "delete", "get",  "mesh",   "probe"};
  return kNames[static_cast<int>(kind)];
}

std::string Describe(const Operation& operation) {
  constexpr const char* kOutcomes[] = {"ok", "not found", "already exists", "aborted", "unknown"};
  std::string text = absl::StrCat(Name(operation.kind), " [", operation.invoked, ", ",
                                  operation.returned == UINT64_MAX ? 0 : operation.returned, "] ",
                                  kOutcomes[static_cast<int>(operation.outcome)], ", revision ",
                                  operation.revision, ", created at ", operation.create_revision);
  if (operation.if_revision) absl::StrAppend(&text, ", if_revision ", *operation.if_revision);
  if (operation.kind == Kind::kAppend || operation.kind == Kind::kOpen) {
    absl::StrAppend(&text, ", writer ", operation.writer, ", sequence ", operation.sequence,
                    ", last ", operation.last_sequence);
  }
  absl::StrAppend(&text, ", points ", absl::Hex(operation.points), ", received ",
                  operation.received);
  return text;
}

// How many operations before those that cannot be explained a fault shows.
constexpr size_t kReported = 40;

// Depth-first search for an order, over the operations sorted by invocation.
class OrderSearch {
 public:
  explicit OrderSearch(std::vector<Operation> operations)
      : operations_(std::move(operations)), done_(operations_.size(), false) {
    std::sort(operations_.begin(), operations_.end(),
              [](const Operation& a, const Operation& b) { return a.invoked < b.invoked; });
    required_ = static_cast<size_t>(std::count_if(
        operations_.begin(), operations_.end(), [](const Operation& o) { return !IsOptional(o); }));
  }

  bool Run() {
    bool found = Enter(State(), 0, 0);
    while (!found && !path_.empty()) found = TryNext();
    return found;
  }

  // The longest order found, and what could not follow it.
  std::string Fault() const {
    std::string fault =
        absl::StrCat("no order explains more than ", best_count_, " of ", required_,
                     " answers; the hull was then ", best_state_.Key(), "; none of these follows:");
    for (const size_t i : best_candidates_) {
      absl::StrAppend(&fault, "\n  ", Describe(operations_[i]));
    }
    absl::StrAppend(&fault, "\nbefore them, in the order of their calls:");
    const size_t end = best_candidates_.empty() ? operations_.size() : best_candidates_.front();
    for (size_t i = end > kReported ? end - kReported : 0; i < end; ++i) {
      absl::StrAppend(&fault, "\n  ", best_done_[i] ? "" : "(left out) ", Describe(operations_[i]));
    }
    return fault;
  }

 private:
  // A state of the hull on the way to an order of all operations.
  struct Node {
    State state;
    // Operations so far that were answered.
    size_t count = 0;
    // When the latest operation so far was invoked.
    uint64_t latest = 0;
    std::vector<size_t> candidates;
    size_t next = 0;
    // The candidate that led to the next node.
    std::optional<size_t> taken;
    // first_left_ and last_done_ before this.
    size_t first_before = 0;
    size_t last_before = 0;
  };

  // Whether an operation without an answer can no longer take effect, because one that was invoked
  // after its end, at tick `latest`, has.
  bool IsTooLate(size_t i, uint64_t latest) const {
    return IsOptional(operations_[i]) && operations_[i].returned < latest;
  }

  // The operations that may come next: those invoked before any other that is left returned.
  std::vector<size_t> Candidates(uint64_t latest) const {
    std::vector<size_t> candidates;
    uint64_t first_return = UINT64_MAX;
    for (size_t i = first_left_; i < operations_.size(); ++i) {
      if (done_[i] || IsTooLate(i, latest)) continue;
      if (operations_[i].invoked > first_return) break;
      candidates.push_back(i);
      if (!IsOptional(operations_[i])) {
        first_return = std::min(first_return, operations_[i].returned);
      }
    }
    // What returned first most likely took effect first; what was lost most likely never did.
    std::stable_sort(candidates.begin(), candidates.end(), [this](size_t a, size_t b) {
      const auto rank = [this](size_t i) {
        return std::pair(IsOptional(operations_[i]), operations_[i].returned);
      };
      return rank(a) < rank(b);
    });
    return candidates;
  }

  std::string Key(const State& state) const {
    std::string key = absl::StrCat(state.Key(), ";", first_left_);
    // Beyond the first that is left, only what has been done matters.
    for (size_t i = first_left_; i < operations_.size() && i <= last_done_; ++i) {
      if (done_[i]) absl::StrAppend(&key, ",", i);
    }
    return key;
  }

  // Puts a state at the end of the path, with what may come next. Returns whether it explains all.
  bool Enter(State state, size_t count, uint64_t latest) {
    if (count == required_) return true;
    Node node{std::move(state), count, latest, {}, 0, std::nullopt, first_left_, last_done_};
    while (first_left_ < operations_.size() &&
           (done_[first_left_] || IsTooLate(first_left_, latest))) {
      ++first_left_;
    }
    if (seen_.insert(Key(node.state)).second) {
      node.candidates = Candidates(latest);
      if (count > best_count_ || best_done_.empty()) {
        best_count_ = count;
        best_state_ = node.state;
        best_candidates_ = node.candidates;
        best_done_ = done_;
      }
    }
    path_.push_back(std::move(node));
    return false;
  }

  // Tries the next candidate of the last state of the path, or leaves it when there is none.
  // Returns whether all is explained then.
  bool TryNext() {
    Node& last = path_.back();
    if (last.taken.has_value()) {
      done_[*last.taken] = false;
      last_done_ = last.last_before;
      last.taken = std::nullopt;
    }
    if (last.next == last.candidates.size()) {
      first_left_ = last.first_before;
      path_.pop_back();
      return false;
    }
    const size_t i = last.candidates[last.next++];
    State next = last.state;
    if (!Step(next, operations_[i])) return false;
    done_[i] = true;
    last_done_ = std::max(last.last_before, i);
    last.taken = i;
    return Enter(std::move(next), last.count + !IsOptional(operations_[i]),
                 std::max(last.latest, operations_[i].invoked));
  }

  std::vector<Operation> operations_;
  std::vector<bool> done_;
  size_t required_ = 0;
  size_t first_left_ = 0;
  size_t last_done_ = 0;
  // Not the call stack: a history may be longer than that is deep.
  std::vector<Node> path_;
  std::unordered_set<std::string> seen_;
  size_t best_count_ = 0;
  State best_state_;
  std::vector<size_t> best_candidates_;
  std::vector<bool> best_done_;
};

// What is wrong with the store's revisions across all hulls.
std::string StoreRevisionFault(const HullHistory& history) {
  std::vector<std::pair<uint64_t, uint64_t>> returned;  // when, and the revision told
  std::vector<std::pair<uint64_t, uint64_t>> invoked;
  std::map<uint64_t, std::string> changes;
  for (const auto& [hull_id, operations] : history.operations()) {
    for (const Operation& operation : operations) {
      if (operation.outcome != Outcome::kOk) continue;
      returned.push_back({operation.returned, operation.store_revision});
      invoked.push_back({operation.invoked, operation.store_revision});
      const bool changed = (operation.kind == Kind::kAppend && !operation.already_applied &&
                            operation.outside > 0) ||
                           operation.kind == Kind::kReplace || operation.kind == Kind::kDelete ||
                           operation.created;
      if (!changed) continue;
      const uint64_t revision =
          operation.kind == Kind::kDelete ? operation.store_revision : operation.revision;
      const auto [other, inserted] = changes.emplace(revision, hull_id);
      if (!inserted) {
        return absl::StrCat("revision ", revision, " belongs to a change of ", other->second,
                            " and to one of ", hull_id);
      }
      if (operation.store_revision < revision) {
        return absl::StrCat("the store told revision ", operation.store_revision,
                            " with a change of revision ", revision);
      }
    }
  }
  std::sort(returned.begin(), returned.end());
  std::sort(invoked.begin(), invoked.end());
  uint64_t greatest = 0;
  auto next = returned.begin();
  for (const auto& [tick, revision] : invoked) {
    for (; next != returned.end() && next->first < tick; ++next) {
      greatest = std::max(greatest, next->second);
    }
    if (revision < greatest) {
      return absl::StrCat("the store told revision ", revision, " at tick ", tick,
                          " after it told ", greatest);
    }
  }
  return "";
}

}  // namespace

void HullHistory::Record(const std::string& hull_id, const Operation& operation) {
  const std::lock_guard lock(mutex_);
  operations_[hull_id].push_back(operation);
}

void HullHistory::Settle() {
  const std::lock_guard lock(mutex_);
  const uint64_t now = Tick();
  for (auto& [hull_id, operations] : operations_) {
    for (Operation& operation : operations) {
      if (operation.outcome == Outcome::kUnknown)
        operation.returned = std::min(operation.returned, now);
    }
  }
}

size_t HullHistory::size() const {
  size_t count = 0;
  for (const auto& [hull_id, operations] : operations_) count += operations.size();
  return count;
}

std::string LinearizabilityFault(std::vector<Operation> operations) {
  OrderSearch search(std::move(operations));
  return search.Run() ? "" : search.Fault();
}

std::string HistoryFault(const HullHistory& history) {
  for (const auto& [hull_id, operations] : history.operations()) {
    const std::string fault = LinearizabilityFault(operations);
    if (!fault.empty()) return absl::StrCat("hull ", hull_id, ": ", fault);
  }
  return StoreRevisionFault(history);
}

}  // namespace hulld::server
