#ifndef HULLD_TESTS_SERVER_SCHEDULES_CLIENT_H_
#define HULLD_TESTS_SERVER_SCHEDULES_CLIENT_H_

#include <absl/status/statusor.h>

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "tests/server/schedules/simulation.h"

namespace hulld::server {

// Makes random calls to the registry, and ends the schedule at an answer that the ledger does not
// explain.
class Client {
 public:
  explicit Client(Simulation& simulation) : simulation_(simulation) {}

  // A few sequential calls.
  static constexpr uint32_t kMaxCalls = 3;
  void Run();

  // Checks the answers of a reopened registry against the contents of the store.
  void CheckAll();

 private:
  // A call, with the state when it began.
  struct Call {
    size_t hull = 0;
    Ledger::Moment since;
    uint64_t failures_before = 0;
    std::optional<uint64_t> if_revision;
    // True if the call was stopped.
    std::shared_ptr<bool> was_stopped = std::make_shared<bool>(false);
  };
  struct Stream;

  Random& random() { return Scheduler::Current().random(); }
  Ledger& ledger() { return simulation_.ledger(); }
  size_t AnyHull() { return random().Below(static_cast<uint32_t>(simulation_.plan.hulls)); }
  Call Begin(size_t hull);
  std::function<bool()> StopOf(const Call& call);
  std::optional<uint64_t> AnyCondition(size_t hull);
  [[noreturn]] void Fail(const Call& call, const std::string& what);

  // Waits for the answer and checks it on arrival.
  template <typename T, typename Send, typename Check>
  void Await(const Send& send, const Check& check);
  // Returns true if this error may occur at any time; otherwise ends the schedule.
  bool MayFail(const Call& call, const absl::Status& status, bool may_be_stopped);
  void CheckNotFound(const Call& call);
  void CheckAborted(const Call& call);
  // Claims a change that this call was acknowledged to have made.
  void Claim(const Call& call, std::optional<size_t> state, const std::string& what);

  void Create();
  void Delete();
  void Replace();
  void List();
  bool AwaitFresh(const Freshness& freshness);
  void Read();
  void UseBodies();
  void PutBody();
  void DeleteBody();
  void FindBodies();
  void ListBodies();
  void CheckBody(const Call& call, std::optional<uint64_t> revision,
                 const std::optional<HullChange>& body);
  // Returns true if the ID may have belonged to the other kind.
  bool MayBeOther(const Call& call, const absl::Status& status, bool is_body);
  void Press();

  void CheckView(const Call& call, uint64_t revision, const absl::StatusOr<HullView>& view);
  void CheckServed(const Call& call, const Ledger::State& state, const HullView& view);
  void MakeCanonical(const Call& call, const HullView& view);

  void AppendStream();
  bool OpenStream(const std::shared_ptr<Stream>& stream, bool create_if_absent);
  void CheckOpened(const Call& call, Stream& stream, const OpenResult& result);
  void SendChunk(const std::shared_ptr<Stream>& stream, uint64_t sequence);
  void CheckChunk(const Call& call, const Stream& stream, uint64_t sequence,
                  const absl::StatusOr<ChunkResult>& result);
  void CheckApplied(const Call& call, const Stream& stream, uint64_t sequence,
                    const ChunkResult& result);
  void CheckRefused(const Call& call, const Stream& stream, const absl::Status& status);
  void CheckOrder(const Stream& stream);
  void CheckSequences(size_t hull);

  Simulation& simulation_;
  // Its knowledge of all hulls of the plan.
  KnownHulls known_;
};

template <typename T, typename Send, typename Check>
void Client::Await(const Send& send, const Check& check) {
  const auto answered = std::make_shared<Event>();
  send([answered, check](const absl::StatusOr<T>& result) {
    if (answered->is_set()) Scheduler::Current().Fail("a call is answered twice");
    check(result);
    answered->Set();
  });
  answered->Wait();
  ++simulation_.reached.answers;
}

}  // namespace hulld::server

#endif  // HULLD_TESTS_SERVER_SCHEDULES_CLIENT_H_
