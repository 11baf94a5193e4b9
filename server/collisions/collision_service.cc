#include "server/collisions/collision_service.h"

#include <absl/status/status.h>

#include <memory>
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

UnaryReactor* CollisionService::CheckCollision(CallContext* context, const Bytes* request,
                                               Bytes* response) {
  return CheckCall::Start(*context, parts_.admission, Rpc::kCheckCollision, {request, response},
                          [this](CheckCall* call) { Check(call); });
}

void CollisionService::Check(CheckCall* call) {
  parts_.pool.NoteSingleCall();
  absl::StatusOr<std::shared_ptr<PairQuestion>> read = PairQuestion::Read(parts_, call);
  if (!read.ok()) return call->End(read.status());
  const std::shared_ptr<PairQuestion> question = *std::move(read);
  if (question->TryAnswer()) return;
  // A store with peer servers is queried first; no thread waits for its answer.
  const auto answer = [this, call, question](const absl::Status& status) {
    if (!status.ok()) return call->End(status);
    const bool may_answer = waiting_.count() < kMostAnsweredInTurn;
    if (!may_answer || !question->TryAnswer()) AnswerLater(question, call->call().client());
  };
  const bool waits =
      waiting_.AwaitFresh(parts_.registry, question->freshness(), question->should_stop(), answer);
  if (!waits) AnswerLater(question, call->call().client());
}

void CollisionService::AnswerLater(std::shared_ptr<PairQuestion> question, ClientId client) {
  parts_.readers.Submit([question = std::move(question)] { question->Answer(); }, client);
}

WriteReactor* CollisionService::BatchCheckCollisions(CallContext* context, const Bytes* request) {
  return BatchStream::Launch(std::make_shared<BatchStream>(*context, parts_, *request));
}

BidiReactor* CollisionService::StreamCollisions(CallContext* context) {
  return CollisionStream::Launch(std::make_shared<CollisionStream>(*context, parts_));
}

WriteReactor* CollisionService::FindCollisions(CallContext* context, const Bytes* request) {
  return SceneStream::Launch(std::make_shared<SceneStream>(*context, parts_, *request));
}

BidiReactor* CollisionService::WatchCollisions(CallContext* context) {
  return CollisionWatch::Launch(std::make_shared<CollisionWatch>(*context, parts_));
}

}  // namespace hulld::server
