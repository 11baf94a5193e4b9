#ifndef HULLD_SERVER_COLLISIONS_PAIR_QUESTION_H_
#define HULLD_SERVER_COLLISIONS_PAIR_QUESTION_H_

#include <absl/status/status.h>

#include <memory>
#include <optional>

#include "core/query/motion/first_contact.h"
#include "core/query/terms/query_options.h"
#include "hulld/v1/collision.pb.h"
#include "server/call/service_parts.h"
#include "server/call/unary_call.h"
#include "server/collisions/placed/placed_answer.h"
#include "server/collisions/placed/placement_table.h"
#include "server/process/task_pool.h"

namespace hulld::server {

using CheckCall = UnaryCall<v1::CheckCollisionRequest, v1::CheckCollisionResponse>;

// A CheckCollision call for two placements, answered in slices (PairSearch). Used by one thread at
// a time.
class PairQuestion : public std::enable_shared_from_this<PairQuestion> {
 public:
  // Answers the call, which must be admitted.
  static void Start(const ServiceParts& parts, CheckCall* call);

 private:
  PairQuestion(const ServiceParts& parts, CheckCall* call)
      : parts_(parts), call_(call), charge_(parts.registry.memory(), MemoryUse::kReading) {}

  // Reads everything except the hulls.
  absl::Status ReadRequest();
  // Resolves the hulls on a reader thread, which may wait for the store and build canonical
  // snapshots and boxes of pieces, then answers.
  void AnswerLater();
  // As AnswerLater, but on this thread. Returns false without blocking if it would have to wait or
  // build.
  bool TryAnswer();
  // Ends the call. Computes an answer immediately if that takes a few microseconds; otherwise on
  // the pool, with the first slice ahead of those of batches.
  void AnswerResolved();
  absl::Status Begin();
  void RunSlice();
  // Fills the response.
  absl::Status Encode();
  absl::Status EncodeProof();

  const ServiceParts& parts_;
  CheckCall* const call_;
  QueryOptions options_;
  // Used if a placement moves.
  MotionOptions motion_options_;
  ReadPlan plan_;
  PlacementTable table_;
  std::optional<PairSearch> search_;
  // Covers the state between slices.
  MemoryCharge charge_;
  // Used by all slices except the first.
  std::optional<TaskPool::Lane> lane_;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_COLLISIONS_PAIR_QUESTION_H_
