#ifndef HULLD_TESTS_SERVER_SCHEDULES_LEDGER_H_
#define HULLD_TESTS_SERVER_SCHEDULES_LEDGER_H_

#include <absl/strings/str_cat.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "server/store/store.h"
#include "tests/server/schedules/curve_points.h"

namespace hulld::server {

// Hulls (any may be a body) and writers of a schedule, by number.
inline constexpr size_t kHulls = 2;
inline constexpr size_t kWriters = 2;
std::string HullName(size_t hull);
std::string WriterName(size_t writer);

// Returns the points that a writer sends as its chunk of this sequence, to any hull and any number
// of times.
CurveSet ChunkPoints(size_t writer, uint64_t sequence);

// The specification: all changes that the store accepted, as states of sequential hulls. The store
// determines when a change takes effect. An answer is correct if a state between the call and the
// answer explains it, and no newer state was reported before the call.
class Ledger {
 public:
  // A hull after a change of it.
  struct State {
    bool exists = false;
    // True if the ID belongs to a body; then no hull exists.
    bool is_body = false;
    // Record of the existing or deleted hull; for a body, only its revisions.
    HullRecord record;
    // Revision of the store when readers last saw the hull change.
    uint64_t revision = 0;
    CurveSet points = 0;
    std::array<uint64_t, kWriters> sequences{};
    // True if a call was acknowledged to have made this change, or no call waits for it.
    bool is_claimed = false;
  };
  // The start of a call: the oldest states that may answer it.
  struct Moment {
    std::array<size_t, kHulls> states{};
    uint64_t revision = 0;
  };
  using Explains = std::function<bool(const State&)>;

  Ledger();

  // Records a change that the store accepted. Returns its fault, if any. nobody_waits: the call
  // that made the change will not be answered.
  std::optional<std::string> Keep(const Change& change, bool nobody_waits);

  // Revision of the store at the last change.
  uint64_t revision() const { return revision_; }
  const State& Last(size_t hull) const { return states_[hull].back(); }
  const State& At(size_t hull, size_t index) const { return states_[hull][index]; }
  size_t size(size_t hull) const { return states_[hull].size(); }

  Moment Now() const { return reported_; }
  // Returns the first state since the moment that explains an answer.
  template <typename Predicate>
  std::optional<size_t> Find(size_t hull, const Moment& since, const Predicate& explains) const {
    for (size_t i = since.states[hull]; i < states_[hull].size(); ++i) {
      if (explains(states_[hull][i])) return i;
    }
    return std::nullopt;
  }
  // Like Find, but restricted to the states current at a revision of the store.
  template <typename Predicate>
  std::optional<size_t> FindAt(size_t hull, const Moment& since, uint64_t revision,
                               const Predicate& explains) const {
    for (size_t i = since.states[hull]; i < states_[hull].size(); ++i) {
      if (IsCurrentAt(hull, i, revision) && explains(states_[hull][i])) return i;
    }
    return std::nullopt;
  }

  // Record that a state or a revision was reported: later calls are answered from no older one.
  void Report(size_t hull, size_t index);
  void ReportRevision(uint64_t revision);
  // Records that a call was acknowledged to have made this change. Returns false if another call
  // already was.
  bool Claim(size_t hull, size_t index);
  // Returns a change that the store accepted but that no call was acknowledged to have made.
  std::optional<std::string> Unclaimed() const;

  static std::string Describe(const State& state);
  // Returns all states of a hull.
  std::string Describe(size_t hull) const;

 private:
  bool IsCurrentAt(size_t hull, size_t index, uint64_t revision) const;
  std::string KeepEnd(const Change& change, State& state);
  std::string KeepBeginning(const Change& change, State& state);
  std::string KeepChunk(const Change& change, State& state);
  std::string KeepBody(const Change& change, State& state);

  std::array<std::vector<State>, kHulls> states_;
  uint64_t revision_ = 0;
  Moment reported_;
};

}  // namespace hulld::server

#endif  // HULLD_TESTS_SERVER_SCHEDULES_LEDGER_H_
