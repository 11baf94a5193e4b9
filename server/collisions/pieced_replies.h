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
#include "server/settings/config.h"
#include "server/shards/shards.h"
#include "server/shards/waiting_calls.h"

namespace hulld::server {

// A piece of a call's work, a range of units (pairs, or placements of a scene), and its answers
// that wait for those of the pieces before.
template <typename Reply>
struct Piece {
  // What is left of it.
  uint64_t next = 0;
  uint64_t end = 0;
  std::vector<Reply> replies = {};
  // The size of each reply, and of all.
  std::vector<size_t> reply_bytes = {};
  size_t bytes = 0;
  bool is_done = false;

  // For PiecedReplies: a slice is queued or runs; what the piece held before that; what the slices
  // took so far.
  bool is_running = false;
  size_t noted_bytes = 0;
  uint64_t units = 0;
  std::chrono::steady_clock::duration elapsed{0};

  // What the rest of the piece holds in memory, beside the replies.
  size_t held_bytes() const { return 0; }

  void Add(Reply reply) {
    const size_t size = reply.ByteSizeLong();
    bytes += size;
    reply_bytes.push_back(size);
    replies.push_back(std::move(reply));
  }
};

// Where a call is prepared and computed.
struct PieceThreads {
  // For what may wait.
  WorkerPool& readers;
  TaskPool& pool;
  // Where it waits, without a thread, until what is here is fresh.
  WaitingCalls& waiting;
};

// A stream whose answers are computed in pieces by all threads of a pool and sent in order. A piece
// is worked on by one slice at a time, each of about TaskPool::kSliceTime, so that other calls get
// their turn. A bounded number of pieces is under way, and each holds a bounded number of bytes;
// while a bounded number of bytes waits for the client, no slice starts, and no more is told of
// what comes first. So memory is bounded, and a client that does not read holds up no other. What
// the call holds counts against --memory-limit: what HeldBytes says, and its answers, as long as
// they are on the wire.
//
// Work: what a piece keeps from one slice to the next, derived from Piece<Reply>.
template <typename Request, typename Reply, typename Work>
class PiecedReplies : public RequestStream<QueuedStream<WriteReactor, Reply>, Request> {
 protected:
  using Base = RequestStream<QueuedStream<WriteReactor, Reply>, Request>;
  using Clock = std::chrono::steady_clock;

  // Bytes that may wait for the client before no slice is started. A choice: some messages, so that
  // the threads need not wait while gRPC's get their turn.
  static constexpr size_t kMostUnsentBytes = size_t{4} * Config::kReplyMessageBytes;
  // Bytes that a piece may hold while another is before it.
  static constexpr size_t kMostHeldBytes = Config::kReplyMessageBytes / 4;
  // Some hundred placements. With --max-concurrent-batches such calls, some MiB.
  static constexpr size_t kSmallBytes = 256 << 10;
  // Replies up to this size join the one that waits before them. A reply up to this size waits for
  // others while slices run, but no longer than this time by much: a write costs both sides as much
  // as a hundred pairs.
  static constexpr size_t kSmallReplyBytes = 32 << 10;
  static constexpr std::chrono::milliseconds kMostWait{2};

  // How pieces grow.
  struct Shape {
    uint64_t first_units;
    uint64_t most_units;
  };

  PiecedReplies(const grpc::ByteBuffer& request, grpc::CallbackServerContext& context,
                Admission& admission, Rpc rpc, Shards& shards, const PieceThreads& threads,
                const Shape& shape)
      : Base(request, context, admission, rpc),
        shards_(shards),
        readers_(threads.readers),
        lane_(threads.pool),
        waiting_(threads.waiting),
        most_pieces_(2 * static_cast<size_t>(threads.pool.threads())),
        most_units_(shape.most_units),
        charge_(shards.memory(), MemoryUse::kReading),
        piece_units_(shape.first_units) {}

  // Whether preparing takes about a slice when nothing has to be waited for.
  virtual bool IsShort() const = 0;
  // The call is prepared step by step, without the mutex, on one thread at a time.
  virtual absl::Status Validate() = 0;
  // What the call names, and how fresh that is to be. Requires that it is valid.
  virtual std::span<const std::string> HullIds() const = 0;
  virtual const ShardsFreshness& freshness() const = 0;
  // Whether the hulls were resolved: false when that may wait and `may_wait` is not set.
  virtual absl::StatusOr<bool> ResolveHulls(bool may_wait) = 0;
  virtual absl::Status Prepare() { return absl::OkStatus(); }
  // What the call holds until it ends, pieces apart. Called without the mutex after each of these
  // steps.
  virtual size_t HeldBytes() const = 0;

  Shards& shards() { return shards_; }

  // Runs `work` on ranges that together are [0, count), each once: a long call's on several threads
  // at a time. For the steps above.
  void ShareOut(size_t count, size_t step, const std::function<void(size_t, size_t)>& work) {
    if (IsShort()) return work(0, count);
    SharedLoop::Run(readers_, most_pieces_ / 2 - 1, count, step, work);
  }

  // Works on the piece until `end`, or until it is done: adds replies and advances `next`. Called
  // without the mutex, on any thread, by one thread at a time for each piece.
  virtual absl::Status Advance(Work& piece, Clock::time_point end) = 0;

  // The rest requires the mutex.

  // Queues a message of what comes before all answers, or keeps it for the first of them. Whether
  // more of that is to come. Called as the client reads, once the hulls are resolved.
  virtual bool QueueHead() = 0;
  // The number of units. Requires that the call is prepared.
  virtual uint64_t CountUnits() = 0;
  // Where the piece that starts at `begin` ends, at most `end`; for units whose cost is known.
  virtual uint64_t EndOfPiece(uint64_t begin, uint64_t end) const {
    static_cast<void>(begin);
    return end;
  }
  // Whether a slice of the piece may start while others are before it.
  virtual bool MayRunAhead(const Work& piece) const {
    static_cast<void>(piece);
    return true;
  }
  // Starts a slice of the piece. To be overridden where some pieces run elsewhere.
  virtual void Submit(Work& piece) {
    this->RunOn(lane_, [this, &piece] { RunSlice(piece); });
  }
  // Queues replies of the piece at the front; sees it with is_done once, at its end.
  virtual void Deliver(Work& piece) = 0;
  // Adds a small reply to the one that waits, in place of queueing it; false where they do not fit.
  virtual bool Join(const Reply& reply, Reply* waiting) = 0;
  // Every piece was delivered. To queue what comes last; the end is set afterwards.
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

  // Queues the replies that the piece holds, in order.
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
  // A short call whose hulls are ready need not wait for another thread.
  void Open() final {
    if (IsShort()) return this->RunOn(lane_, [this] { OpenWith(Validate(), false); });
    this->RunOn(readers_, [this] {
      absl::Status status = Validate();
      if (status.ok()) status = Charge();
      if (!status.ok() || !AwaitsFresh()) OpenWith(status, true);
    });
  }

  // Whether it waits for a store, to be opened when that has answered. No thread waits meanwhile:
  // a store that does not answer would hold all of them, also from calls that name nothing of it.
  bool AwaitsFresh() {
    const auto should_stop = [this] { return this->call().ShouldStop(); };
    const auto open = [this, self = this->shared_from_this()](const absl::Status& status) {
      this->RunOn(readers_, [this, status] { OpenWith(status, true); });
    };
    return waiting_.AwaitFresh(shards_, HullIds(), freshness(), should_stop, open);
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
      // What is known goes out while the rest is prepared.
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

  // RESOURCE_EXHAUSTED: there is no room for what the call holds. A small call is let in all the
  // same, as hulls in memory are served to those that name few.
  absl::Status Charge() {
    fixed_bytes_ = HeldBytes();
    charge_.Set(fixed_bytes_);
    if (fixed_bytes_ <= kSmallBytes) return absl::OkStatus();
    return shards_.CheckMemory(MemoryUse::kReading);
  }

  bool IsWorking() const final { return opening_ || running_ > 0; }

  // A slice that runs ends in a Locked step.
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
      piece->end = EndOfPiece(next_unit_, std::min(unit_count_, next_unit_ + piece_units_));
      HULLD_CHECK(piece->end > piece->next);
      next_unit_ = piece->end;
      pieces_.push_back(std::move(piece));
    }
    for (const std::unique_ptr<Work>& piece : pieces_) {
      if (piece->is_running || piece->is_done) continue;
      const bool is_front = piece == pieces_.front();
      if (!is_front && (piece->bytes >= kMostHeldBytes || !MayRunAhead(*piece))) continue;
      piece->is_running = true;
      ++running_;
      Submit(*piece);
    }
  }

  // Pieces grow and shrink so that each takes about one slice.
  void AdaptUnits(const Work& piece) {
    const auto least = std::chrono::nanoseconds(1);
    const double factor = std::chrono::duration<double>(TaskPool::kSliceTime) /
                          std::max<Clock::duration>(piece.elapsed, least);
    const double wished = static_cast<double>(piece.units) * std::min(factor, 4.0);
    piece_units_ = static_cast<uint64_t>(std::clamp(wished, 1.0, static_cast<double>(most_units_)));
  }

  Shards& shards_;
  WorkerPool& readers_;
  TaskPool::Lane lane_;
  WaitingCalls& waiting_;
  const size_t most_pieces_;
  const uint64_t most_units_;

  // While the call is opened they belong to the thread that does.
  MemoryCharge charge_;
  size_t fixed_bytes_ = 0;

  // The rest is guarded by the mutex; a running piece belongs to its slice.
  bool opening_ = true;
  // Something of what comes first is to be queued.
  bool is_head_left_ = false;
  uint64_t unit_count_ = 0;
  uint64_t next_unit_ = 0;
  // The size of the next piece.
  uint64_t piece_units_;
  // Under way, in order.
  std::deque<std::unique_ptr<Work>> pieces_;
  size_t running_ = 0;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_COLLISIONS_PIECED_REPLIES_H_
