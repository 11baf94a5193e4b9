#include "server/collisions/body_question.h"

#include <chrono>
#include <utility>

namespace hulld::server {
namespace {

// Steps between two reads of the clock.
constexpr uint64_t kStepsPerAdvance = 64;

std::unique_ptr<const QueryBody> FormOf(const HullView& view, bool canonical) {
  if (view.body != nullptr) return nullptr;
  return std::make_unique<const QueryBody>(canonical ? view.served->canonical_query_hull()
                                                     : view.served->query_hull());
}

}  // namespace

BodyQuestion::Side::Side(HullView view, const Pose& X_W, bool canonical)
    : view_(std::move(view)),
      own_(FormOf(view_, canonical)),
      placed_(own_ != nullptr ? *own_ : view_.body->query, X_W) {}

BodyQuestion::BodyQuestion(TaskPool& pool, HullView a, const Pose& X_WA, HullView b,
                           const Pose& X_WB, const QueryOptions& options, ClientId client,
                           Done done)
    : options_(options),
      client_(client),
      a_(std::move(a), X_WA, options.WantsCanonical()),
      b_(std::move(b), X_WB, options.WantsCanonical()),
      search_(a_.placed(), b_.placed(), options_),
      done_(std::move(done)),
      lane_(pool) {}

void BodyQuestion::Start(TaskPool& pool, HullView a, const Pose& X_WA, HullView b, const Pose& X_WB,
                         const QueryOptions& options, ClientId client, Done done) {
  const std::shared_ptr<BodyQuestion> question(new BodyQuestion(
      pool, std::move(a), X_WA, std::move(b), X_WB, options, client, std::move(done)));
  pool.Submit([question] { question->RunSlice(); }, client);
}

void BodyQuestion::RunSlice() {
  const auto end = std::chrono::steady_clock::now() + TaskPool::kSliceTime;
  while (true) {
    const absl::StatusOr<bool> ended = search_.Advance(kStepsPerAdvance);
    if (!ended.ok()) return done_(ended.status(), a_, b_);
    if (*ended) return done_(search_.Take(), a_, b_);
    if (std::chrono::steady_clock::now() >= end) break;
  }
  lane_.Submit([self = shared_from_this()] { self->RunSlice(); }, client_);
}

}  // namespace hulld::server
