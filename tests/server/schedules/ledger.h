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

// The hulls, any of which may be a body, and the writers of a schedule, by number.
inline constexpr size_t kHulls = 2;
inline constexpr size_t kWriters = 2;
std::string HullName(size_t hull);
std::string WriterName(size_t writer);

// What a writer sends as its chunk of this sequence, to whatever hull and however often.
CurveSet ChunkPoints(size_t writer, uint64_t sequence);

// The specification: all that the store kept, as the states of hulls that do one thing at a time.
// The store says when a change takes effect, so an answer is right if one of the states between the
// call and its answer explains it, none of which is older than what anyone was told before.
class Ledger {
 public:
  // A hull after a change of it.
  struct State {
    bool exists = false;
    // There is a body under the ID; then no hull exists.
    bool is_body = false;
    // The record of the hull that is there, or that went; for a body, its revisions alone.
    HullRecord record;
    // The store's, when the hull last became another for readers.
    uint64_t revision = 0;
    CurveSet points = 0;
    std::array<uint64_t, kWriters> sequences{};
    // A call was told that it made this change; or nobody waits for that any more.
    bool is_claimed = false;
  };
  // When a call began: the oldest states that it may be answered from.
  struct Moment {
    std::array<size_t, kHulls> states{};
    uint64_t revision = 0;
  };
  using Explains = std::function<bool(const State&)>;

  Ledger();

  // The store keeps a change. Returns what is wrong with it, if anything. nobody_waits: the call
  // that made it will not be answered.
  std::optional<std::string> Keep(const Change& change, bool nobody_waits);

  // The store's revision at the last change.
  uint64_t revision() const { return revision_; }
  const State& Last(size_t hull) const { return states_[hull].back(); }
  const State& At(size_t hull, size_t index) const { return states_[hull][index]; }
  size_t size(size_t hull) const { return states_[hull].size(); }

  Moment Now() const { return told_; }
  // The first state since the moment that explains an answer.
  template <typename Predicate>
  std::optional<size_t> Find(size_t hull, const Moment& since, const Predicate& explains) const {
    for (size_t i = since.states[hull]; i < states_[hull].size(); ++i) {
      if (explains(states_[hull][i])) return i;
    }
    return std::nullopt;
  }
  // The same, of what is current at a revision of the store.
  template <typename Predicate>
  std::optional<size_t> FindAt(size_t hull, const Moment& since, uint64_t revision,
                               const Predicate& explains) const {
    for (size_t i = since.states[hull]; i < states_[hull].size(); ++i) {
      if (IsCurrentAt(hull, i, revision) && explains(states_[hull][i])) return i;
    }
    return std::nullopt;
  }

  // Somebody was told of a state, or of a revision: later calls are answered from no older one.
  void Tell(size_t hull, size_t index);
  void TellRevision(uint64_t revision);
  // Somebody was told to have made this change. False: another was told so before.
  bool Claim(size_t hull, size_t index);
  // A change that the store kept, and of which nobody was told that it was made.
  std::optional<std::string> Unclaimed() const;

  static std::string Describe(const State& state);
  // All states of a hull.
  std::string Describe(size_t hull) const;

 private:
  bool IsCurrentAt(size_t hull, size_t index, uint64_t revision) const;
  std::string KeepEnd(const Change& change, State& state);
  std::string KeepBeginning(const Change& change, State& state);
  std::string KeepChunk(const Change& change, State& state);
  std::string KeepBody(const Change& change, State& state);

  std::array<std::vector<State>, kHulls> states_;
  uint64_t revision_ = 0;
  Moment told_;
};

}  // namespace hulld::server

#endif  // HULLD_TESTS_SERVER_SCHEDULES_LEDGER_H_
