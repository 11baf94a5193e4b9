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
#include <utility>
#include <vector>

#include "core/base/check.h"
#include "core/query/body/placed_body.h"
#include "core/query/box_tree.h"
#include "core/query/placed/placed_hull.h"
#include "core/query/terms/pose.h"
#include "core/query/terms/query_options.h"
#include "hulld/v1/collision.pb.h"
#include "server/access/caller.h"
#include "server/shards/body_resolution.h"
#include "server/shards/shards.h"
#include "server/wire/decode.h"

namespace hulld::server {

// The placements of one call, by index: each ready for queries, or with the reason why it cannot be
// answered for. One that cannot stands in as an empty hull.
class PlacementTable {
 public:
  PlacementTable() = default;
  // Reads a request that has one of the two forms, and takes the poses of packed placements out of
  // it. Notes what is malformed and what is not the caller's; no hull is known before Resolve.
  // INVALID_ARGUMENT: both forms, or packed ones whose lists do not fit each other.
  // RESOURCE_EXHAUSTED: more than max_placements (--max-placements). `what` holds them, as in "the
  // batch".
  static absl::StatusOr<PlacementTable> Make(
      const google::protobuf::RepeatedPtrField<v1::Placement>& placements,
      v1::PackedPlacements& packed, const Caller& caller, uint64_t max_placements,
      const char* what);

  // Placements are placed when they are asked for, each time: for a call that asks for each of them
  // about once. Before Resolve.
  void PlaceOnDemand() { places_on_demand_ = true; }

  // Resolves every hull and body once, all at one revision of the store, for queries that answer
  // with `options`. Not for gRPC's threads. CANCELLED: options.should_stop said so.
  absl::Status Resolve(Shards& shards, const QueryOptions& options, const ShardsPlan& plan);

  // The same for a caller that does so again and again: only hulls that changed since are looked
  // up.
  absl::Status Refresh(Shards& shards, const QueryOptions& options, const ShardsPlan& plan);

  // The same as Resolve, but false, at once, where it would have to wait or to make something.
  bool TryResolve(Shards& shards, const QueryOptions& options, const ShardsPlan& plan);

  size_t size() const { return hull_of_.size(); }
  // How many hulls there are for them.
  size_t hull_count() const { return ids_.size(); }
  // About what this holds once it is resolved, in bytes, hulls apart.
  size_t MemoryBytes() const;
  // The placed hulls; an empty hull stands in for a body. Requires that they are not placed on
  // demand.
  std::span<const PlacedHull> placed() const {
    HULLD_DCHECK(!places_on_demand_);
    return placed_;
  }
  // One placed hull; held by `made` where they are placed on demand.
  const PlacedHull& PlacedAt(size_t i, std::optional<PlacedHull>* made) const {
    return places_on_demand_ ? made->emplace(Place(i)) : placed_[i];
  }
  // Whether a placement is a body, or was one; then bodies() holds every placement, hulls too.
  // Otherwise it is empty.
  bool has_bodies() const { return !bodies_.empty(); }
  std::span<const PlacedBody> bodies() const { return bodies_; }
  bool is_body(size_t i) const { return has_bodies() && !bodies_[i].body().is_hull(); }
  // A box about a placement, world frame: BoundingBox.
  Box BoxOf(size_t i) const {
    return is_body(i) ? BoundingBox(bodies_[i]) : BoundingBox(placed()[i]);
  }
  // What is placed; an empty hull for a body, or for what cannot be answered for.
  const QueryHull& HullAt(size_t i) const;
  // The same, but of a body the hull of a piece.
  const QueryHull& HullOfPiece(size_t i, uint32_t piece) const {
    const auto pieces = bodies_[i].body().pieces();
    return piece < pieces.size() ? *pieces[piece].hull : HullAt(i);
  }
  bool is_answerable(size_t i) const {
    return is_all_answerable_ || (!IsMalformed(i) && hulls_[hull_of_[i]].ok());
  }
  // Why it is not answerable; OK if it is. Requires that the hulls were resolved.
  const absl::Status& problem(size_t i) const;
  // Whether the last Resolve gave this placement another hull, took its hull, or gave it one; for a
  // body, also whether it gave a piece another hull.
  bool hull_changed(size_t i) const;
  // Whether it gave this placement another QueryHull, perhaps of the same hull; what was found
  // before names points of the former one.
  bool query_hull_changed(size_t i) const;

  // The same as Resolve for a few of hull_ids(), by index, each once: those that the registry told
  // had changed. They are taken as the registry has them now; the others stay as they are. Requires
  // SortByHull.
  absl::Status ResolveSome(Shards& shards, const QueryOptions& options,
                           std::span<const size_t> hulls);

  // Requires a valid pose (ValidatePose).
  void Move(size_t i, const Pose& X_WH);
  // The same in two steps. Several threads at a time may place different placements again.
  void SetPose(size_t i, const Pose& X_WH);
  void PlaceAgain(size_t i);

  // The hulls; each once, but one that packed placements name several times.
  std::span<const std::string> hull_ids() const { return ids_; }
  // What hull k is, or why there is none. Requires that it was resolved.
  const absl::StatusOr<HullView>& hull(size_t k) const {
    HULLD_DCHECK(k < hulls_.size());
    return hulls_[k];
  }
  // Lists the placements by their hull, for placements_of and ResolveSome. Cost: O(n).
  void SortByHull();
  // The placements of hull k. Requires SortByHull.
  std::span<const uint32_t> placements_of(size_t k) const {
    HULLD_DCHECK(k + 1 < by_hull_begin_.size());
    return std::span(by_hull_).subspan(by_hull_begin_[k],
                                       by_hull_begin_[k + 1] - by_hull_begin_[k]);
  }
  // The hull of a placement; none when the ID is malformed or not the caller's.
  std::optional<size_t> hull_of(size_t i) const {
    return HasHull(i) ? std::optional<size_t>(hull_of_[i]) : std::nullopt;
  }
  const ShardRevisions& revisions() const { return as_of_.revisions; }

  // What the last Resolve was of.
  void EncodeHeader(const Shards& shards, v1::ResponseHeader* header) const;
  // A version per placement, or per hull that packed placements name, and the problems; then, where
  // certificates are wanted, the hulls of pieces: the rows of a table, from row `first` on, as many
  // as fill a message. Returns where the next message goes on, which is table_rows() after the
  // last.
  template <typename Message>
  size_t EncodeHulls(size_t first, Message* message) const {
    return EncodeRows(first, {message->mutable_hulls(), message->mutable_placement_problems(),
                              message->mutable_piece_hulls()});
  }
  size_t table_rows() const { return named_.size() + told_placements_ + hulls_of_pieces_.size(); }
  void EncodeHull(size_t k, v1::HullVersion* version) const;
  // Requires that the placement is not answerable.
  void EncodeProblem(size_t i, v1::PlacementProblem* message) const;

 private:
  // No index into hulls_.
  static constexpr uint32_t kNoHull = UINT32_MAX;

  // Where the rows go.
  struct RowFields {
    google::protobuf::RepeatedPtrField<v1::HullVersion>* hulls;
    google::protobuf::RepeatedPtrField<v1::PlacementProblem>* problems;
    google::protobuf::RepeatedPtrField<v1::HullVersion>* piece_hulls;
  };

  PlacementTable(const google::protobuf::RepeatedPtrField<v1::Placement>& placements,
                 const Caller& caller);
  PlacementTable(v1::PackedPlacements& packed, const Caller& caller);

  bool HasHull(size_t i) const { return hull_of_[i] != kNoHull; }
  bool IsMalformed(size_t i) const { return !malformed_.empty() && malformed_.contains(i); }
  void CheckPose(size_t i, const char* of, const char* after);
  Pose PoseAt(size_t i) const { return ReadPose(poses_, i); }
  absl::Status ResolveFrom(Shards& shards, KnownPlaced& known, const QueryOptions& options,
                           const ShardsPlan& plan);
  PlacedLookup LookupFor(const QueryOptions& options, const ShardsPlan& plan) const;
  void Take(const Shards& shards, ShardsResolved resolved, const QueryOptions& options);
  void TakeBodies();
  void TakeBody(size_t k);
  void TakeHullsOfPieces();
  void NoteProblems();
  size_t EncodeRows(size_t first, const RowFields& to) const;
  size_t EncodePlacement(size_t row, const RowFields& to) const;
  size_t BodyBytes() const;
  PlacedBody PlaceBody(size_t i) const;
  PlacedHull Place(size_t i) const;

  // For each placement, its hull as an index into hulls_, or kNoHull where the ID is malformed or
  // not the caller's; and its pose, as packed placements have it.
  std::vector<uint32_t> hull_of_;
  google::protobuf::RepeatedField<double> poses_;
  // What is wrong with the ID or the pose of a placement.
  std::unordered_map<size_t, absl::Status> malformed_;
  bool is_packed_ = false;
  // Each hull that packed placements name, as such an index.
  std::vector<uint32_t> named_;
  std::vector<std::string> ids_;
  // Parallel to ids_.
  std::vector<absl::StatusOr<HullView>> hulls_;
  // For Refresh.
  KnownPlaced known_;
  // What is asked of each: its own, or NoHull's.
  std::vector<const QueryHull*> query_hulls_;
  std::vector<char> changed_;
  std::vector<char> query_hull_changed_;
  // Once SortByHull was called, the placements of hull k: by_hull_[by_hull_begin_[k]] up to
  // by_hull_begin_[k + 1].
  std::vector<uint32_t> by_hull_;
  std::vector<size_t> by_hull_begin_;
  // Where the last Resolve found the hulls, and as of when.
  const Shards* shards_ = nullptr;
  ShardsAsOf as_of_;
  // Whether no placement had a problem when the hulls were last resolved; most often so.
  bool is_all_answerable_ = false;
  // How many placements the table of hulls tells of, from the first. Packed ones have no row but
  // for a problem, so there are none where none has one.
  size_t told_placements_ = 0;
  bool places_on_demand_ = false;
  // Empty where they are placed on demand.
  std::vector<PlacedHull> placed_;

  // The prefix of IDs that the caller sees.
  std::string prefix_;
  // Where any of hulls_ is a body, what is asked of each; parallel to ids_. Those of hulls are kept
  // here.
  std::vector<const QueryBody*> query_bodies_;
  std::vector<std::unique_ptr<const QueryBody>> bodies_of_hulls_;
  std::vector<PlacedBody> bodies_;
  // Where certificates are wanted: the hulls of all pieces, each once. They belong to hulls_.
  std::vector<const HullRecord*> hulls_of_pieces_;
};

// Checks an update of a stream with `count` placements: the new pose of each of `placements`, as
// ReadPose reads it. INVALID_ARGUMENT: numbers that do not fit the placements, an index out of
// range or named twice, a malformed pose.
absl::Status ValidateMoves(const google::protobuf::RepeatedField<uint32_t>& placements,
                           const google::protobuf::RepeatedField<double>& poses, size_t count);

// How errors say how many placements there are: packed or not, so that no field is named that the
// caller did not send.
std::string ThereArePlacements(size_t count);

// INVALID_ARGUMENT: an odd number of indices, or one out of range. RESOURCE_EXHAUSTED: more than
// max_pairs (--max-pairs-per-batch).
absl::Status ValidatePairs(const google::protobuf::RepeatedField<uint32_t>& pairs,
                           size_t placements, uint64_t max_pairs, const char* what);

}  // namespace hulld::server

#endif  // HULLD_SERVER_COLLISIONS_PLACED_PLACEMENT_TABLE_H_
