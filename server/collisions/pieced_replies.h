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
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "core/base/check.h"
#include "server/call/queued_stream.h"
#include "server/process/shared_loop.h"
#include "server/process/task_pool.h"
#include "server/process/worker_pool.h"
#include "server/registry/registry.h"
#include "server/registry/waiting_calls.h"
#include "server/settings/config.h"

namespace hulld::server {

// A piece of a call's work: a range of units (pairs, or placements of a scene), and its answers,
// which wait for earlier pieces.
template <typename Reply>
struct Piece {
  // The remaining range.
  uint64_t next = 0;
  uint64_t end = 0;
  std::vector<Reply> replies = {};
  // Size of each reply, and their total.
  std::vector<size_t> reply_bytes = {};
  size_t bytes = 0;
  bool is_done = false;

  // For PiecedReplies: a slice is queued or running; bytes held before the slice; time of the
  // slices so far.
  bool is_running = false;
  size_t noted_bytes = 0;
  uint64_t units = 0;
  std::chrono::steady_clock::duration elapsed{0};

  // Bytes held by the piece, excluding the replies.
  size_t held_bytes() const { return 0; }

  void Add(Reply reply) {
    const size_t size = reply.ByteSizeLong();
    bytes += size;
    reply_bytes.push_back(size);
    replies.push_back(std::move(reply));
  }
};

// Threads that prepare and compute a call.
struct PieceThreads {
  // For steps that may block.
  WorkerPool& readers;
  TaskPool& pool;
  // Waits for freshness without a thread.
  WaitingCalls& waiting;
};

// A stream with answers computed in pieces by all threads of a pool and sent in order. A piece is
// computed in slices of about TaskPool::kSliceTime, one after another, so that other calls get
// their turn. A bounded number of pieces is in flight, each with a bounded number of bytes; while
// too many bytes are unsent, no slice starts, and no more of the head is queued. So memory is
// bounded, and a client that does not read delays no other client. The call's memory, HeldBytes and
// answers in flight, counts against --memory-limit.
//
// Work: state of a piece between slices, derived from Piece<Reply>.
template <typename Request, typename Reply, typename Work>
class PiecedReplies : public RequestStream<QueuedStream<WriteReactor, Reply>, Request> {
 protected:
  using Base = RequestStream<QueuedStream<WriteReactor, Reply>, Request>;
  using Clock = std::chrono::steady_clock;

  // Unsent bytes above which no slice starts. A choice: some messages, so that the threads need not
  // wait for gRPC's threads.
  static constexpr size_t kMostUnsentBytes = size_t{4} * Config::kReplyMessageBytes;
  // Maximum bytes held by a piece behind another one.
  static constexpr size_t kMostHeldBytes = Config::kReplyMessageBytes / 4;
  // Some hundred placements. With --max-concurrent-batches such calls, some MiB.
  static constexpr size_t kSmallBytes = 256 << 10;
  // A reply of at most kSmallReplyBytes is merged with the last queued one, because a write costs
  // both sides as much as a hundred pairs. While slices run, a queued reply of that size waits to
  // be merged, for about kMostWait.
  static constexpr size_t kSmallReplyBytes = 32 << 10;
  static constexpr std::chrono::milliseconds kMostWait{2};

  // Growth of pieces.
  struct Shape {
    uint64_t first_units;
    uint64_t most_units;
  };

  PiecedReplies(const grpc::ByteBuffer& request, grpc::CallbackServerContext& context,
                Admission& admission, Rpc rpc, Registry& registry, const PieceThreads& threads,
                const Shape& shape)
      : Base(request, context, admission, rpc),
        registry_(registry),
        readers_(threads.readers),
        lane_(threads.pool),
        waiting_(threads.waiting),
        most_pieces_(2 * static_cast<size_t>(threads.pool.threads())),
        most_units_(shape.most_units),
        charge_(registry.memory(), MemoryUse::kReading),
        piece_units_(shape.first_units) {}

  // True if preparation takes about a slice, waits excluded.
  virtual bool IsShort() const = 0;
  // The call is prepared step by step, without the mutex, on one thread.
  virtual absl::Status Validate() = 0;
  // Requires that the call is valid.
  virtual const Freshness& freshness() const = 0;
  // Resolves the hulls. Returns false if that may block and `may_wait` is false.
  virtual absl::StatusOr<bool> ResolveHulls(bool may_wait) = 0;
  virtual absl::Status Prepare() { return absl::OkStatus(); }
  // Bytes held until the call ends, excluding pieces. Called without the mutex after each of these
  // steps.
  virtual size_t HeldBytes() const = 0;

  Registry& registry() { return registry_; }

  // Runs `work` on disjoint ranges that cover [0, count); for a long call, on several threads
  // concurrently. For the steps above.
  void ShareOut(size_t count, size_t step, const std::function<void(size_t, size_t)>& work) {
    if (IsShort()) return work(0, count);
    SharedLoop::Run(readers_, most_pieces_ / 2 - 1, count, step, work);
  }

  // Works on the piece until `end`, or until it is done: adds replies and advances `next`. Called
  // without the mutex, on any thread, but never concurrently for the same piece.
  virtual absl::Status Advance(Work& piece, Clock::time_point end) = 0;

  // The functions below require the mutex.

  // Queues a message of the head, which precedes all answers, or keeps it to join the first of
  // them. Returns true if more of the head follows. Called as the client reads, after the hulls are
  // resolved.
  virtual bool QueueHead() = 0;
  // Number of units. Requires that the call is prepared.
  virtual uint64_t CountUnits() = 0;
  // True if a slice of a piece may start while earlier pieces are in flight.
  virtual bool MayRunAhead() const { return true; }
  // Queues replies of the front piece; called one last time with is_done.
  virtual void Deliver(Work& piece) = 0;
  // Merges a small reply into the queued one; returns false if they do not fit.
  virtual bool Join(const Reply& reply, Reply* waiting) = 0;
  // Called after every piece was delivered. Returns the number of further units that only then
  // exist, if any.
  virtual uint64_t CountFollowingUnits() { return 0; }
  // Called after that, to queue a final message; the end is set afterwards.
  virtual void OnAllDelivered() {}

  void RunSlice(Work& piece) {
    const auto start = Clock::now();
    const uint64_t before = piece.next;
    absl::Status status = this->call().ShouldStop() ? this->call().StopStatus()
                                                    : Advance(piece, start + TaskPool::kSliceTime);
    if (this->call().ShouldStop()) status = this->call().StopStatus();
    piece.elapsed += Clock::now() - start;
    piece.units += piece.next - before;
    this->Locked([this, &piece, &status] {
      HULLD_CHECK(std::exchange(piece.is_running, false));
      --running_;
      if (!status.ok()) return this->End(status);
      if (piece.is_done) AdaptUnits(piece);
    });
  }

  // Queues the replies of the piece in order.
  void DeliverReplies(Work& piece) {
    for (size_t i = 0; i < piece.replies.size(); ++i) {
      QueueOrJoin(std::move(piece.replies[i]), piece.reply_bytes[i]);
    }
    piece.replies.clear();
    piece.reply_bytes.clear();
    piece.bytes = 0;
  }

  void QueueOrJoin(Reply reply, size_t bytes) {
    const bool is_small =
        bytes <= kSmallReplyBytes && this->LastWaitingBytes() + bytes <= Config::kReplyMessageBytes;
    Reply* const waiting = this->LastWaiting();
    if (is_small && waiting != nullptr && Join(reply, waiting)) {
      this->GrowLastWaiting(bytes);
    } else {
      this->Queue(std::move(reply), bytes);
    }
  }

 private:
  // A short call with ready hulls need not wait for another thread.
  void Open() final {
    if (IsShort()) return this->RunOn(lane_, [this] { OpenWith(Validate(), false); });
    this->RunOn(readers_, [this] {
      absl::Status status = Validate();
      if (status.ok()) status = Charge();
      if (!status.ok() || !AwaitsFresh()) OpenWith(status, true);
    });
  }

  // Returns true if the call waits, without a thread, for the store and will be opened after its
  // answer.
  bool AwaitsFresh() {
    const auto should_stop = [this] { return this->call().ShouldStop(); };
    const auto open = [this, self = this->shared_from_this()](const absl::Status& status) {
      this->RunOn(readers_, [this, status] { OpenWith(status, true); });
    };
    return waiting_.AwaitFresh(registry_, freshness(), should_stop, open);
  }

  void OpenWith(absl::Status status, bool may_wait) {
    if (status.ok()) status = Charge();
    if (status.ok()) {
      const absl::StatusOr<bool> resolved = ResolveHulls(may_wait);
      if (resolved.ok() && !*resolved) {
        HULLD_CHECK(!may_wait);
        if (AwaitsFresh()) return;
        return this->RunOn(readers_, [this] { OpenWith(absl::OkStatus(), true); });
      }
      status = resolved.status();
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
      unit_count_ = CountUnits();
    });
  }

  // RESOURCE_EXHAUSTED: no room for the call's memory. A small call is admitted regardless, so that
  // calls about a few hulls in memory are always served.
  absl::Status Charge() {
    fixed_bytes_ = HeldBytes();
    charge_.Set(fixed_bytes_);
    if (fixed_bytes_ <= kSmallBytes) return absl::OkStatus();
    return registry_.CheckMemory(MemoryUse::kReading);
  }

  bool IsWorking() const final { return opening_ || running_ > 0; }

  // A running slice ends in a Locked step.
  bool KeepsWaiting() const final {
    return running_ > 0 && this->LastWaitingBytes() <= kSmallReplyBytes &&
           this->LastWaitingTime() < kMostWait;
  }

  void StartWork() final {
    while (is_head_left_ && this->unsent_bytes() < kMostUnsentBytes) is_head_left_ = QueueHead();
    if (opening_) return;
    while (!pieces_.empty() && !pieces_.front()->is_running) {
      Work& front = *pieces_.front();
      Deliver(front);
      if (!front.is_done) break;
      pieces_.pop_front();
    }
    NoteHeldBytes();
    if (is_head_left_) return;
    if (pieces_.empty() && next_unit_ == unit_count_) unit_count_ += CountFollowingUnits();
    if (this->unsent_bytes() < kMostUnsentBytes) StartSlices();
    if (!pieces_.empty() || next_unit_ < unit_count_) return;
    OnAllDelivered();
    this->End(absl::OkStatus());
  }

  void NoteHeldBytes() {
    size_t bytes = fixed_bytes_ + this->unsent_bytes();
    for (const std::unique_ptr<Work>& piece : pieces_) {
      if (!piece->is_running) piece->noted_bytes = piece->bytes + piece->held_bytes();
      bytes += piece->noted_bytes;
    }
    charge_.Set(bytes);
  }

  void StartSlices() {
    while (pieces_.size() < most_pieces_ && next_unit_ < unit_count_) {
      auto piece = std::make_unique<Work>();
      piece->next = next_unit_;
      piece->end = std::min(unit_count_, next_unit_ + piece_units_);
      next_unit_ = piece->end;
      pieces_.push_back(std::move(piece));
    }
    for (const std::unique_ptr<Work>& piece : pieces_) {
      if (piece->is_running || piece->is_done) continue;
      const bool is_front = piece == pieces_.front();
      if (!is_front && (piece->bytes >= kMostHeldBytes || !MayRunAhead())) continue;
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
    piece_units_ = static_cast<uint64_t>(std::clamp(wanted, 1.0, static_cast<double>(most_units_)));
  }

  Registry& registry_;
  WorkerPool& readers_;
  TaskPool::Lane lane_;
  WaitingCalls& waiting_;
  const size_t most_pieces_;
  const uint64_t most_units_;

  // Owned by the opening thread while the call is opened.
  MemoryCharge charge_;
  size_t fixed_bytes_ = 0;

  // The mutex guards the members below; a running piece belongs to its slice.
  bool opening_ = true;
  // Part of the head is still to be queued.
  bool is_head_left_ = false;
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
