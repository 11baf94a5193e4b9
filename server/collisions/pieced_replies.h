#ifndef HULLD_SERVER_COLLISIONS_PIECED_REPLIES_H_
#define HULLD_SERVER_COLLISIONS_PIECED_REPLIES_H_

#include <absl/status/status.h>
#include <absl/status/statusor.h>
#include <grpcpp/grpcpp.h>

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <utility>
#include <vector>

#include "core/base/check.h"
#include "core/base/status_macros.h"
#include "server/call/call_stream.h"
#include "server/call/service_parts.h"
#include "server/collisions/placed/placement_table.h"
#include "server/collisions/placed/query_settings.h"
#include "server/process/parallel_loop.h"
#include "server/process/task_pool.h"
#include "server/registry/registry.h"
#include "server/registry/waiting_calls.h"
#include "server/settings/config.h"
#include "server/wire/answer_columns.h"
#include "server/wire/decode.h"

namespace hulld::server {

// A piece of a call's work: a range of units (pairs, or placements of a scene) and its answers,
// which wait for those of earlier pieces.
template <typename Reply>
struct Piece {
  // The remaining range.
  uint64_t next = 0;
  uint64_t end = 0;
  // Replies with their sizes, and the total size.
  std::vector<std::pair<Reply, size_t>> replies = {};
  size_t bytes = 0;
  // Rows of the next reply, and an upper estimate of their bytes.
  Reply rows = {};
  size_t row_bytes = 0;
  // Counts of rungs since they were last taken.
  RungCounts rungs = {};

  // For PiecedReplies: true if a slice is queued or running; bytes held before the slice; total
  // time of the slices so far.
  bool is_running = false;
  size_t noted_bytes = 0;
  uint64_t units = 0;
  std::chrono::steady_clock::duration elapsed{0};

  bool is_done() const { return next == end; }

  // Ends the reply of the current rows, if any.
  void EndReply() {
    if (row_bytes == 0) return;
    const size_t size = rows.ByteSizeLong();
    bytes += size;
    replies.emplace_back(std::exchange(rows, {}), size);
    row_bytes = 0;
  }
};

// A stream whose answers are computed in pieces by all threads of a pool and sent in order. A piece
// is computed in slices of about TaskPool::kSliceTime, one after another, so that other calls get
// their turn. The number of pieces in flight and the bytes of each are bounded. While too many
// bytes are unsent, no slice starts, and no more of the head is queued. Memory is therefore
// bounded, and a client that does not read delays no other client. The call's memory (HeldBytes and
// the answers in flight) counts toward --memory-limit.
//
// Work: the state of a piece between slices, derived from Piece<Reply>. Its held_bytes() returns
// its memory in bytes, excluding replies.
template <typename Request, typename Reply, typename Work>
class PiecedReplies : public RequestStream<QueuedStream<WriteReactor, Reply>, Request> {
 protected:
  using Base = RequestStream<QueuedStream<WriteReactor, Reply>, Request>;
  using Clock = std::chrono::steady_clock;

  // Unsent bytes above which no slice starts: several messages, so that the threads need not wait
  // for gRPC's threads. Not tuned.
  static constexpr size_t kMaxUnsentBytes = size_t{4} * Config::kReplyMessageBytes;
  // Maximum bytes held by a piece that waits for an earlier one.
  static constexpr size_t kMaxHeldBytes = Config::kReplyMessageBytes / 4;
  // Memory of several hundred placements. --max-concurrent-batches such calls take several MiB.
  static constexpr size_t kSmallBytes = 256 << 10;
  // A reply of at most kSmallReplyBytes is merged with the last queued one, because a write costs
  // each side as much as a hundred pairs. While slices run, a queued reply of at most that size
  // waits about kMaxWait to be merged.
  static constexpr size_t kSmallReplyBytes = 32 << 10;
  static constexpr std::chrono::milliseconds kMaxWait{2};

  struct Shape {
    // Numbers of units in the first piece and in the largest.
    uint64_t first_units;
    uint64_t max_units;
    // Preparing this many placements takes about a slice, excluding waits.
    int max_short_placements;
    // True if the first answers may join the last message of the head.
    bool joins_head;
    // Steps between two reads of the clock, for pairs of hulls at rest.
    uint64_t steps_per_poll;
  };

  PiecedReplies(const Bytes& request, CallContext& context, Rpc rpc, const ServiceParts& parts,
                const Shape& shape)
      : Base(request, context, parts.admission, rpc),
        steps_per_poll_(shape.steps_per_poll),
        parts_(parts),
        lane_(parts.pool),
        max_pieces_(2 * parts.pool.threads()),
        shape_(shape),
        charge_(parts.registry.memory(), MemoryUse::kReading),
        holds_head_(shape.joins_head),
        piece_units_(shape.first_units) {}

  // Steps that prepare the call, in this order, without the mutex, on one thread. The hulls are
  // resolved between them.
  virtual absl::Status Validate() = 0;
  virtual absl::Status Prepare() { return absl::OkStatus(); }
  // Bytes held until the call ends, excluding pieces. Called without the mutex after each of these
  // steps.
  virtual size_t HeldBytes() const { return table_.MemoryBytes(); }

  // For Validate: decodes the query, its freshness, and the placements. what: as in "the batch".
  absl::Status DecodePlacements(v1::Method method, const char* what) {
    const Request& request = this->request();
    HULLD_ASSIGN_OR_RETURN(query_, MakeQueryOptions(method, request.wanted(), request.tolerance(),
                                                    registry().limits(), this->call().lifetime()));
    HULLD_ASSIGN_OR_RETURN(
        freshness_, DecodeFreshness(request.freshness(), parts_.store, this->call().arrival()));
    HULLD_ASSIGN_OR_RETURN(
        table_, PlacementTable::Make(
                    request.placements(), *this->mutable_request().mutable_packed_placements(),
                    this->call().caller(), registry().limits().max_placements, what));
    if (!table_.has_motions()) return absl::OkStatus();
    HULLD_RETURN_IF_ERROR(ValidateForMotions(query_));
    motion_options_ = MakeMotionOptions(request.wanted(), query_);
    return absl::OkStatus();
  }

  Registry& registry() { return parts_.registry; }
  bool IsTextbook() const { return query_.method == Method::kTextbookSat; }

  // Runs `work` on disjoint ranges that cover [0, count), on several threads concurrently for a
  // long call. Used by the steps above.
  void ParallelFor(size_t count, size_t step, const std::function<void(size_t, size_t)>& work) {
    if (IsShort()) return work(0, count);
    ParallelLoop::Run(parts_.long_readers, max_pieces_ / 2 - 1, count, step, work);
  }

  // Performs a step on the next unit of the piece, which takes a few microseconds, or until `end`
  // at most: adds rows, counts rungs, and advances `next` when the unit is done. Called without the
  // mutex, on any thread, but never concurrently for the same piece.
  virtual absl::Status Step(Work& piece, Clock::time_point end) = 0;

  // Ends a row of the piece. bytes: as returned by AddAnswer.
  void EndRow(Work& piece, size_t bytes) {
    piece.row_bytes += bytes;
    if (piece.row_bytes >= FullMessageBytes(this->request().wanted())) piece.EndReply();
  }

  // The functions below require the mutex.

  // Number of units. Requires that the call is prepared.
  virtual uint64_t CountUnits() = 0;
  // Queues the replies of the front piece, in order. Called one last time when the piece is done.
  virtual void Deliver(Work& piece) {
    for (auto& [reply, bytes] : piece.replies) {
      QueueOrJoin(std::move(reply), bytes);
      holds_head_ = false;
    }
    piece.replies.clear();
    piece.bytes = 0;
  }
  // Called after all pieces are delivered. Returns the number of additional units that become known
  // only then, or 0.
  virtual uint64_t CountFollowingUnits() { return 0; }
  // Called when no units are left, to queue a final message; the end is set afterwards.
  virtual void OnAllDelivered() {}

  // Queues a reply, or merges it into the last queued one if both are small and fit together.
  void QueueOrJoin(Reply reply, size_t bytes) {
    auto* const waiting = this->LastWaiting();
    const bool is_small = waiting != nullptr && bytes <= kSmallReplyBytes &&
                          waiting->bytes + bytes <= Config::kReplyMessageBytes;
    if (!is_small) return this->Queue(std::move(reply), bytes);
    const bool is_head = waiting->reply.columns().relations().empty();
    const bool fits = is_head ? shape_.joins_head : !NamesRows(reply.columns());
    if (!fits) return this->Queue(std::move(reply), bytes);
    // The merged message keeps its first pair.
    if constexpr (requires { reply.clear_first_pair(); }) reply.clear_first_pair();
    waiting->reply.MergeFrom(reply);
    this->GrowLastWaiting(bytes);
  }

  // Written before the first piece.
  QueryOptions query_;
  // Used if a placement moves.
  MotionOptions motion_options_;
  PlacementTable table_;
  // Minimum number of pairs that the call queries.
  uint64_t expected_pairs_ = 0;
  // Steps between two reads of the clock. Written while no slice runs.
  uint64_t steps_per_poll_;

 private:
  // Returns true if preparation takes at most about a slice, excluding waits.
  bool IsShort() const {
    const int listed = this->request().placements_size();
    return listed + this->request().packed_placements().hulls_size() <= shape_.max_short_placements;
  }

  // Opens the call without waiting if its hulls are ready: a short one on the pool, so that it need
  // not wait for another thread.
  void Open() final {
    const auto open = [this] { OpenWith(Validate(), false); };
    IsShort() ? this->RunOn(lane_, open) : this->RunOn(parts_.long_readers, open);
  }

  // Returns true if the call waits for the store without occupying a thread. It is then opened
  // after the store answers.
  bool AwaitsFresh() {
    const auto open = [this, self = this->shared_from_this()](const absl::Status& status) {
      this->RunOn(parts_.long_readers, [this, status] { OpenWith(status, true); });
    };
    return parts_.waiting.AwaitFresh(registry(), freshness_, this->call().should_stop(), open);
  }

  void OpenWith(absl::Status status, bool may_wait) {
    if (status.ok()) status = Charge();
    if (status.ok()) {
      status = Resolve(may_wait);
      if (!status.ok() && !may_wait) {
        if (AwaitsFresh()) return;
        return this->RunOn(parts_.long_readers, [this] { OpenWith(absl::OkStatus(), true); });
      }
    }
    if (status.ok()) {
      // The head can be sent during preparation.
      this->Locked([this] { is_head_left_ = true; });
      status = Prepare();
    }
    if (status.ok()) status = Charge();
    if (this->call().ShouldStop()) status = this->call().StopStatus();
    this->Locked([this, &status] {
      opening_ = false;
      if (!status.ok()) return this->End(status);
      const bool is_slow = table_.has_bodies() || table_.has_motions() || IsTextbook();
      if (is_slow) steps_per_poll_ = 1;
      unit_count_ = CountUnits();
    });
  }

  // Resolves the hulls. If `may_wait` is false, fails instead of blocking.
  absl::Status Resolve(bool may_wait) {
    const ReadPlan plan = {2 * expected_pairs_ / std::max<uint64_t>(1, table_.hull_count()), true,
                           freshness_, may_wait};
    return table_.Resolve(registry(), query_, plan);
  }

  // Charges the call's memory. RESOURCE_EXHAUSTED: no room for it. A small call is admitted
  // regardless, so that calls for a few hulls in memory are always served.
  absl::Status Charge() {
    fixed_bytes_ = HeldBytes();
    charge_.Set(fixed_bytes_);
    if (fixed_bytes_ <= kSmallBytes) return absl::OkStatus();
    return registry().CheckMemory(MemoryUse::kReading);
  }

  // Works on the piece until `end`, or until it is done.
  absl::Status Advance(Work& piece, Clock::time_point end) {
    do {
      for (uint64_t left = steps_per_poll_; left > 0 && !piece.is_done(); --left) {
        HULLD_RETURN_IF_ERROR(Step(piece, end));
      }
    } while (!piece.is_done() && Clock::now() < end);
    return absl::OkStatus();
  }

  void RunSlice(Work& piece) {
    const auto start = Clock::now();
    const uint64_t before = piece.next;
    absl::Status status = this->call().ShouldStop() ? this->call().StopStatus()
                                                    : Advance(piece, start + TaskPool::kSliceTime);
    if (this->call().ShouldStop()) status = this->call().StopStatus();
    piece.EndReply();
    this->call().metrics().CountPairs(std::exchange(piece.rungs, {}));
    piece.elapsed += Clock::now() - start;
    piece.units += piece.next - before;
    this->Locked([this, &piece, &status] {
      HULLD_CHECK(std::exchange(piece.is_running, false));
      --running_;
      if (!status.ok()) return this->End(status);
      if (piece.is_done()) AdaptUnits(piece);
    });
  }

  bool IsWorking() const final { return opening_ || running_ > 0; }

  // The end of the preparation and of each slice is a Locked step.
  bool ShouldDelayWrite() final {
    if (holds_head_) return opening_ || running_ > 0;
    return running_ > 0 && this->LastWaiting()->bytes <= kSmallReplyBytes &&
           Clock::now() - this->LastWaiting()->since < kMaxWait;
  }

  // Queues the next message of the table of hulls, which precedes all answers. Returns true if more
  // of the table follows.
  bool QueueHead() {
    Reply head;
    if (next_row_ == 0) EncodeHeader(parts_.store, table_.as_of(), head.mutable_header());
    next_row_ = table_.EncodeHulls(next_row_, &head);
    const size_t bytes = head.ByteSizeLong();
    this->Queue(std::move(head), bytes);
    return next_row_ < table_.table_rows();
  }

  void StartWork() final {
    while (is_head_left_ && this->unsent_bytes() < kMaxUnsentBytes) is_head_left_ = QueueHead();
    if (opening_) return;
    while (!pieces_.empty() && !pieces_.front()->is_running) {
      Work& front = *pieces_.front();
      Deliver(front);
      if (!front.is_done()) break;
      pieces_.pop_front();
    }
    size_t held_bytes = fixed_bytes_ + this->unsent_bytes();
    for (const std::unique_ptr<Work>& piece : pieces_) {
      if (!piece->is_running) piece->noted_bytes = piece->bytes + piece->held_bytes();
      held_bytes += piece->noted_bytes;
    }
    charge_.Set(held_bytes);
    if (is_head_left_) return;
    if (pieces_.empty() && next_unit_ == unit_count_) unit_count_ += CountFollowingUnits();
    if (this->unsent_bytes() < kMaxUnsentBytes) StartSlices();
    if (!pieces_.empty() || next_unit_ < unit_count_) return;
    OnAllDelivered();
    this->End(absl::OkStatus());
  }

  void StartSlices() {
    while (pieces_.size() < max_pieces_ && next_unit_ < unit_count_) {
      auto piece = std::make_unique<Work>();
      piece->next = next_unit_;
      piece->end = std::min(unit_count_, next_unit_ + piece_units_);
      next_unit_ = piece->end;
      pieces_.push_back(std::move(piece));
    }
    for (const std::unique_ptr<Work>& piece : pieces_) {
      if (piece->is_running || piece->is_done()) continue;
      const bool is_front = piece == pieces_.front();
      // Textbook pairs keep memory between slices, so only the first piece runs.
      if (!is_front && (piece->bytes >= kMaxHeldBytes || IsTextbook())) continue;
      piece->is_running = true;
      ++running_;
      this->RunOn(lane_, [this, each = piece.get()] { RunSlice(*each); });
    }
  }

  // Adapts the size of pieces so that each takes about one slice.
  void AdaptUnits(const Work& piece) {
    const auto least = std::chrono::nanoseconds(1);
    const double factor = std::chrono::duration<double>(TaskPool::kSliceTime) /
                          std::max<Clock::duration>(piece.elapsed, least);
    const double wanted = static_cast<double>(piece.units) * std::min(factor, 4.0);
    piece_units_ =
        static_cast<uint64_t>(std::clamp(wanted, 1.0, static_cast<double>(shape_.max_units)));
  }

  const ServiceParts& parts_;
  TaskPool::Lane lane_;
  const size_t max_pieces_;
  const Shape shape_;

  // Owned by the opening thread while the call is being opened.
  Freshness freshness_;
  MemoryCharge charge_;
  size_t fixed_bytes_ = 0;

  // The mutex guards the members below; a running piece belongs to its slice.
  bool opening_ = true;
  // True if a part of the head is not queued yet: the table of hulls from row next_row_ on.
  bool is_head_left_ = false;
  size_t next_row_ = 0;
  // True if the last message of the head waits for the first answers.
  bool holds_head_;
  uint64_t unit_count_ = 0;
  uint64_t next_unit_ = 0;
  // Size of the next piece.
  uint64_t piece_units_;
  // Pieces in flight, in order.
  std::deque<std::unique_ptr<Work>> pieces_;
  size_t running_ = 0;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_COLLISIONS_PIECED_REPLIES_H_
