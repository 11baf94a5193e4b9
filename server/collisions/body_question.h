#ifndef HULLD_SERVER_COLLISIONS_BODY_QUESTION_H_
#define HULLD_SERVER_COLLISIONS_BODY_QUESTION_H_

#include <absl/status/statusor.h>

#include <functional>
#include <memory>

#include "core/query/body/body_search.h"
#include "core/query/body/placed_body.h"
#include "core/query/terms/query_options.h"
#include "server/process/fair_queue.h"
#include "server/process/task_pool.h"
#include "server/registry/body_resolution.h"

namespace hulld::server {

// A query of a pair with at least one body, answered in slices, the first of which precedes
// batches. Owns itself until it is answered.
class BodyQuestion : public std::enable_shared_from_this<BodyQuestion> {
 public:
  // A body, or a hull as a body with a single piece, at a pose.
  class Side {
   public:
    // canonical: as in the lookup of the hulls.
    Side(HullView view, const Pose& X_W, bool canonical);
    Side(const Side&) = delete;
    Side& operator=(const Side&) = delete;

    const HullView& view() const { return view_; }
    bool is_body() const { return view_.body != nullptr; }
    const PlacedBody& placed() const { return placed_; }

   private:
    const HullView view_;
    const std::unique_ptr<const QueryBody> own_;
    const PlacedBody placed_;
  };
  using Done = std::function<void(absl::StatusOr<BodyAnswer>, const Side& a, const Side& b)>;

  // client: the client that waits for the answer. `done` is called exactly once, on a thread of the
  // pool. Requires valid options for bodies (ValidateForBodies). CANCELLED: options.should_stop
  // returned true.
  static void Start(TaskPool& pool, HullView a, const Pose& X_WA, HullView b, const Pose& X_WB,
                    const QueryOptions& options, ClientId client, Done done);

 private:
  BodyQuestion(TaskPool& pool, HullView a, const Pose& X_WA, HullView b, const Pose& X_WB,
               const QueryOptions& options, ClientId client, Done done);
  void RunSlice();

  const QueryOptions options_;
  const ClientId client_;
  const Side a_;
  const Side b_;
  BodySearch search_;
  const Done done_;
  TaskPool::Lane lane_;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_COLLISIONS_BODY_QUESTION_H_
