#include "server/collisions/collision_service.h"

#include <absl/status/status.h>

#include <memory>
#include <optional>
#include <utility>

#include "server/collisions/batch_stream.h"
#include "server/collisions/collision_stream.h"
#include "server/collisions/scene_stream.h"
#include "server/collisions/watch/collision_watch.h"

namespace hulld::server {
namespace {

// Maximum number of waiting calls that the committing thread answers itself after a store query, in
// place of dispatching them: 32 queries of some 10 us delay its commits by about a round trip.
constexpr size_t kMostAnsweredInTurn = 32;

}  // namespace

grpc::ServerUnaryReactor* CollisionService::CheckCollision(grpc::CallbackServerContext* context,
                                                           const grpc::ByteBuffer* request,
                                                           grpc::ByteBuffer* response) {
  return CheckCall::Start(*context, admission_, Rpc::kCheckCollision, {request, response},
                          [this](CheckCall* call) { Check(call); });
}

void CollisionService::Check(CheckCall* call) {
  pool_.NoteSingleCall();
  absl::StatusOr<std::shared_ptr<PairQuestion>> read = PairQuestion::Read(registry_, call);
  if (!read.ok()) return call->End(read.status());
  const std::shared_ptr<PairQuestion> question = *std::move(read);
  if (TryAnswer(*question)) return;
  // A store with peer servers is queried first; no thread waits for its answer.
  const auto answer = [this, call, question](const absl::Status& status) {
    if (!status.ok()) return call->End(status);
    const bool may_answer = waiting_.count() < kMostAnsweredInTurn;
    if (!may_answer || !TryAnswer(*question)) AnswerLater(question, call->call().client());
  };
  const bool waits = waiting_.AwaitFresh(registry_, question->lookup().plan.freshness,
                                         question->should_stop(), answer);
  if (!waits) AnswerLater(question, call->call().client());
}

// Returns false if the hulls cannot be resolved without blocking.
bool CollisionService::TryAnswer(PairQuestion& question) {
  std::optional<Resolved> ready = TryResolvePlaced(registry_, question.ids(), question.lookup());
  if (!ready.has_value()) return false;
  question.Answer(*std::move(ready), pool_);
  return true;
}

// Waits for the store, or for canonical snapshots or boxes of pieces to be built.
void CollisionService::AnswerLater(std::shared_ptr<PairQuestion> question, ClientId client) {
  readers_.Submit(
      [this, question = std::move(question)] {
        question->Answer(
            ResolvePlaced(registry_, question->ids(), question->lookup(), question->should_stop()),
            pool_);
      },
      client);
}

WriteReactor* CollisionService::BatchCheckCollisions(grpc::CallbackServerContext* context,
                                                     const grpc::ByteBuffer* request) {
  return BatchStream::Start(*context, admission_, registry_, {long_readers_, pool_, waiting_},
                            *request);
}

BidiReactor* CollisionService::StreamCollisions(grpc::CallbackServerContext* context) {
  return CollisionStream::Start(*context, admission_, registry_, readers_, long_readers_, pool_,
                                waiting_);
}

WriteReactor* CollisionService::FindCollisions(grpc::CallbackServerContext* context,
                                               const grpc::ByteBuffer* request) {
  return SceneStream::Start(*context, admission_, registry_, {long_readers_, pool_, waiting_},
                            *request);
}

BidiReactor* CollisionService::WatchCollisions(grpc::CallbackServerContext* context) {
  return CollisionWatch::Start(*context, admission_, registry_, readers_, long_readers_, pool_);
}

}  // namespace hulld::server
