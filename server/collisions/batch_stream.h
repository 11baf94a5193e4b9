#ifndef HULLD_SERVER_COLLISIONS_BATCH_STREAM_H_
#define HULLD_SERVER_COLLISIONS_BATCH_STREAM_H_

#include <absl/status/status.h>
#include <grpcpp/grpcpp.h>

#include <cstddef>
#include <cstdint>
#include <optional>

#include "core/query/motion/first_contact.h"
#include "hulld/v1/collision.pb.h"
#include "server/collisions/pieced_replies.h"
#include "server/collisions/placed/placed_answer.h"
#include "server/collisions/placed/placement_table.h"

namespace hulld::server {

// A range of pairs, and the search of the next one, if it was started.
struct PairsPiece : Piece<v1::BatchCheckCollisionsResponse> {
  std::optional<PairSearch> search;

  size_t held_bytes() const { return search.has_value() ? search->MemoryBytes() : 0; }
};

// A BatchCheckCollisions call: resolves each hull once, on a reader thread, then answers ranges of
// pairs on all threads of the pool.
// Has external linkage: with internal linkage the compiler merges the steps of a pair, and deep
// pairs take 4 to 5 % longer. **Observed**: UR5 links over a unix socket, both variants alternating
// in either order, medians of 10 rounds of remote_benchmark (20.4 ms per batch instead of 21.2).
class BatchStream : public PiecedReplies<v1::BatchCheckCollisionsRequest,
                                         v1::BatchCheckCollisionsResponse, PairsPiece> {
 public:
  BatchStream(CallContext& context, const ServiceParts& parts, const Bytes& request);

 private:
  absl::Status Validate() override;
  // Answers the next pair of the piece, or works on it until `end`. CANCELLED. RESOURCE_EXHAUSTED:
  // as PairSearch::CheckMemory.
  absl::Status Step(PairsPiece& piece, Clock::time_point end) override;
  // Requires the mutex.
  uint64_t CountUnits() override { return static_cast<uint64_t>(request().pairs_size()) / 2; }

  // Called without the mutex.
  absl::Status AnswerRelation(uint32_t a, uint32_t b, PairsPiece& piece);
  // Ends the row of the next pair.
  void EndPair(PairsPiece& piece, size_t bytes);
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_COLLISIONS_BATCH_STREAM_H_
