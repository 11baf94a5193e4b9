#include "client/hullctl/pairs/batch_answers.h"

#include <cstdint>
#include <unordered_map>

namespace hulld {
namespace {

class BatchAnswers {
 public:
  BatchAnswers(const v1::BatchCheckCollisionsRequest& request, const PairReceiver& receive)
      : request_(request), receive_(receive) {}

  absl::Status Take(const v1::BatchCheckCollisionsResponse& part) {
    for (const v1::PlacementProblem& problem : part.placement_problems()) {
      placement_problems_[problem.placement()] = problem.message();
    }
    for (const v1::PairProblem& problem : part.columns().pair_problems()) {
      pair_problems_[part.first_pair() + problem.row()] = problem.message();
    }
    const auto count = static_cast<size_t>(part.columns().relations_size());
    if (count == 0) return absl::OkStatus();
    if (part.first_pair() != next_ || count > pairs() - next_ ||
        !AreParallel(part.columns(), count)) {
      return absl::InternalError("the answers are out of order");
    }
    for (size_t i = 0; i < count; ++i, ++next_) {
      const AnswerRow row = RowAt(part.columns(), static_cast<int>(i));
      const bool is_answered = row.relation != v1::RELATION_UNSPECIFIED;
      const absl::Status status = receive_(next_, row, is_answered ? nullptr : FindProblem(next_));
      if (!status.ok()) return status;
    }
    return absl::OkStatus();
  }

  // INTERNAL unless every pair was answered.
  absl::Status Finish() const {
    if (next_ == pairs()) return absl::OkStatus();
    return absl::InternalError("the answers end before the last pair");
  }

 private:
  // Problems by placement or by pair.
  using Problems = std::unordered_map<uint64_t, std::string>;

  size_t pairs() const { return static_cast<size_t>(request_.pairs_size()) / 2; }

  const std::string* FindProblem(size_t pair) const {
    static const auto* const kUnknown = new std::string("the server gave no reason");
    if (const auto found = pair_problems_.find(pair); found != pair_problems_.end()) {
      return &found->second;
    }
    for (const size_t side : {2 * pair, 2 * pair + 1}) {
      const auto found = placement_problems_.find(request_.pairs(static_cast<int>(side)));
      if (found != placement_problems_.end()) return &found->second;
    }
    return kUnknown;
  }

  const v1::BatchCheckCollisionsRequest& request_;
  const PairReceiver& receive_;
  Problems placement_problems_;
  Problems pair_problems_;
  size_t next_ = 0;
};

}  // namespace

absl::Status QueryBatch(const Client& client, const v1::BatchCheckCollisionsRequest& request,
                        const Client::BatchReceiver& on_message, const PairReceiver& receive) {
  BatchAnswers answers(request, receive);
  const absl::Status status =
      client.BatchCheckCollisions(request, [&](const v1::BatchCheckCollisionsResponse& part) {
        const absl::Status taken = on_message ? on_message(part) : absl::OkStatus();
        return taken.ok() ? answers.Take(part) : taken;
      });
  return status.ok() ? answers.Finish() : status;
}

}  // namespace hulld
