#include "server/collisions/placed/placement_table.h"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <array>
#include <limits>
#include <numeric>
#include <string_view>
#include <unordered_map>
#include <unordered_set>
#include <utility>

#include "core/base/check.h"
#include "core/base/status_macros.h"
#include "server/contract/errors.h"
#include "server/settings/config.h"
#include "server/wire/decode.h"
#include "server/wire/encode.h"

namespace hulld::server {
namespace {

// Tag and length of an entry within its message.
constexpr size_t kVersionEntryBytes = 4;

// Stand-in hull of placements that cannot be answered.
const QueryHull& NoHull() {
  static const Hull kEmpty;
  static const QueryHull kNoQueryHull(kEmpty);
  return kNoQueryHull;
}

// Stand-in body of such placements.
const QueryBody& NoBody() {
  static const QueryBody kNoBody(NoHull());
  return kNoBody;
}

bool IsSame(const HullView& a, const HullView& b) {
  if (a.record.revision != b.record.revision ||
      a.record.create_revision != b.record.create_revision) {
    return false;
  }
  if (a.body == nullptr || b.body == nullptr) return a.body == b.body;
  return std::ranges::equal(
      a.body->hulls, b.body->hulls,
      [](const HullView& hull_a, const HullView& hull_b) { return IsSame(hull_a, hull_b); });
}

bool IsSame(const absl::StatusOr<HullView>& a, const absl::StatusOr<HullView>& b) {
  if (!a.ok() || !b.ok()) return a.ok() == b.ok();
  return IsSame(*a, *b);
}

// Query structure of a hull, or its stand-in.
const QueryHull& QueryHullOf(const absl::StatusOr<HullView>& hull, bool canonical) {
  if (!hull.ok() || hull->body != nullptr) return NoHull();
  return canonical ? hull->served->canonical_query_hull() : hull->served->query_hull();
}

// Approximate bytes of an error, excluding its pointer: message, reason, and containers (a guess).
size_t ErrorBytes(const absl::Status& status) {
  constexpr size_t kReasonBytes = 384;
  return status.ok() ? 0 : kReasonBytes + status.message().size();
}

// INVALID_ARGUMENT: the lists do not match.
absl::Status CheckPacked(const v1::PackedPlacements& packed) {
  if (packed.poses_size() / kPoseNumbers != packed.hulls_size() ||
      packed.poses_size() % kPoseNumbers != 0) {
    return InvalidArgument("packed_placements.poses has ", packed.poses_size(), " numbers for ",
                           packed.hulls_size(), " placements; each needs seven: w x y z and x y z");
  }
  if (!packed.radii().empty() && packed.radii_size() != packed.hulls_size()) {
    return InvalidArgument("packed_placements.radii has ", packed.radii_size(), " numbers for ",
                           packed.hulls_size(), " placements; give one for each, or none");
  }
  if (!packed.end_poses().empty() && packed.end_poses_size() != packed.poses_size()) {
    return InvalidArgument("packed_placements.end_poses has ", packed.end_poses_size(),
                           " numbers for ", packed.hulls_size(),
                           " placements; set seven for each, or none");
  }
  const auto shapes = static_cast<uint32_t>(packed.shape_sizes_size());
  const uint32_t hulls = static_cast<uint32_t>(packed.hull_ids_size()) + shapes;
  for (int i = 0; i < packed.hulls_size(); ++i) {
    if (packed.hulls(i) >= hulls) {
      return InvalidArgument("packed_placements.hulls[", i, "] is ", packed.hulls(i),
                             ", but packed_placements.hull_ids has ", packed.hull_ids_size(),
                             shapes == 0 ? "" : absl::StrCat(" and shape_sizes ", shapes),
                             "; indices start at 0");
    }
  }
  return absl::OkStatus();
}

// Checks the ID of a placement, or adds its inline shape. INVALID_ARGUMENT: the placement has both
// a hull ID and points; DecodeShape. Otherwise as CheckHullId, naming `hull_id`.
absl::Status CheckSubject(const Caller& caller, const v1::Placement& placement,
                          InlineShapes* shapes) {
  if (!placement.has_points()) return CheckHullId(caller, placement.hull_id(), "hull_id");
  if (placement.hull_id().empty()) return DecodeShape(placement.points(), shapes);
  return InvalidArgument("hull_id and points are both set; set one of them");
}

std::string FieldInList(size_t i) { return absl::StrCat("placements[", i, "]."); }
std::string FieldInPair(size_t i) { return i == 0 ? "a." : "b."; }

// Decodes the points of all inline shapes. INVALID_ARGUMENT: their number is not the sum of the
// sizes.
absl::StatusOr<std::vector<Vector>> DecodeShapePoints(const v1::PackedPlacements& packed) {
  absl::StatusOr<std::vector<Vector>> points =
      DecodePoints(packed.shape_points(), std::numeric_limits<uint64_t>::max());
  if (!points.ok()) return Prefixed("packed_placements.shape_", points.status());
  const uint64_t sum =
      std::accumulate(packed.shape_sizes().begin(), packed.shape_sizes().end(), uint64_t{0});
  if (sum == points->size()) return points;
  return InvalidArgument("packed_placements.shape_sizes add up to ", sum,
                         " points, but shape_points has ", points->size());
}

}  // namespace

absl::StatusOr<PlacementTable> PlacementTable::Make(
    const google::protobuf::RepeatedPtrField<v1::Placement>& placements,
    v1::PackedPlacements& packed, const Caller& caller, uint64_t max_placements, const char* what) {
  const bool is_packed = packed.hull_ids_size() + packed.shape_sizes_size() + packed.hulls_size() +
                             packed.poses_size() + packed.radii_size() >
                         0;
  if (is_packed && !placements.empty()) {
    return InvalidArgument("placements and packed_placements are both set; set one of them");
  }
  for (const auto& [count, of] :
       {std::pair<int, const char*>{placements.size() + packed.hulls_size(), " placements"},
        {packed.hull_ids_size(), " hull_ids"},
        {packed.shape_sizes_size(), " shape_sizes"}}) {
    if (static_cast<uint64_t>(count) <= max_placements) continue;
    return LimitExceeded(absl::StrCat(what, " has ", count, of), max_placements, "max-placements");
  }
  if (!is_packed) {
    return PlacementTable({placements.data(), static_cast<size_t>(placements.size())}, FieldInList,
                          caller);
  }
  HULLD_RETURN_IF_ERROR(CheckPacked(packed));
  HULLD_ASSIGN_OR_RETURN(const std::vector<Vector> shape_points, DecodeShapePoints(packed));
  return PlacementTable(packed, shape_points, caller);
}

absl::StatusOr<PlacementTable> PlacementTable::MakePair(const v1::Placement& a,
                                                        const v1::Placement& b,
                                                        const Caller& caller) {
  const std::array<const v1::Placement*, 2> pair = {&a, &b};
  PlacementTable table(pair, FieldInPair, caller);
  for (size_t i = 0; i < pair.size(); ++i) {
    if (table.IsMalformed(i)) return table.problem(i);
  }
  return table;
}

PlacementTable::PlacementTable(v1::PackedPlacements& packed, std::span<const Vector> shape_points,
                               const Caller& caller)
    : is_packed_(true), prefix_(caller.prefix) {
  const size_t id_count = packed.hull_ids_size();
  const size_t shape_count = packed.shape_sizes_size();
  // Errors of the IDs, then of the inline shapes.
  std::vector<absl::Status> malformed(id_count + shape_count);
  named_.resize(id_count, kNoHull);
  ids_.reserve(id_count);
  for (size_t k = 0; k < id_count; ++k) {
    std::string& id = *packed.mutable_hull_ids(static_cast<int>(k));
    if (!CheckHullId(caller, id, "").ok()) {
      malformed[k] = Prefixed("packed_placements.",
                              CheckHullId(caller, id, absl::StrCat("hull_ids[", k, "]")));
      continue;
    }
    named_[k] = static_cast<uint32_t>(ids_.size());
    ids_.push_back(std::move(id));
  }
  std::vector<uint32_t> hulls = named_;
  hulls.resize(id_count + shape_count, kNoHull);
  for (size_t k = 0; k < shape_count; ++k) {
    const size_t size = packed.shape_sizes(static_cast<int>(k));
    const std::span<const Vector> points = shape_points.first(size);
    shape_points = shape_points.subspan(size);
    absl::Status& status = malformed[id_count + k];
    status = Prefixed(absl::StrCat("packed_placements: shape ", k, ": "), CheckShape(points));
    if (!status.ok()) continue;
    hulls[id_count + k] = static_cast<uint32_t>(ids_.size() + shapes_.size());
    shapes_.Add(points);
  }
  shape_count_ = shapes_.size();
  const size_t count = packed.hulls_size();
  hull_of_.reserve(count);
  poses_.Swap(packed.mutable_poses());
  radii_.Swap(packed.mutable_radii());
  end_poses_.Swap(packed.mutable_end_poses());
  for (size_t i = 0; i < count; ++i) {
    const uint32_t named = packed.hulls(static_cast<int>(i));
    hull_of_.push_back(hulls[named]);
    if (!HasHull(i)) {
      malformed_.emplace(i, malformed[named]);
    } else if (IsValidRadius(RadiusAt(i))) {
      CheckPoses(
          i, [i](const char* of) { return absl::StrCat("packed_placements.", of, "s[", i, "]."); });
    } else {
      hull_of_[i] = kNoHull;
      malformed_.emplace(i, Prefixed(absl::StrCat("packed_placements.radii[", i, "]"),
                                     ValidateRadius(RadiusAt(i))));
    }
  }
}

// field: returns the text that precedes a placement's field in errors.
PlacementTable::PlacementTable(std::span<const v1::Placement* const> placements,
                               std::string (*field)(size_t i), const Caller& caller)
    : prefix_(caller.prefix) {
  std::unordered_map<std::string_view, uint32_t> index_of;
  // Placements with inline shapes, which follow all IDs in hulls_.
  std::vector<size_t> shaped;
  const size_t count = placements.size();
  hull_of_.resize(count, kNoHull);
  poses_.Resize(static_cast<int>(count) * kPoseNumbers, 0);
  if (std::ranges::any_of(placements, [](const auto* each) { return each->has_end_pose(); })) {
    end_poses_.Resize(poses_.size(), 0);
  }
  for (size_t i = 0; i < count; ++i) {
    const v1::Placement& placement = *placements[i];
    const auto known = index_of.find(placement.hull_id());
    const bool is_known = known != index_of.end() && !placement.has_points();
    absl::Status status = Prefixed("radius", ValidateRadius(placement.radius()));
    if (status.ok() && !is_known) status = CheckSubject(caller, placement, &shapes_);
    if (!status.ok()) {
      malformed_.emplace(i, Prefixed(field(i), status));
      continue;
    }
    if (placement.has_points()) {
      shaped.push_back(i);
    } else if (is_known) {
      hull_of_[i] = known->second;
    } else {
      hull_of_[i] = static_cast<uint32_t>(ids_.size());
      index_of.emplace(placement.hull_id(), hull_of_[i]);
      ids_.push_back(placement.hull_id());
    }
    if (placement.radius() > 0) {
      radii_.Resize(static_cast<int>(count), 0);
      radii_[static_cast<int>(i)] = placement.radius();
    }
    WritePose(ReadPose(placement.pose()), i, &poses_);
    if (has_motions()) {
      WritePose(placement.has_end_pose() ? ReadPose(placement.end_pose()) : PoseAt(i), i,
                &end_poses_);
    }
    CheckPoses(i, [&](const char* of) { return absl::StrCat(field(i), of, "."); });
  }
  shape_count_ = shaped.size();
  for (size_t k = 0; k < shape_count_; ++k) {
    hull_of_[shaped[k]] = static_cast<uint32_t>(ids_.size() + k);
  }
}

// field: returns the text that precedes a coordinate of "pose" or "end_pose" in errors.
template <typename Field>
void PlacementTable::CheckPoses(size_t i, const Field& field) {
  if (const Pose pose = PoseAt(i); !IsValidPose(pose)) {
    malformed_.emplace(i, Prefixed(field("pose"), ValidatePose(pose)));
  } else if (has_motions()) {
    const absl::Status valid = ValidateEnd(MotionAt(i));
    if (!valid.ok()) malformed_.emplace(i, Prefixed(field("end_pose"), valid));
  }
}

MovingBox PlacementTable::MovingBoxAt(size_t i) const {
  if (!is_answerable(i)) return {Box::Empty(), Box::Empty()};
  return is_body(i) ? MovingBoxOf(MovingBodyAt(i)) : MovingBoxOf(MovingAt(i));
}

size_t PlacementTable::MemoryBytes() const {
  size_t of_ids = 0;
  for (const std::string& id : ids_) of_ids += id.capacity();
  size_t of_errors = 0;
  for (const auto& [i, status] : malformed_) {
    // Bytes of a map node; a guess.
    constexpr size_t kNodeBytes = 64;
    of_errors += kNodeBytes;
    // Packed placements share the error of an ID.
    if (!is_packed_ || HasHull(i) || !IsValidRadius(RadiusAt(i))) of_errors += ErrorBytes(status);
  }
  for (const absl::StatusOr<HullView>& hull : hulls_) of_errors += ErrorBytes(hull.status());
  const size_t each = 2 * sizeof(uint32_t) + (places_on_demand_ ? 0 : sizeof(PlacedHull));
  const size_t of_poses =
      (static_cast<size_t>(poses_.Capacity()) + end_poses_.Capacity() + radii_.Capacity()) *
      sizeof(double);
  return size() * each + of_poses + named_.size() * sizeof named_[0] +
         ids_.size() * (sizeof(std::string) + KnownHulls::kBytesEach) +
         hull_count() *
             (sizeof(absl::StatusOr<HullView>) + sizeof(const QueryHull*) + 2 * sizeof(char)) +
         placements_of_.size() * sizeof(std::vector<uint32_t>) + shapes_.MemoryBytes() + of_ids +
         of_errors + BodyBytes();
}

// Requires resolved hulls.
size_t PlacementTable::BodyBytes() const {
  size_t bytes = bodies_.capacity() * sizeof(PlacedBody) + known_.BodyBytes() +
                 hulls_of_pieces_.capacity() * sizeof(const HullRecord*);
  for (const auto& body : bodies_of_hulls_) {
    if (body != nullptr) bytes += sizeof(QueryBody) + body->boxes().MemoryBytes();
  }
  return bytes;
}

PlacedLookup PlacementTable::LookupFor(const QueryOptions& options, const ReadPlan& plan) const {
  return {options.WantsCanonical(), prefix_, plan, &shapes_};
}

absl::Status PlacementTable::Resolve(Registry& registry, const QueryOptions& options,
                                     const ReadPlan& plan) {
  KnownPlaced known(/*for_one_lookup=*/true);
  return ResolveFrom(registry, known, options, plan);
}

absl::Status PlacementTable::Refresh(Registry& registry, const QueryOptions& options,
                                     const ReadPlan& plan) {
  return ResolveFrom(registry, known_, options, plan);
}

absl::Status PlacementTable::ResolveFrom(Registry& registry, KnownPlaced& known,
                                         const QueryOptions& options, const ReadPlan& plan) {
  HULLD_ASSIGN_OR_RETURN(Resolved resolved, known.Resolve(registry, ids_, LookupFor(options, plan),
                                                          options.should_stop));
  SetHulls(registry.store(), std::move(resolved), options);
  return absl::OkStatus();
}

void PlacementTable::SetSomeHulls(std::span<const size_t> hulls, Resolved resolved,
                                  const QueryOptions& options) {
  HULLD_CHECK(placements_of_.size() == hull_count() && resolved.hulls.size() == hulls.size());
  std::fill(changed_.begin(), changed_.end(), false);
  std::fill(query_hull_changed_.begin(), query_hull_changed_.end(), false);
  is_all_answerable_ = false;
  for (size_t n = 0; n < hulls.size(); ++n) {
    const size_t k = hulls[n];
    // Keeps the previous hull alive until no placement uses it.
    const absl::StatusOr<HullView> before = std::exchange(hulls_[k], std::move(resolved.hulls[n]));
    const QueryHull& query_hull = QueryHullOf(hulls_[k], options.WantsCanonical());
    changed_[k] = !IsSame(before, hulls_[k]);
    query_hull_changed_[k] = std::exchange(query_hulls_[k], &query_hull) != &query_hull;
    if (has_bodies()) TakeBody(k);
    for (const uint32_t i : placements_of(k)) PlaceAgain(i);
  }
  if (!has_bodies()) TakeBodies();
  as_of_ = resolved.as_of;
  NoteProblems();
}

// If the options need canonical snapshots, every resolved hull has one and queries use it.
void PlacementTable::SetHulls(const Store& store, Resolved resolved, const QueryOptions& options) {
  std::vector<const QueryHull*> query_hulls;
  query_hulls.reserve(hull_count());
  for (const absl::StatusOr<HullView>& hull : resolved.hulls) {
    query_hulls.push_back(&QueryHullOf(hull, options.WantsCanonical()));
  }
  changed_.assign(hull_count(), true);
  query_hull_changed_.assign(hull_count(), true);
  for (size_t i = 0; i < hulls_.size(); ++i) {
    changed_[i] = !IsSame(hulls_[i], resolved.hulls[i]);
    query_hull_changed_[i] = query_hulls_[i] != query_hulls[i];
  }
  // Keeps the previous hulls alive until now, because their addresses distinguish them from the new
  // ones.
  const std::vector<absl::StatusOr<HullView>> before = std::move(hulls_);
  hulls_ = std::move(resolved.hulls);
  query_hulls_ = std::move(query_hulls);
  shapes_ = {};
  store_ = &store;
  as_of_ = resolved.as_of;
  NoteProblems();
  placed_.clear();
  if (!places_on_demand_) {
    placed_.reserve(size());
    for (size_t i = 0; i < size(); ++i) placed_.push_back(Place(i));
  }
  TakeBodies();
  hulls_of_pieces_.clear();
  if (options.want_certificate) TakeHullsOfPieces();
}

void PlacementTable::NoteProblems() {
  is_all_answerable_ =
      malformed_.empty() && std::ranges::all_of(hulls_, [](const auto& hull) { return hull.ok(); });
  listed_placements_ = is_packed_ && is_all_answerable_ ? 0 : size();
}

// If any hull is a body, the others are queried as bodies with a single piece.
void PlacementTable::TakeBodies() {
  bodies_.clear();
  bodies_of_hulls_.clear();
  query_bodies_.clear();
  const bool has_any = std::ranges::any_of(
      hulls_, [](const auto& hull) { return hull.ok() && hull->body != nullptr; });
  if (!has_any) return;
  bodies_of_hulls_.resize(hull_count());
  query_bodies_.resize(hull_count());
  for (size_t k = 0; k < hull_count(); ++k) TakeBody(k);
  bodies_.reserve(size());
  for (size_t i = 0; i < size(); ++i) bodies_.push_back(PlaceBody(i));
}

void PlacementTable::TakeBody(size_t k) {
  if (hulls_[k].ok() && hulls_[k]->body != nullptr) {
    bodies_of_hulls_[k] = nullptr;
    query_bodies_[k] = &hulls_[k]->body->query;
    return;
  }
  bodies_of_hulls_[k] = std::make_unique<const QueryBody>(*query_hulls_[k]);
  query_bodies_[k] = bodies_of_hulls_[k].get();
}

void PlacementTable::TakeHullsOfPieces() {
  std::unordered_set<std::string_view> known;
  for (const absl::StatusOr<HullView>& hull : hulls_) {
    if (!hull.ok() || hull->body == nullptr) continue;
    for (const HullView& of_piece : hull->body->hulls) {
      if (known.insert(of_piece.record.hull_id).second) {
        hulls_of_pieces_.push_back(&of_piece.record);
      }
    }
  }
}

PlacedBody PlacementTable::PlaceBody(size_t i) const {
  if (!is_answerable(i)) return PlacedBody(NoBody(), Pose());
  return PlacedBody(*query_bodies_[hull_of_[i]], PoseAt(i), RadiusAt(i));
}

void PlacementTable::SortByHull() {
  placements_of_.resize(hull_count());
  for (uint32_t i = 0; i < size(); ++i) {
    if (HasHull(i)) placements_of_[hull_of_[i]].push_back(i);
  }
}

const QueryHull& PlacementTable::HullAt(size_t i) const {
  return is_answerable(i) ? *query_hulls_[hull_of_[i]] : NoHull();
}

PlacedHull PlacementTable::Place(size_t i) const {
  if (!is_answerable(i)) return PlacedHull(NoHull(), Pose());
  return PlacedHull(*query_hulls_[hull_of_[i]], PoseAt(i), RadiusAt(i));
}

const absl::Status& PlacementTable::problem(size_t i) const {
  if (IsMalformed(i)) return malformed_.at(i);
  HULLD_CHECK(hull_of_[i] < hulls_.size());
  return hulls_[hull_of_[i]].status();
}

bool PlacementTable::hull_changed(size_t i) const { return HasHull(i) && changed_[hull_of_[i]]; }

bool PlacementTable::query_hull_changed(size_t i) const {
  return HasHull(i) && query_hull_changed_[hull_of_[i]];
}

void PlacementTable::Move(size_t i, const Pose& X_WH) {
  SetPose(i, X_WH);
  PlaceAgain(i);
}

void PlacementTable::SetPose(size_t i, const Pose& X_WH) {
  HULLD_DCHECK(IsValidPose(X_WH));
  if (!HasHull(i)) return;
  WritePose(X_WH, i, &poses_);
  malformed_.erase(i);
}

void PlacementTable::PlaceAgain(size_t i) {
  if (!HasHull(i)) return;
  if (!places_on_demand_) placed_[i] = Place(i);
  if (has_bodies()) bodies_[i] = PlaceBody(i);
}

size_t PlacementTable::EncodeRows(size_t first, const RowFields& to) const {
  const size_t placements = named_.size() + listed_placements_;
  const size_t rows = table_rows();
  size_t bytes = 0;
  size_t row = first;
  for (; row < rows && bytes < Config::kReplyMessageBytes; ++row) {
    bytes += kVersionEntryBytes;
    if (row < placements) {
      bytes += EncodePlacement(row, to);
      continue;
    }
    v1::HullVersion* const version = to.piece_hulls->Add();
    const HullRecord& hull = *hulls_of_pieces_[row - placements];
    EncodeVersion(*store_, hull, version);
    bytes += version->ByteSizeLong();
  }
  return row;
}

// Returns the approximate bytes added.
size_t PlacementTable::EncodePlacement(size_t row, const RowFields& to) const {
  size_t bytes = 0;
  const bool is_name = row < named_.size();
  const size_t i = is_name ? 0 : row - named_.size();
  if (is_name || !is_packed_) {
    v1::HullVersion* const version = to.hulls->Add();
    const uint32_t hull = is_name ? named_[row] : hull_of_[i];
    const bool known = hull != kNoHull && hulls_[hull].ok() && (is_name || problem(i).ok());
    if (known) EncodeHull(hull, version);
    bytes += version->ByteSizeLong();
  }
  if (is_name || problem(i).ok()) return bytes;
  v1::PlacementProblem* const encoded = to.problems->Add();
  EncodeProblem(i, encoded);
  return bytes + kVersionEntryBytes + encoded->ByteSizeLong();
}

void PlacementTable::EncodeHull(size_t k, v1::HullVersion* version) const {
  EncodeVersion(*store_, hulls_[k]->record, version);
}

void PlacementTable::EncodeDecidingPiece(size_t i, uint32_t piece,
                                         v1::DecidingPiece* message) const {
  const HullView& body = *hulls_[hull_of_[i]];
  message->set_index(piece);
  EncodeVersion(*store_, body.body->hull_of(piece).record, message->mutable_hull());
}

void PlacementTable::EncodeProblem(size_t i, v1::PlacementProblem* message) const {
  const absl::Status& status = problem(i);
  HULLD_CHECK(!status.ok());
  message->set_placement(static_cast<uint32_t>(i));
  message->set_code(ToGrpc(status.code()));
  message->set_message(std::string(status.message()));
  message->set_reason(ReasonOf(status));
}

absl::Status CheckNoMotions(const google::protobuf::RepeatedPtrField<v1::Placement>& placements,
                            const v1::PackedPlacements& packed, const char* what) {
  const auto moving = std::ranges::find_if(placements, &v1::Placement::has_end_pose);
  if (moving == placements.end() && packed.end_poses().empty()) return absl::OkStatus();
  const std::string field =
      moving == placements.end()
          ? "packed_placements.end_poses"
          : absl::StrCat("placements[", moving - placements.begin(), "].end_pose");
  return InvalidArgument(
      field, " is set, but ", what,
      " does not support motions; use CheckCollision, BatchCheckCollisions, or FindCollisions");
}

absl::Status ValidateMoves(const google::protobuf::RepeatedField<uint32_t>& placements,
                           const google::protobuf::RepeatedField<double>& poses, size_t count) {
  const int moved = placements.size();
  if (poses.size() != kPoseNumbers * moved) {
    return InvalidArgument("poses has ", poses.size(), " numbers for ", moved,
                           " placements; each needs seven: w x y z and x y z");
  }
  std::vector<char> named(count);
  for (int i = 0; i < moved; ++i) {
    const uint32_t placement = placements[i];
    if (placement >= count) {
      return InvalidArgument("placements[", i, "] is ", placement, ", but the stream has ", count,
                             "; indices start at 0");
    }
    if (named[placement]) {
      return InvalidArgument("placements[", i, "] is ", placement,
                             ", which is listed twice; list each placement once");
    }
    named[placement] = true;
    const Pose pose = ReadPose(poses, i);
    if (!IsValidPose(pose)) return Prefixed(absl::StrCat("poses[", i, "]."), ValidatePose(pose));
  }
  return absl::OkStatus();
}

std::string PlacementCountText(size_t count) {
  return count == 1 ? "there is 1 placement" : absl::StrCat("there are ", count, " placements");
}

absl::Status ValidatePairs(const google::protobuf::RepeatedField<uint32_t>& pairs,
                           size_t placements, uint64_t max_pairs, const char* what) {
  if (pairs.size() % 2 != 0) {
    return InvalidArgument("pairs has an odd number of indices, ", pairs.size(),
                           "; each pair needs two");
  }
  const auto count = static_cast<uint64_t>(pairs.size()) / 2;
  if (count > max_pairs) {
    return LimitExceeded(absl::StrCat(what, " has ", count, " pairs"), max_pairs,
                         "max-pairs-per-batch");
  }
  for (int i = 0; i < pairs.size(); ++i) {
    if (pairs[i] >= placements) {
      return InvalidArgument("pairs[", i, "] is ", pairs[i], ", but ",
                             PlacementCountText(placements), "; indices start at 0");
    }
  }
  return absl::OkStatus();
}

}  // namespace hulld::server
