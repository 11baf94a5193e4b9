#include "tests/server/harness/history/hull_history.h"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_join.h>

#include <algorithm>
#include <chrono>
#include <optional>
#include <set>
#include <unordered_set>
#include <utility>

#include "core/base/check.h"
#include "tests/server/harness/history/hull_specification.h"

namespace hulld::server {
namespace {

using Kind = Operation::Kind;
using Outcome = Operation::Outcome;

bool IsOptional(const Operation& operation) { return operation.outcome == Outcome::kUnknown; }

const char* Name(Kind kind) {
  constexpr const char* kNames[] = {"create", "open",     "append", "replace", "delete",
                                    "get",    "mesh",     "probe",  "pair",    "version",
                                    "put",    "get body", "ask",    "batch"};
  return kNames[static_cast<int>(kind)];
}

std::string Describe(const Operation& operation) {
  constexpr const char* kOutcomes[] = {"ok", "not found", "already exists", "aborted", "unknown"};
  std::string text = absl::StrCat(Name(operation.kind), " [", operation.invoked, ", ",
                                  operation.returned == UINT64_MAX ? 0 : operation.returned, "] ",
                                  kOutcomes[static_cast<int>(operation.outcome)], ", revision ",
                                  operation.revision, ", created at ", operation.create_revision);
  for (const Seen& other : operation.others) {
    absl::StrAppend(&text, ", with ", other.hull_id, " at revision ", other.revision);
    if (other.is_missing) absl::StrAppend(&text, " (missing)");
    if (!other.missing_piece.empty()) absl::StrAppend(&text, " (lacks ", other.missing_piece, ")");
    if (other.lacks_answer) absl::StrAppend(&text, " (without an answer)");
    if (other.probed == 0) continue;
    absl::StrAppend(&text, " touching ", absl::Hex(other.touched), " of ", absl::Hex(other.probed));
  }
  if (!operation.pieces.empty()) {
    absl::StrAppend(&text, ", pieces ", absl::StrJoin(operation.pieces, " "));
  }
  if (operation.kind == Kind::kBodyQuery) {
    absl::StrAppend(&text, ", point ", operation.probe, operation.touching ? " touched" : " apart",
                    ", missing ", operation.missing);
  }
  if (operation.if_revision) absl::StrAppend(&text, ", if_revision ", *operation.if_revision);
  if (operation.kind == Kind::kAppend || operation.kind == Kind::kOpen) {
    absl::StrAppend(&text, ", writer ", operation.writer, ", sequence ", operation.sequence,
                    ", last ", operation.last_sequence);
  }
  absl::StrAppend(&text, ", points ", absl::Hex(operation.points), ", received ",
                  operation.received);
  if (operation.max_staleness != 0) {
    absl::StrAppend(&text, ", of store revision ", operation.store_revision, " and ",
                    operation.staleness, " ns ago");
  }
  return text;
}

// Returns true if the operation concerns several hulls or bodies.
bool IsJoint(const Operation& operation) {
  return operation.kind == Kind::kPair || operation.kind == Kind::kBodyQuery ||
         operation.kind == Kind::kBatch;
}

// Returns the earliest time at which a call may have taken effect.
uint64_t EarliestOf(const Operation& operation) {
  // A "not found" answer does not state its age.
  const std::optional<uint64_t> back =
      operation.outcome == Outcome::kOk ? operation.staleness : operation.max_staleness;
  if (!back.has_value() || *back > operation.invoked) return 0;
  return operation.invoked - *back;
}

// Returns the store revision at which an answered operation changed the hull; 0 if it changed
// nothing or the answer does not say.
uint64_t ChangedAt(const Operation& operation) {
  if (operation.outcome != Outcome::kOk) return 0;
  switch (operation.kind) {
    case Kind::kAppend:
      // If one ack covers several chunks, any of them may have changed the hull.
      if (operation.shares_later_ack || operation.covers_earlier_chunks) return 0;
      return operation.already_applied || operation.outside == 0 ? 0 : operation.revision;
    case Kind::kDelete:
      return operation.store_revision;
    case Kind::kCreate:
    case Kind::kReplace:
      return operation.kind == Kind::kReplace || operation.created ? operation.revision : 0;
    case Kind::kPut:
      return operation.revision;
    default:
      return 0;
  }
}

// Returns the inconsistency in an answer's own freshness, or empty.
std::string FreshnessFault(const Operation& operation) {
  if (!IsRead(operation) || operation.outcome != Outcome::kOk) return "";
  if (operation.max_staleness.has_value() && operation.staleness > *operation.max_staleness) {
    return absl::StrCat("an answer of ", operation.staleness,
                        " ns ago, requested with a staleness of at most ", *operation.max_staleness,
                        " ns: ", Describe(operation));
  }
  if (operation.store_revision < operation.at_least_revision) {
    return absl::StrCat("an answer of revision ", operation.store_revision,
                        " of the store, requested with at least revision ",
                        operation.at_least_revision, ": ", Describe(operation));
  }
  for (const Seen& other : operation.others) {
    if (other.store_revision > 0 && other.revision > other.store_revision) {
      return absl::StrCat("an answer of revision ", other.store_revision, " of the store of ",
                          other.hull_id, " contains a later one: ", Describe(operation));
    }
    // The store of a missing object may be unknown.
    const bool is_there = !other.is_missing && other.missing_piece.empty();
    if (other.store_revision == 0 && !is_there) continue;
    if (other.store_revision >= other.at_least_revision) continue;
    return absl::StrCat("an answer of revision ", other.store_revision, " of the store of ",
                        other.hull_id, ", requested with at least revision ",
                        other.at_least_revision, ": ", Describe(operation));
  }
  return "";
}

// Number of operations shown before the unexplained ones.
constexpr size_t kReported = 40;

// Depth-first search for a linearization, over operations sorted by invocation.
class OrderSearch {
 public:
  explicit OrderSearch(const std::map<std::string, std::vector<Operation>>& operations) {
    for (const auto& [hull_id, of_hull] : operations) {
      const size_t hull = NumberOf(hull_id);
      for (const Operation& operation : of_hull) {
        operations_.push_back({operation, hull});
        for (const Seen& other : operation.others) NumberOf(other.hull_id);
        for (const std::string& piece : operation.pieces) NumberOf(piece);
      }
    }
    done_.assign(operations_.size(), false);
    for (Placed& operation : operations_) {
      if (IsRead(operation)) operation.invoked = EarliestOf(operation);
    }
    std::sort(operations_.begin(), operations_.end(),
              [](const Operation& a, const Operation& b) { return a.invoked < b.invoked; });
    required_ = static_cast<size_t>(std::count_if(
        operations_.begin(), operations_.end(), [](const Operation& o) { return !IsOptional(o); }));
  }

  bool Run() {
    bool found = Enter(State(hulls_.size()), 0, 0);
    while (!found && !path_.empty()) found = TryNext();
    return found;
  }

  // Returns the longest order found and the operations that could not follow it.
  std::string Fault() const {
    std::string fault = absl::StrCat("no order explains more than ", best_count_, " of ", required_,
                                     " answers; the hull was then ", KeyOf(best_state_),
                                     "; none of these follows:");
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
  // An operation and the number of its hull.
  struct Placed : Operation {
    size_t hull = 0;
  };
  // State of each hull.
  using State = std::vector<SpecifiedHull>;

  static std::string KeyOf(const State& state) {
    std::string key;
    for (const SpecifiedHull& hull : state) absl::StrAppend(&key, hull.Key(), "|");
    return key;
  }

  // A state of the hulls on a partial order of the operations.
  struct Node {
    State state;
    // Answered operations so far.
    size_t count = 0;
    // Latest invocation so far.
    uint64_t latest = 0;
    std::vector<size_t> candidates;
    size_t next = 0;
    // Candidate that led to the next node.
    std::optional<size_t> taken;
    // Previous first_left_ and last_done_.
    size_t first_before = 0;
    size_t last_before = 0;
  };

  size_t NumberOf(const std::string& hull_id) {
    return hulls_.emplace(hull_id, hulls_.size()).first->second;
  }

  // Returns true if an unanswered operation can no longer take effect, because an operation invoked
  // after its end, at tick `latest`, has.
  bool IsTooLate(size_t i, uint64_t latest) const {
    return IsOptional(operations_[i]) && operations_[i].returned < latest;
  }

  // Returns the operations that may come next: those invoked before any other remaining operation
  // returned.
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
    // Operations that returned first most likely took effect first; lost ones most likely never
    // did.
    std::stable_sort(candidates.begin(), candidates.end(), [this](size_t a, size_t b) {
      const auto rank = [this](size_t i) {
        return std::pair(IsOptional(operations_[i]), operations_[i].returned);
      };
      return rank(a) < rank(b);
    });
    return candidates;
  }

  // Returns true if a read follows all changes that it must contain, and a change follows all
  // changes of the same store with lower revisions.
  bool ContainsAll(size_t i) const {
    const Placed& operation = operations_[i];
    const bool is_read = IsRead(operation);
    const uint64_t revision = is_read
                                  ? std::max(operation.store_revision, operation.at_least_revision)
                                  : ChangedAt(operation);
    if (!is_read && revision == 0) return true;
    for (size_t j = first_left_; j < operations_.size(); ++j) {
      const uint64_t changed_at = done_[j] ? 0 : ChangedAt(operations_[j]);
      if (changed_at == 0) continue;
      const size_t hull = operations_[j].hull;
      if (!is_read) {
        if (changed_at < revision && operations_[j].store_id == operation.store_id) return false;
        continue;
      }
      if (hull == operation.hull && changed_at <= revision) return false;
      for (const Seen& other : operation.others) {
        const uint64_t least = std::max(other.store_revision, other.at_least_revision);
        if (hull == hulls_.at(other.hull_id) && changed_at <= least) return false;
      }
    }
    return true;
  }

  // Applies an operation to `state`. Returns false if the specification forbids the answer.
  bool StepAll(State& state, const Placed& operation) const {
    if (!IsJoint(operation)) return Step(state[operation.hull], operation);
    return StepJoint(
        state[operation.hull], operation,
        [&](const std::string& hull_id) -> SpecifiedHull& { return state[hulls_.at(hull_id)]; });
  }

  // Returns true if the candidate may come next without branching: a read that fits, leaves the
  // state unchanged, and makes no unanswered call too late.
  bool NeedsNoBranching(size_t i, const Node& node) const {
    const Placed& read = operations_[i];
    if (!IsRead(read) || !ContainsAll(i)) return false;
    for (size_t j = first_left_; j < operations_.size() && operations_[j].invoked <= read.invoked;
         ++j) {
      if (!done_[j] && !IsTooLate(j, node.latest) && IsTooLate(j, read.invoked)) return false;
    }
    State after = node.state;
    return StepAll(after, read) && KeyOf(after) == KeyOf(node.state);
  }

  std::string Key(const State& state) const {
    std::string key = absl::StrCat(KeyOf(state), ";", first_left_);
    // Beyond the first remaining operation, only completed ones matter.
    for (size_t i = first_left_; i < operations_.size() && i <= last_done_; ++i) {
      if (done_[i]) absl::StrAppend(&key, ",", i);
    }
    return key;
  }

  // Appends a state to the path, with its candidates. Returns true if it explains everything.
  bool Enter(State state, size_t count, uint64_t latest) {
    if (count == required_) return true;
    Node node{std::move(state), count, latest, {}, 0, std::nullopt, first_left_, last_done_};
    while (first_left_ < operations_.size() &&
           (done_[first_left_] || IsTooLate(first_left_, latest))) {
      ++first_left_;
    }
    if (seen_.insert(Key(node.state)).second) {
      node.candidates = Candidates(latest);
      for (const size_t i : node.candidates) {
        if (!NeedsNoBranching(i, node)) continue;
        node.candidates = {i};
        break;
      }
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

  // Tries the next candidate of the path's last state, or pops the state if it has none. Returns
  // true if everything is explained.
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
    if (!ContainsAll(i) || !StepAll(next, operations_[i])) return false;
    done_[i] = true;
    last_done_ = std::max(last.last_before, i);
    last.taken = i;
    return Enter(std::move(next), last.count + !IsOptional(operations_[i]),
                 std::max(last.latest, operations_[i].invoked));
  }

  // By ID.
  std::map<std::string, size_t> hulls_;
  std::vector<Placed> operations_;
  std::vector<bool> done_;
  size_t required_ = 0;
  size_t first_left_ = 0;
  size_t last_done_ = 0;
  // An explicit stack: a history may be longer than the call stack allows.
  std::vector<Node> path_;
  std::unordered_set<std::string> seen_;
  size_t best_count_ = 0;
  State best_state_;
  std::vector<size_t> best_candidates_;
  std::vector<bool> best_done_;
};

// Returns the inconsistency in the store's revisions across all hulls, or empty.
std::string StoreRevisionFault(const HullHistory& history, const std::string& store_id) {
  std::vector<std::pair<uint64_t, uint64_t>> returned;  // time and revision
  std::vector<std::pair<uint64_t, uint64_t>> invoked;
  std::map<uint64_t, std::string> changes;
  for (const auto& [hull_id, operations] : history.operations()) {
    for (const Operation& operation : operations) {
      if (operation.outcome != Outcome::kOk || operation.store_id != store_id) continue;
      returned.push_back({operation.returned, operation.store_revision});
      invoked.push_back({EarliestOf(operation), operation.store_revision});
      const uint64_t revision = ChangedAt(operation);
      if (revision == 0) continue;
      const auto [other, inserted] = changes.emplace(revision, hull_id);
      if (!inserted) {
        return absl::StrCat("revision ", revision, " belongs to a change of ", other->second,
                            " and to one of ", hull_id);
      }
      if (operation.store_revision < revision) {
        return absl::StrCat("the store reported revision ", operation.store_revision,
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
      return absl::StrCat("the store reported revision ", revision, " at tick ", tick,
                          " after it reported ", greatest);
    }
  }
  return "";
}

}  // namespace

uint64_t HullHistory::Tick() {
  const auto now = std::chrono::steady_clock::now().time_since_epoch();
  const auto time = static_cast<uint64_t>(std::chrono::nanoseconds(now).count());
  uint64_t last = clock_;
  while (!clock_.compare_exchange_weak(last, std::max(last + 1, time))) {
  }
  return std::max(last + 1, time);
}

void HullHistory::Record(const std::string& hull_id, const Operation& operation) {
  HULLD_CHECK(operation.invoked < operation.returned);
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
  return JointLinearizabilityFault({{"", std::move(operations)}});
}

std::string JointLinearizabilityFault(
    const std::map<std::string, std::vector<Operation>>& operations) {
  for (const auto& [hull_id, of_hull] : operations) {
    for (const Operation& operation : of_hull) {
      const std::string fault = FreshnessFault(operation);
      if (!fault.empty()) return fault;
    }
  }
  OrderSearch search(operations);
  return search.Run() ? "" : search.Fault();
}

std::string HistoryFault(const HullHistory& history) {
  bool is_joint = false;
  std::set<std::string> store_ids;
  for (const auto& [hull_id, operations] : history.operations()) {
    for (const Operation& operation : operations) {
      is_joint |= IsJoint(operation);
      if (operation.outcome == Outcome::kOk) store_ids.insert(operation.store_id);
    }
  }
  if (is_joint) {
    const std::string fault = JointLinearizabilityFault(history.operations());
    if (!fault.empty()) return fault;
  } else {
    for (const auto& [hull_id, operations] : history.operations()) {
      const std::string fault = LinearizabilityFault(operations);
      if (!fault.empty()) return absl::StrCat("hull ", hull_id, ": ", fault);
    }
  }
  for (const std::string& store_id : store_ids) {
    const std::string fault = StoreRevisionFault(history, store_id);
    if (!fault.empty()) return fault;
  }
  return "";
}

}  // namespace hulld::server
