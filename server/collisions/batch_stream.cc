#include <absl/status/status.h>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>

#include "core/base/status_macros.h"
#include "core/query/collision.h"
#include "hulld/v1/collision.pb.h"
#include "server/collisions/collision_service.h"
#include "server/collisions/pieced_replies.h"
#include "server/collisions/placed/placed_answer.h"
#include "server/collisions/placed/placement_table.h"
#include "server/collisions/placed/query_settings.h"
#include "server/wire/answer_columns.h"
#include "server/wire/decode.h"

namespace hulld::server {
namespace {

// The first pieces are small because the cost of a pair is unknown. The maximum bounds the damage
// of a wrong estimate.
constexpr uint64_t kFirstPairs = 128;
constexpr uint64_t kMaxPairs = 1 << 14;
// Decoding and placing this many placements takes about a slice.
constexpr int kMaxPlacementsPerSlice = 4096;
// Pairs between two reads of the clock.
constexpr uint64_t kPairsPerPoll = 64;

}  // namespace

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

BatchStream::BatchStream(CallContext& context, const ServiceParts& parts, const Bytes& request)
    : PiecedReplies(request, context, Rpc::kBatchCheckCollisions, parts,
                    {.first_units = kFirstPairs,
                     .max_units = kMaxPairs,
                     .max_short_placements = kMaxPlacementsPerSlice,
                     .joins_head = true,
                     .steps_per_poll = kPairsPerPoll}) {}

absl::Status BatchStream::Validate() {
  HULLD_RETURN_IF_ERROR(DecodePlacements(request().method(), "the batch"));
  expected_pairs_ = CountUnits();
  // Each placement is used at most twice on average, so placing it again costs less than memory for
  // all of them.
  if (!IsTextbook() && expected_pairs_ <= table_.size()) table_.PlaceOnDemand();
  call().AddPairs(expected_pairs_);
  return ValidatePairs(request().pairs(), table_.size(), registry().limits().max_pairs_per_batch,
                       "the batch");
}

void BatchStream::EndPair(PairsPiece& piece, size_t bytes) {
  if (piece.row_bytes == 0) piece.rows.set_first_pair(piece.next);
  ++piece.next;
  EndRow(piece, bytes);
}

absl::Status BatchStream::Step(PairsPiece& piece, Clock::time_point end) {
  const uint32_t a = request().pairs(static_cast<int>(2 * piece.next));
  const uint32_t b = request().pairs(static_cast<int>(2 * piece.next + 1));
  const v1::Wanted& wanted = request().wanted();
  v1::AnswerColumns* const columns = piece.rows.mutable_columns();
  if (!table_.is_answerable(a) || !table_.is_answerable(b)) {
    EndPair(piece, AddUnansweredPair(table_, wanted, columns));
    return absl::OkStatus();
  }
  if (WantsRelationsOfHulls(query_, table_)) return AnswerRelation(a, b, piece);
  if (!piece.search.has_value()) {
    piece.search.emplace(table_, a, b, query_, motion_options_);
    HULLD_RETURN_IF_ERROR(piece.search->CheckMemory(registry()));
  }
  if (!piece.search->Advance(end)) return absl::OkStatus();
  const PlacedAnswer& found = piece.search->answer();
  if (absl::IsCancelled(found.answer.status())) return found.answer.status();
  if (!found.answer.ok()) {
    call().CountLimit(found.answer.status());
  } else if (!found.contact.has_value()) {
    piece.rungs.Add(found.answer->rung);
  }
  EndPair(piece, AddPlacedAnswer(table_, a, b, found, wanted, columns));
  piece.search.reset();
  return absl::OkStatus();
}

// Fast path of PairSearch and AddPlacedAnswer, which need 10 to 12 % more of the server's processor
// time if each pair has its own packed placements, and 2 % more if pairs share 128 placements.
// **Observed**: close pairs of UR5 links over unix sockets, both variants alternating in either
// order, medians of 9 and 7 rounds of remote_benchmark (0.74 us per pair instead of 0.82, and 0.65
// instead of 0.73). Only this function exploits the fact that most pairs need no more.
absl::Status BatchStream::AnswerRelation(uint32_t a, uint32_t b, PairsPiece& piece) {
  std::optional<PlacedHull> made_a;
  std::optional<PlacedHull> made_b;
  const absl::StatusOr<hulld::Answer> answer =
      CheckCollision(table_.PlacedAt(a, &made_a), table_.PlacedAt(b, &made_b), query_);
  if (!answer.ok()) return answer.status();
  piece.rungs.Add(answer->rung);
  EndPair(piece, AddRelation(*answer, piece.rows.mutable_columns()));
  return absl::OkStatus();
}

WriteReactor* StartBatch(CallContext& context, const ServiceParts& parts, const Bytes& request) {
  return BatchStream::Launch(std::make_shared<BatchStream>(context, parts, request));
}

}  // namespace hulld::server
