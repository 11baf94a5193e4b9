// Streams of chunks.
#include <absl/strings/str_cat.h>

#include <algorithm>
#include <utility>

#include "server/contract/errors.h"
#include "tests/server/schedules/client.h"

namespace hulld::server {
namespace {

using State = Ledger::State;

}  // namespace

// A session and the chunks sent in it.
struct Client::Stream {
  size_t hull = 0;
  size_t writer = 0;
  AppendSession session;
  Ledger::Moment opened;
  uint64_t incarnation = 0;
  uint64_t last_sequence = 0;
  bool is_open = false;
  bool is_gone = false;
  // Answers of the chunks, by their order.
  struct Sent {
    Event built;
    Event answered;
    absl::Status status;
  };
  std::vector<std::shared_ptr<Sent>> sent;
};

void Client::AppendStream() {
  const auto stream = std::make_shared<Stream>();
  stream->hull = AnyHull();
  stream->writer = random().Below(static_cast<uint32_t>(simulation_.plan.writers));
  if (!OpenStream(stream, !random().OneIn(4))) return;
  const bool waits = random().OneIn(2);
  uint64_t sequence = stream->last_sequence + 1;
  // Resends, like a client that lost its answer.
  if (sequence > 1 && random().OneIn(simulation_.plan.repetitions)) --sequence;
  for (uint32_t chunks = random().Below(4); chunks > 0; --chunks, ++sequence) {
    SendChunk(stream, sequence);
    if (!waits) continue;
    stream->sent.back()->answered.Wait();
    if (!stream->sent.back()->status.ok()) break;
  }
  for (const auto& sent : stream->sent) {
    sent->built.Wait();
    sent->answered.Wait();
  }
  CheckOrder(*stream);
  Scheduler::Current().Note("closes a stream into hull", stream->hull, stream->writer);
  simulation_.registry.changes().CloseAppend(stream->session);
}

bool Client::OpenStream(const std::shared_ptr<Stream>& stream, bool create_if_absent) {
  const Call call = Begin(stream->hull);
  stream->opened = call.since;
  Scheduler::Current().Note("opens a stream into hull", stream->hull, stream->writer,
                            create_if_absent ? 1 : 0);
  const auto on_gone = [this, stream, call](const absl::Status&) {
    if (std::exchange(stream->is_gone, true)) Fail(call, "a stream is notified twice of its end");
  };
  const auto check = [&](const absl::StatusOr<OpenResult>& result) {
    if (result.ok()) return CheckOpened(call, *stream, *result);
    if (absl::IsNotFound(result.status()) && !create_if_absent) return CheckNotFound(call);
    if (create_if_absent && MayBeOther(call, result.status(), true)) return;
    if (MayFail(call, result.status(), false)) return;
    Fail(call, absl::StrCat("unexpected error: ", result.status().ToString()));
  };
  Await<OpenResult>(
      [&](Reply<OpenResult> done) {
        simulation_.registry.changes().OpenAppend(HullName(stream->hull),
                                                  WriterName(stream->writer), create_if_absent,
                                                  on_gone, std::move(done));
      },
      check);
  return stream->is_open;
}

void Client::CheckOpened(const Call& call, Stream& stream, const OpenResult& result) {
  stream.is_open = true;
  stream.session = result.session;
  stream.incarnation = result.hull.create_revision;
  stream.last_sequence = result.last_sequence;
  const auto is_it = [&](const State& state) {
    return state.exists && state.record == result.hull &&
           state.sequences[stream.writer] == result.last_sequence;
  };
  const auto state = ledger().Find(call.hull, call.since, is_it);
  if (result.session.created_hull) {
    return Claim(call, state, absl::StrCat("created at ", stream.incarnation));
  }
  if (!state.has_value()) {
    Fail(call, absl::StrCat("no state matches the answer to a stream: the last sequence of writer ",
                            WriterName(stream.writer), " is ", result.last_sequence,
                            " at revision ", result.hull.revision));
  }
  ledger().Report(call.hull, *state);
}

void Client::SendChunk(const std::shared_ptr<Stream>& stream, uint64_t sequence) {
  Call call = Begin(stream->hull);
  call.if_revision = AnyCondition(stream->hull);
  const auto sent = std::make_shared<Stream::Sent>();
  stream->sent.push_back(sent);
  Scheduler::Current().Note("sends hull, writer, chunk", stream->hull, stream->writer, sequence);
  const auto on_built = [sent] {
    if (sent->built.is_set()) Scheduler::Current().Fail("a chunk is built twice");
    sent->built.Set();
  };
  const auto done = [this, call, stream, sequence, sent](absl::StatusOr<ChunkResult> result) {
    if (sent->answered.is_set()) Fail(call, "a chunk is answered twice");
    CheckChunk(call, *stream, sequence, result);
    sent->status = result.status();
    sent->answered.Set();
  };
  simulation_.registry.changes().Append(
      stream->session,
      {sequence, PointsOf(ChunkPoints(stream->writer, sequence)), call.if_revision}, StopOf(call),
      on_built, done);
}

void Client::CheckChunk(const Call& call, const Stream& stream, uint64_t sequence,
                        const absl::StatusOr<ChunkResult>& result) {
  ++simulation_.reached.answers;
  if (!result.ok()) return CheckRefused(call, stream, result.status());
  if (!result->already_applied) return CheckApplied(call, stream, sequence, *result);
  ++simulation_.reached.repeated;
  const auto has_it = [&](const State& state) {
    return state.record.create_revision == stream.incarnation &&
           state.sequences[stream.writer] >= sequence &&
           state.record.revision == result->hull_revision;
  };
  const auto state = ledger().Find(call.hull, call.since, has_it);
  if (!state.has_value()) {
    Fail(call, absl::StrCat("chunk ", sequence,
                            " is incorrectly reported as already applied at revision ",
                            result->hull_revision));
  }
  ledger().Report(call.hull, *state);
}

void Client::CheckApplied(const Call& before, const Stream& stream, uint64_t sequence,
                          const ChunkResult& result) {
  Call call = before;
  const auto is_it = [&](const State& state) {
    return state.exists && state.record.create_revision == stream.incarnation &&
           state.sequences[stream.writer] == sequence && !state.is_claimed;
  };
  const auto state = ledger().Find(call.hull, call.since, is_it);
  // 0 stands for the revision at which this stream created the hull.
  if (call.if_revision == 0 && stream.session.created_hull) call.if_revision = stream.incarnation;
  Claim(call, state,
        absl::StrCat("chunk ", sequence, " of writer ", WriterName(stream.writer),
                     " is applied at revision ", result.hull_revision));
  const State& after = ledger().At(call.hull, *state);
  const CurveSet sent = ChunkPoints(stream.writer, sequence);
  const CurveSet added = after.points & ~ledger().At(call.hull, *state - 1).points;
  const PointCounts counts{CountOf(sent), CountOf(added), CountOf(sent) - CountOf(added), 0};
  if (result.hull_revision != after.record.revision || result.counts != counts ||
      result.vertex_count != after.record.vertex_count ||
      result.store_revision < after.record.revision) {
    Fail(call, absl::StrCat("chunk ", sequence, " is answered with incorrect numbers"));
  }
}

void Client::CheckRefused(const Call& call, const Stream& stream, const absl::Status& status) {
  Reached& reached = simulation_.reached;
  const auto is_another = [&](const State& state) {
    return !state.exists || state.record.create_revision != stream.incarnation;
  };
  const bool was_created = stream.session.created_hull;
  const auto differs = [&](const State& state) {
    if (*call.if_revision == 0) {
      return !was_created || state.record.revision != stream.incarnation;
    }
    return state.record.revision != *call.if_revision;
  };
  switch (ReasonOf(status)) {
    case v1::ERROR_REASON_HULL_GONE:
      ++reached.gone;
      if (ledger().Find(call.hull, call.since, is_another)) return;
      break;
    case v1::ERROR_REASON_SEQUENCE_GAP:
      ++reached.gaps;
      return;  // reported by CheckOrder
    case v1::ERROR_REASON_REVISION_MISMATCH:
      ++reached.aborted;
      if (call.if_revision.has_value() && ledger().Find(call.hull, call.since, differs)) return;
      break;
    default:
      if (MayFail(call, status, true)) return;
  }
  Fail(call, absl::StrCat("unexpected error: ", status.ToString()));
}

// A gap follows a chunk refused for another reason. Answers may arrive out of order.
void Client::CheckOrder(const Stream& stream) {
  const auto refused =
      std::ranges::find_if(stream.sent, [](const auto& sent) { return !sent->status.ok(); });
  if (refused == stream.sent.end()) return;
  if (ReasonOf((*refused)->status) != v1::ERROR_REASON_SEQUENCE_GAP) return;
  Scheduler::Current().Fail(absl::StrCat(
      "a gap is reported, but no earlier chunk was refused: ", (*refused)->status.ToString(), "\n",
      ledger().Describe(stream.hull)));
}

void Client::CheckSequences(size_t hull) {
  for (size_t writer = 0; writer < kWriters; ++writer) {
    const auto stream = std::make_shared<Stream>();
    stream->hull = hull;
    stream->writer = writer;
    if (!OpenStream(stream, false)) continue;
    simulation_.registry.changes().CloseAppend(stream->session);
  }
}

}  // namespace hulld::server
