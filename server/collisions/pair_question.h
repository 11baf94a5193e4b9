#ifndef HULLD_SERVER_COLLISIONS_PAIR_QUESTION_H_
#define HULLD_SERVER_COLLISIONS_PAIR_QUESTION_H_

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <array>
#include <chrono>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/query/body/body_search.h"
#include "core/query/body/placed_body.h"
#include "core/query/collision.h"
#include "core/query/motion/first_contact.h"
#include "core/query/motion/moving_body.h"
#include "core/query/motion/moving_body_search.h"
#include "core/query/terms/query_options.h"
#include "hulld/v1/collision.pb.h"
#include "server/call/unary_call.h"
#include "server/process/task_pool.h"
#include "server/registry/body_resolution.h"
#include "server/registry/inline_shapes.h"
#include "server/registry/registry.h"

namespace hulld::server {

using CheckCall = UnaryCall<v1::CheckCollisionRequest, v1::CheckCollisionResponse>;

// A hull or a body at a pose: one side of a pair.
class PairSide {
 public:
  // canonical: as in the lookup of the hulls. as_body: true if the other side is a body; a hull is
  // then a body with a single piece.
  PairSide(HullView view, const Pose& X_W, double radius, bool canonical, bool as_body);
  PairSide(const PairSide&) = delete;
  PairSide& operator=(const PairSide&) = delete;

  bool is_body() const { return view_.body != nullptr; }
  const HullView& view() const { return view_; }
  // Require the form that the constructor made.
  const PlacedHull& hull() const { return *hull_; }
  const PlacedBody& body() const { return *body_; }
  // The hull of a piece of body().
  const QueryHull& HullOfPiece(uint32_t piece) const { return *body().body().pieces()[piece].hull; }

 private:
  const HullView view_;
  std::optional<PlacedHull> hull_;
  std::unique_ptr<const QueryBody> own_;
  std::optional<PlacedBody> body_;
};

// Motions of A and B, and their first contact.
struct MotionQuestion {
  std::array<Motion, 2> X_W;
  MotionOptions options;
  FirstContact contact;
  // With a body: both sides, and the state between slices.
  std::vector<MovingBody> bodies;
  std::unique_ptr<MovingBodySearch> search;
};

// A CheckCollision call about two placements, each a hull or a body. It is answered in slices, so
// that other calls get their turn. A query of two hulls takes one slice, of some milliseconds at
// most; the textbook's test and a search of bodies take as many as they need. Used by one thread at
// any time.
class PairQuestion : public std::enable_shared_from_this<PairQuestion> {
 public:
  // Reads everything except the hulls. `call` must not end before the question is answered.
  static absl::StatusOr<std::shared_ptr<PairQuestion>> Read(Registry& registry, CheckCall* call);

  std::span<const std::string> ids() const { return ids_; }
  const PlacedLookup& lookup() const { return lookup_; }
  const std::function<bool()>& should_stop() const { return options_.should_stop; }

  // Answers and ends the call. resolved: the result of looking up ids(); its error ends the call.
  // An answer that takes some microseconds is computed immediately; any other on the pool, with its
  // first slice before those of batches.
  void Answer(absl::StatusOr<Resolved> resolved, TaskPool& pool);

 private:
  explicit PairQuestion(Registry& registry, CheckCall* call)
      : registry_(registry), call_(call), charge_(registry.memory(), MemoryUse::kReading) {}

  absl::Status ReadRequest();
  absl::Status ReadPlacement(size_t side, bool present, const v1::Placement& placement);
  absl::Status ReadMotion();
  absl::Status Place(Resolved resolved);
  bool is_textbook() const { return options_.method == Method::kTextbookSat; }
  bool IsQuick() const;
  void RunSlice(TaskPool& pool);
  // Works until the answer is found, then returns true, or until `end`.
  absl::StatusOr<bool> Advance(std::chrono::steady_clock::time_point end);
  absl::StatusOr<bool> AdvanceTextbook(std::chrono::steady_clock::time_point end);
  absl::StatusOr<bool> AdvanceBodies(std::chrono::steady_clock::time_point end);
  absl::StatusOr<bool> AdvanceMotion();
  absl::StatusOr<bool> AdvanceMovingBodies(std::chrono::steady_clock::time_point end);
  // Fill the response.
  absl::Status Encode();
  absl::Status EncodeMotion();
  void EncodePieces();

  Registry& registry_;
  CheckCall* const call_;
  // Poses and radii of A and B.
  std::array<Pose, 2> X_W_;
  std::array<double, 2> radii_;
  // Indices of A and B: into shapes_ for a placement with points, otherwise into ids_.
  std::array<size_t, 2> subjects_;
  std::vector<std::string> ids_;
  InlineShapes shapes_;
  QueryOptions options_;
  PlacedLookup lookup_;
  std::optional<PairSide> a_;
  std::optional<PairSide> b_;
  bool has_body_ = false;
  // If A or B has an end pose.
  std::optional<MotionQuestion> motion_;
  // State between slices, and its charge.
  std::optional<TextbookCheck> check_;
  std::optional<BodySearch> search_;
  MemoryCharge charge_;
  BodyAnswer answer_;
  // For all slices but the first.
  std::optional<TaskPool::Lane> lane_;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_COLLISIONS_PAIR_QUESTION_H_
