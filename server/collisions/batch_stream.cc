#include "server/collisions/batch_stream.h"

#include <algorithm>
#include <memory>
#include <utility>

#include "server/collisions/placed/placed_answer.h"
#include "server/collisions/placed/query_settings.h"
#include "server/contract/status_map.h"
#include "server/wire/answer_columns.h"
#include "server/wire/decode.h"

namespace hulld::server {
namespace {

// The first pieces are small, because the cost of a pair is unknown; the largest bounds the damage
// of a wrong estimate.
constexpr uint64_t kFirstPairs = 128;
constexpr uint64_t kMostPairs = 1 << 14;
// Decoding and placing this many placements takes about a slice.
constexpr int kMostPlacementsPerSlice = 4096;
// Pairs between two reads of the clock.
constexpr uint64_t kPairsPerPoll = 64;

// Appends answers of pairs that follow the pairs of `message`.
void Append(const v1::BatchCheckCollisionsResponse& next,
            v1::BatchCheckCollisionsResponse* message) {
  const uint64_t first_pair = message->first_pair();
  message->MergeFrom(next);
  message->set_first_pair(first_pair);
}

}  // namespace

WriteReactor* BatchStream::Start(grpc::CallbackServerContext& context, Admission& admission,
                                 Registry& registry, const PieceThreads& threads,
                                 const grpc::ByteBuffer& request) {
  return Launch(std::shared_ptr<BatchStream>(
      new BatchStream(context, admission, registry, threads, request)));
}

BatchStream::BatchStream(grpc::CallbackServerContext& context, Admission& admission,
                         Registry& registry, const PieceThreads& threads,
                         const grpc::ByteBuffer& request)
    : PiecedReplies(request, context, admission, Rpc::kBatchCheckCollisions, registry, threads,
                    {kFirstPairs, kMostPairs}) {}

bool BatchStream::IsShort() const {
  return request().placements_size() + request().packed_placements().hulls_size() <=
         kMostPlacementsPerSlice;
}

absl::Status BatchStream::Validate() {
  absl::StatusOr<QueryOptions> options =
      MakeQueryOptions(request().method(), request().wanted(), request().tolerance(),
                       registry().limits(), call().lifetime());
  if (!options.ok()) return options.status();
  const absl::StatusOr<Freshness> freshness =
      DecodeFreshness(request().freshness(), registry().store(), call().arrival());
  if (!freshness.ok()) return freshness.status();
  freshness_ = *freshness;
  options_ = *std::move(options);
  absl::StatusOr<PlacementTable> table =
      PlacementTable::Make(request().placements(), *own_request().mutable_packed_placements(),
                           call().caller(), registry().limits().max_placements, "the batch");
  if (!table.ok()) return table.status();
  table_ = *std::move(table);
  if (table_.has_motions()) {
    if (absl::Status s = ValidateForMotions(options_); !s.ok()) return s;
    motion_options_ = MakeMotionOptions(request().wanted(), options_);
  }
  pair_count_ = static_cast<uint64_t>(request().pairs_size()) / 2;
  // Each placement is used at most twice on average: placing it again costs less than the memory
  // for all of them.
  const bool is_textbook = options_.method == Method::kTextbookSat;
  if (!is_textbook && pair_count_ <= table_.size()) table_.PlaceOnDemand();
  call().AddPairs(pair_count_);
  return ValidatePairs(request().pairs(), table_.size(), registry().limits().max_pairs_per_batch,
                       "the batch");
}

absl::StatusOr<bool> BatchStream::ResolveHulls(bool may_wait) {
  const ReadPlan plan = {2 * pair_count_ / std::max<uint64_t>(1, table_.hull_count()), true,
                         freshness_};
  if (!may_wait) return table_.TryResolve(registry(), options_, plan);
  if (absl::Status s = table_.Resolve(registry(), options_, plan); !s.ok()) return s;
  return true;
}

absl::Status BatchStream::Prepare() {
  is_plain_ = AsksRelationsOfHulls(options_, table_);
  return absl::OkStatus();
}

bool BatchStream::QueueHead() {
  if (next_row_ == 0) table_.EncodeHeader(registry().store(), head_.mutable_header());
  next_row_ = table_.EncodeHulls(next_row_, &head_);
  if (next_row_ == table_.table_rows()) {
    has_head_ = true;
    return false;
  }
  const size_t bytes = head_.ByteSizeLong();
  Queue(std::exchange(head_, {}), bytes);
  return true;
}

PlacedPair BatchStream::PairAt(uint64_t i) const {
  return {request().pairs(static_cast<int>(2 * i)), request().pairs(static_cast<int>(2 * i + 1))};
}

bool BatchStream::IsAnswerable(const PlacedPair& pair) const {
  return table_.is_answerable(pair.a) && table_.is_answerable(pair.b);
}

// A started textbook pair holds memory, so a batch starts only one.
bool BatchStream::MayRunAhead() const { return options_.method != Method::kTextbookSat; }

absl::Status BatchStream::Advance(PairsPiece& piece, Clock::time_point end) {
  const bool is_textbook = options_.method == Method::kTextbookSat;
  const uint64_t first = piece.next;
  BatchColumns columns({}, request().wanted(), first);
  RungCounts counts;
  absl::Status status;
  uint64_t pairs = 0;
  const bool looks_each_time = is_textbook || table_.has_bodies() || table_.has_motions();
  do {
    status = is_textbook ? AnswerByTextbook(piece, end, &columns, &counts)
                         : Answer(piece, &columns, &counts);
    ++pairs;
  } while (status.ok() && piece.next < piece.end &&
           ((!looks_each_time && pairs % kPairsPerPoll != 0) || Clock::now() < end));
  if (!status.ok()) return status;
  call().metrics().CountPairs(counts);
  piece.is_done = piece.next == piece.end;
  if (piece.next == first) return absl::OkStatus();
  for (v1::BatchCheckCollisionsResponse& reply : columns.Take()) piece.Add(std::move(reply));
  return absl::OkStatus();
}

absl::Status BatchStream::Answer(PairsPiece& piece, BatchColumns* columns, RungCounts* counts) {
  const PlacedPair pair = PairAt(piece.next);
  if (!IsAnswerable(pair)) {
    columns->Add(
        [&](v1::AnswerColumns* to) { return AddUnansweredPair(table_, request().wanted(), to); });
    ++piece.next;
    return absl::OkStatus();
  }
  if (is_plain_) return AnswerRelation(piece, columns, counts);
  if (table_.has_motions()) {
    return Add(AskMoving(table_, pair.a, pair.b, motion_options_), piece, columns, counts);
  }
  return Add(AskPlaced(table_, pair.a, pair.b, options_, nullptr), piece, columns, counts);
}

// Fast path of AskPlaced and AddPlacedAnswer, which take 10 to 12 % more of the server's processor
// time if each pair has its own packed placements, and 2 % more if pairs share 128 placements.
// **Observed**: close pairs of UR5 links over unix sockets, both variants alternating in either
// order, medians of 9 and 7 rounds of remote_benchmark (0.74 us per pair instead of 0.82, and 0.65
// instead of 0.73). Only this function exploits that most pairs need no more.
absl::Status BatchStream::AnswerRelation(PairsPiece& piece, BatchColumns* columns,
                                         RungCounts* counts) {
  const PlacedPair pair = PairAt(piece.next);
  std::optional<PlacedHull> made_a;
  std::optional<PlacedHull> made_b;
  absl::StatusOr<hulld::Answer> answer =
      CheckCollision(table_.PlacedAt(pair.a, &made_a), table_.PlacedAt(pair.b, &made_b), options_);
  if (!answer.ok()) return Add({std::move(answer)}, piece, columns, counts);
  ++piece.next;
  counts->Add(answer->rung);
  columns->Add([&](v1::AnswerColumns* to) { return AddRelation(*answer, to); });
  return absl::OkStatus();
}

absl::Status BatchStream::AnswerByTextbook(PairsPiece& piece, Clock::time_point end,
                                           BatchColumns* columns, RungCounts* counts) {
  const PlacedPair pair = PairAt(piece.next);
  const bool is_for_hulls = !table_.is_body(pair.a) && !table_.is_body(pair.b);
  if (!IsAnswerable(pair) || !is_for_hulls) return Answer(piece, columns, counts);
  if (!piece.check.has_value()) {
    const PlacedHull& a = table_.placed()[pair.a];
    const PlacedHull& b = table_.placed()[pair.b];
    if (HoldsMuchForTextbook(a, b)) {
      if (absl::Status s = registry().CheckMemory(MemoryUse::kReading); !s.ok()) return s;
    }
    absl::StatusOr<TextbookCheck> begun = TextbookCheck::Begin(a, b, options_);
    if (!begun.ok()) return Add({begun.status()}, piece, columns, counts);
    piece.check = *std::move(begun);
  }
  const absl::StatusOr<bool> done = piece.check->Advance(end);
  if (!done.ok()) return done.status();
  if (!*done) return absl::OkStatus();
  PlacedAnswer answer = {piece.check->Finish()};
  piece.check.reset();
  return Add(std::move(answer), piece, columns, counts);
}

absl::Status BatchStream::Add(PlacedAnswer answer, PairsPiece& piece, BatchColumns* columns,
                              RungCounts* counts) {
  if (absl::IsCancelled(answer.answer.status())) return answer.answer.status();
  const PlacedPair pair = PairAt(piece.next++);
  if (answer.answer.ok()) {
    if (!answer.contact.has_value()) counts->Add(answer.answer->rung);
  } else {
    answer.answer = NameLimit(table_, pair.a, pair.b, answer.answer.status(), options_);
    call().CountLimit(answer.answer.status());
  }
  columns->Add([&](v1::AnswerColumns* to) {
    return AddPlacedAnswer(table_, pair.a, pair.b, answer, request().wanted(), to);
  });
  return absl::OkStatus();
}

void BatchStream::Deliver(PairsPiece& piece) {
  if (has_head_ && !piece.replies.empty()) {
    const size_t bytes = head_.ByteSizeLong();
    if (bytes + piece.reply_bytes.front() > Config::kReplyMessageBytes) {
      Queue(std::move(head_), bytes);
    } else {
      Append(piece.replies.front(), &head_);
      piece.replies.front() = std::move(head_);
      piece.reply_bytes.front() = piece.replies.front().ByteSizeLong();
    }
    has_head_ = false;
  }
  DeliverReplies(piece);
}

bool BatchStream::Join(const v1::BatchCheckCollisionsResponse& reply,
                       v1::BatchCheckCollisionsResponse* waiting) {
  if (NamesRows(reply.columns())) return false;
  Append(reply, waiting);
  return true;
}

// A batch without pairs consists of its head.
void BatchStream::OnAllDelivered() {
  if (!std::exchange(has_head_, false)) return;
  const size_t bytes = head_.ByteSizeLong();
  Queue(std::move(head_), bytes);
}

}  // namespace hulld::server
