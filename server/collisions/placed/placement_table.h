#ifndef HULLD_SERVER_COLLISIONS_PLACED_PLACEMENT_TABLE_H_
#define HULLD_SERVER_COLLISIONS_PLACED_PLACEMENT_TABLE_H_

#include <absl/status/status.h>
#include <absl/status/statusor.h>
#include <google/protobuf/repeated_field.h>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <unordered_map>
#include <vector>

#include "core/base/check.h"
#include "core/query/body/placed_body.h"
#include "core/query/box_tree.h"
#include "core/query/motion/first_contact.h"
#include "core/query/motion/moving_body.h"
#include "core/query/motion/swept_box.h"
#include "core/query/placed/placed_hull.h"
#include "core/query/terms/motion.h"
#include "core/query/terms/pose.h"
#include "core/query/terms/query_options.h"
#include "hulld/v1/collision.pb.h"
#include "server/access/caller.h"
#include "server/contract/errors.h"
#include "server/registry/body_resolution.h"
#include "server/registry/registry.h"
#include "server/wire/decode.h"

namespace hulld::server {

// Placements of a call, by index. Each is either ready for queries, or has an error that explains
// why it cannot be answered and an empty hull as a stand-in.
class PlacementTable {
 public:
  PlacementTable() = default;
  // Reads a request in one of the two forms, and moves the poses of packed placements out of it.
  // Records malformed placements and IDs outside the caller's prefix. No hull is known before
  // Resolve, which also builds the hulls of inline shapes. INVALID_ARGUMENT: both forms are used,
  // or packed lists do not match. RESOURCE_EXHAUSTED: more than max_placements (--max-placements).
  // what: container of the placements, as in "the batch".
  static absl::StatusOr<PlacementTable> Make(
      const google::protobuf::RepeatedPtrField<v1::Placement>& placements,
      v1::PackedPlacements& packed, const Caller& caller, uint64_t max_placements,
      const char* what);

  // Like Make, for the placements "a" and "b" of a pair. Returns the error of the first malformed
  // one.
  static absl::StatusOr<PlacementTable> MakePair(const v1::Placement& a, const v1::Placement& b,
                                                 const Caller& caller);

  // Computes placed hulls at each use instead of in advance, for a call that uses each about once.
  // Call before Resolve.
  void PlaceOnDemand() { places_on_demand_ = true; }

  // Resolves every hull and body once, all at one revision of the store, for queries with
  // `options`. Not for gRPC threads unless plan.may_wait is false. CANCELLED:
  // options.should_stop returned true. WouldWait: see ReadPlan::may_wait.
  absl::Status Resolve(Registry& registry, const QueryOptions& options, const ReadPlan& plan);

  // Like Resolve, for repeated calls: looks up only hulls that changed since the last one.
  absl::Status Refresh(Registry& registry, const QueryOptions& options, const ReadPlan& plan);

  size_t size() const { return hull_of_.size(); }
  // Number of distinct hulls. The hulls of hull_ids() come first, then those of inline shapes.
  size_t hull_count() const { return ids_.size() + shape_count_; }
  // Approximate bytes held after resolution, excluding hulls.
  size_t MemoryBytes() const;
  // The placed hulls; an empty hull for a body. Requires that they are not placed on demand.
  std::span<const PlacedHull> placed() const {
    HULLD_DCHECK(!places_on_demand_);
    return placed_;
  }
  // The i-th placed hull; stored in `made` if placed on demand.
  const PlacedHull& PlacedAt(size_t i, std::optional<PlacedHull>* made) const {
    return places_on_demand_ ? made->emplace(Place(i)) : placed_[i];
  }
  // True if a placement is, or was, a body. In that case, bodies() contains every placement,
  // including hulls; otherwise it is empty.
  bool has_bodies() const { return !bodies_.empty(); }
  std::span<const PlacedBody> bodies() const { return bodies_; }
  bool is_body(size_t i) const { return has_bodies() && !bodies_[i].body().is_hull(); }
  // True if the request sets an end pose for a placement, even if it equals the placement's pose.
  bool has_motions() const { return !end_poses_.empty(); }
  // The placement in motion, for a request with motions; an empty hull for a body.
  MovingHull MovingAt(size_t i) const { return {HullAt(i), MotionAt(i), RadiusAt(i)}; }
  // Like MovingAt, for a hull or body. Requires has_bodies().
  MovingBody MovingBodyAt(size_t i) const { return {bodies_[i].body(), MotionAt(i), RadiusAt(i)}; }
  // Bounding box of a placement at rest, in the world frame.
  Box BoxOf(size_t i) const {
    return is_body(i) ? BoundingBox(bodies_[i]) : BoundingBox(placed()[i]);
  }
  // Bounding box of a placement in motion; empty if it is not answerable.
  MovingBox MovingBoxAt(size_t i) const;
  // The hull of a placement; empty for a body, or if it is not answerable.
  const QueryHull& HullAt(size_t i) const;
  // Like HullAt; for a body, the hull of the piece.
  const QueryHull& HullOfPiece(size_t i, uint32_t piece) const {
    if (!has_bodies()) return HullAt(i);
    const auto pieces = bodies_[i].body().pieces();
    return piece < pieces.size() ? *pieces[piece].hull : HullAt(i);
  }
  bool is_answerable(size_t i) const {
    return is_all_answerable_ || (!IsMalformed(i) && hulls_[hull_of_[i]].ok());
  }
  // Reason why the placement is not answerable; OK if it is. Requires that the hulls were resolved.
  const absl::Status& problem(size_t i) const;
  // True if the last Resolve changed, removed, or added this placement's hull or, for a body,
  // changed the hull of a piece.
  bool hull_changed(size_t i) const;
  // True if the last Resolve replaced this placement's QueryHull, perhaps for the same hull.
  // Earlier results refer to points of the previous QueryHull.
  bool query_hull_changed(size_t i) const;

  // Returns the lookup of hull_ids() and of the inline shapes for queries with these options.
  // Refers to this table.
  PlacedLookup LookupFor(const QueryOptions& options, const ReadPlan& plan) const;
  // Sets all hulls. resolved: the hulls of hull_ids(), followed by those of the inline shapes.
  void SetHulls(const Store& store, Resolved resolved, const QueryOptions& options);
  // Sets some of the hulls of hull_ids(), given by index, each once. All other hulls remain
  // unchanged. resolved: parallel to `hulls`. Requires SortByHull.
  void SetSomeHulls(std::span<const size_t> hulls, Resolved resolved, const QueryOptions& options);

  // Requires a valid pose (ValidatePose).
  void Move(size_t i, const Pose& X_WH);
  // Like Move, for a caller that calls Refresh next.
  void SetPose(size_t i, const Pose& X_WH);

  // IDs of the hulls, excluding inline shapes. Contains no duplicates, unless packed placements
  // name an ID several times.
  std::span<const std::string> hull_ids() const { return ids_; }
  // Hull k, or its error. Requires that it was resolved.
  const absl::StatusOr<HullView>& hull(size_t k) const {
    HULLD_DCHECK(k < hulls_.size());
    return hulls_[k];
  }
  // Indexes the placements by their hull, for placements_of and SetSomeHulls. Cost: O(n).
  void SortByHull();
  // Placements of hull k. Requires SortByHull.
  std::span<const uint32_t> placements_of(size_t k) const {
    HULLD_DCHECK(k < placements_of_.size());
    return placements_of_[k];
  }
  // Hull of a placement; nullopt if the ID, the inline shape, or the radius is malformed, or the ID
  // is outside the caller's prefix.
  std::optional<size_t> hull_of(size_t i) const {
    return HasHull(i) ? std::optional<size_t>(hull_of_[i]) : std::nullopt;
  }

  // Revision and staleness of the last Resolve.
  const AsOf& as_of() const { return as_of_; }
  // Encodes rows of a table, starting with row `first`, as many as fill a message: a version per
  // placement, or per hull named by packed placements, and the problems; then, if certificates are
  // wanted, the hulls of pieces. Returns the first row of the next message, or table_rows() after
  // the last row.
  template <typename Message>
  size_t EncodeHulls(size_t first, Message* message) const {
    return EncodeRows(first, {message->mutable_hulls(), message->mutable_placement_problems(),
                              message->mutable_piece_hulls()});
  }
  size_t table_rows() const { return named_.size() + listed_placements_ + hulls_of_pieces_.size(); }
  void EncodeHull(size_t k, v1::HullVersion* version) const;
  // Encodes the deciding pieces of a pair of placements into piece_a and piece_b of the message.
  // Omits the piece of a hull.
  template <typename Message>
  void EncodeDecidingPieces(size_t a, size_t b, const PiecePair& pieces, Message* message) const {
    if (is_body(a)) EncodeDecidingPiece(a, pieces.a, message->mutable_piece_a());
    if (is_body(b)) EncodeDecidingPiece(b, pieces.b, message->mutable_piece_b());
  }
  // Requires that the placement is not answerable.
  void EncodeProblem(size_t i, v1::PlacementProblem* message) const;

 private:
  // Not an index into hulls_.
  static constexpr uint32_t kNoHull = UINT32_MAX;

  // Destination of the rows.
  struct RowFields {
    google::protobuf::RepeatedPtrField<v1::HullVersion>* hulls;
    google::protobuf::RepeatedPtrField<v1::PlacementProblem>* problems;
    google::protobuf::RepeatedPtrField<v1::HullVersion>* piece_hulls;
  };

  PlacementTable(std::span<const v1::Placement* const> placements, std::string (*field)(size_t i),
                 const Caller& caller);
  PlacementTable(v1::PackedPlacements& packed, std::span<const Vector> shape_points,
                 const Caller& caller);

  bool HasHull(size_t i) const { return hull_of_[i] != kNoHull; }
  bool IsMalformed(size_t i) const { return !malformed_.empty() && malformed_.contains(i); }
  template <typename Field>
  void CheckPoses(size_t i, const Field& field);
  Motion MotionAt(size_t i) const { return {PoseAt(i), ReadPose(end_poses_, i)}; }
  double RadiusAt(size_t i) const { return radii_.empty() ? 0 : radii_[static_cast<int>(i)]; }
  Pose PoseAt(size_t i) const { return ReadPose(poses_, i); }
  absl::Status ResolveFrom(Registry& registry, KnownPlaced& known, const QueryOptions& options,
                           const ReadPlan& plan);
  void TakeBodies();
  void TakeBody(size_t k);
  void TakeHullsOfPieces();
  void NoteProblems();
  size_t EncodeRows(size_t first, const RowFields& to) const;
  size_t EncodePlacement(size_t row, const RowFields& to) const;
  void EncodeDecidingPiece(size_t i, uint32_t piece, v1::DecidingPiece* message) const;
  size_t BodyBytes() const;
  PlacedBody PlaceBody(size_t i) const;
  PlacedHull Place(size_t i) const;
  void PlaceAgain(size_t i);

  // For each placement: its hull as an index into hulls_, or kNoHull if hull_of() is nullopt; and
  // its pose, packed.
  std::vector<uint32_t> hull_of_;
  google::protobuf::RepeatedField<double> poses_;
  // End poses, in the same form as poses_; empty if no placement moves.
  google::protobuf::RepeatedField<double> end_poses_;
  // Radius of each placement; empty if all are 0.
  google::protobuf::RepeatedField<double> radii_;
  // Errors of malformed IDs, inline shapes, radii, and poses, by placement.
  std::unordered_map<size_t, absl::Status> malformed_;
  bool is_packed_ = false;
  // Index into hulls_ of each hull named by packed placements.
  std::vector<uint32_t> named_;
  std::vector<std::string> ids_;
  // Points of the inline shapes, until their hulls are built.
  InlineShapes shapes_;
  size_t shape_count_ = 0;
  // Hulls of ids_, then of the inline shapes.
  std::vector<absl::StatusOr<HullView>> hulls_;
  // Used by Refresh.
  KnownPlaced known_;
  // Query structure of each hull, or NoHull's.
  std::vector<const QueryHull*> query_hulls_;
  std::vector<char> changed_;
  std::vector<char> query_hull_changed_;
  // After SortByHull, the placements of each hull.
  std::vector<std::vector<uint32_t>> placements_of_;
  // Store and revision of the last Resolve.
  const Store* store_ = nullptr;
  AsOf as_of_;
  // True if no placement had a problem at the last resolution, the common case.
  bool is_all_answerable_ = false;
  // Number of placements, from the first, with rows in the table of hulls. Packed placements have
  // rows only for problems, so the number is 0 without problems.
  size_t listed_placements_ = 0;
  bool places_on_demand_ = false;
  // Empty if placed on demand.
  std::vector<PlacedHull> placed_;

  // Prefix of the IDs visible to the caller.
  std::string prefix_;
  // If any of hulls_ is a body: the query structure of each, parallel to hulls_. Structures of
  // hulls are owned here.
  std::vector<const QueryBody*> query_bodies_;
  std::vector<std::unique_ptr<const QueryBody>> bodies_of_hulls_;
  std::vector<PlacedBody> bodies_;
  // If certificates are wanted: the hulls of all pieces, without duplicates; owned by hulls_.
  std::vector<const HullRecord*> hulls_of_pieces_;
};

// Returns OK if no placement has an end pose. INVALID_ARGUMENT, naming the first field with one:
// the call does not accept motions. what: the subject of the error, as in "a stream".
absl::Status CheckNoMotions(const google::protobuf::RepeatedPtrField<v1::Placement>& placements,
                            const v1::PackedPlacements& packed, const char* what);

// Checks that the first message of a stream, and no other, is `open`. Otherwise returns
// INVALID_ARGUMENT. twice: the error for a second `open`.
template <typename Request>
absl::Status CheckOrder(const Request& request, bool is_open, const char* twice) {
  if (!request.has_open() && !request.has_update()) {
    return InvalidArgument("the message is empty; set open or update");
  }
  if (request.has_open() && is_open) return InvalidArgument(twice);
  if (request.has_open() || is_open) return absl::OkStatus();
  return InvalidArgument("the first message must be open, not update");
}

// Validates an update of a stream with `count` placements: the new pose of each of `placements`, as
// read by ReadPose. INVALID_ARGUMENT: the lists do not match, an index is out of range or repeated,
// or a pose is malformed.
absl::Status ValidateMoves(const google::protobuf::RepeatedField<uint32_t>& placements,
                           const google::protobuf::RepeatedField<double>& poses, size_t count);
// Validating an update with at most this many poses takes less than a slice.
inline constexpr int kMaxShortUpdate = 4096;

// Returns an error text that states the number of placements. It fits both forms of a request,
// because it names no field that the caller may not have sent.
std::string PlacementCountText(size_t count);

// INVALID_ARGUMENT: an odd number of indices, or an index out of range. RESOURCE_EXHAUSTED: more
// than max_pairs (--max-pairs-per-batch).
absl::Status ValidatePairs(const google::protobuf::RepeatedField<uint32_t>& pairs,
                           size_t placements, uint64_t max_pairs, const char* what);

}  // namespace hulld::server

#endif  // HULLD_SERVER_COLLISIONS_PLACED_PLACEMENT_TABLE_H_
