#include "core/query/body/body_search.h"

#include <absl/status/status.h>
#include <absl/strings/str_cat.h>

#include <algorithm>
#include <cmath>
#include <compare>
#include <utility>

#include "core/base/check.h"
#include "core/query/collision.h"

namespace hulld {
namespace {

// Steps between two polls of should_stop. A step takes at most a microsecond, except for exact
// pairs, which poll themselves.
constexpr int kStepsPerPoll = 16;

// Rank of a relation among the relations of pairs.
int Strength(Relation relation) {
  switch (relation) {
    case Relation::kSeparated:
      return 0;
    case Relation::kTouching:
      return 1;
    case Relation::kWithinTolerance:
      return 2;
    case Relation::kOverlapping:
      return 3;
  }
  HULLD_UNREACHABLE();
}

template <typename Numbers>
std::weak_ordering CompareNumbers(const Numbers& a, const Numbers& b, int count) {
  for (int i = 0; i < count; ++i) {
    if (a[i] < b[i]) return std::weak_ordering::less;
    if (b[i] < a[i]) return std::weak_ordering::greater;
  }
  return std::weak_ordering::equivalent;
}

std::weak_ordering Compare(const Pose& a, const Pose& b) {
  if (const auto order = CompareNumbers(a.t, b.t, 3); order != 0) return order;
  return CompareNumbers(a.q, b.q, 4);
}

std::weak_ordering Compare(const BodyPiece& a, const BodyPiece& b) {
  if (const auto order = Compare(a.X_BP, b.X_BP); order != 0) return order;
  if (a.radius != b.radius) {
    return a.radius < b.radius ? std::weak_ordering::less : std::weak_ordering::greater;
  }
  if (a.hull == b.hull) return std::weak_ordering::equivalent;
  const uint32_t count = a.hull->point_count();
  if (const auto order = count <=> b.hull->point_count(); order != 0) return order;
  for (uint32_t i = 0; i < count; ++i) {
    const auto order = CompareNumbers(a.hull->point(i), b.hull->point(i), 3);
    if (order != 0) return order;
  }
  return std::weak_ordering::equivalent;
}

// A total order of placed bodies by content. The poses usually decide.
bool IsInOrder(const PlacedBody& a, const PlacedBody& b) {
  if (const auto order = Compare(a.X_WB(), b.X_WB()); order != 0) return order < 0;
  if (a.radius() != b.radius()) return a.radius() < b.radius();
  const auto pieces_a = a.body().pieces();
  const auto pieces_b = b.body().pieces();
  if (pieces_a.size() != pieces_b.size()) return pieces_a.size() < pieces_b.size();
  for (size_t i = 0; i < pieces_a.size(); ++i) {
    if (const auto order = Compare(pieces_a[i], pieces_b[i]); order != 0) return order < 0;
  }
  return true;
}

// Options for the deciding pair, without certificates, which are found separately.
QueryOptions OfDecidingPair(const QueryOptions& options) {
  QueryOptions deciding = options;
  deciding.want_certificate = false;
  return deciding;
}

QueryOptions OptionsOfEachPair(const QueryOptions& options) {
  QueryOptions each = OfDecidingPair(options);
  each.want_separation = each.WantsDetails();
  each.want_axis = false;
  each.want_analysis = false;
  each.want_witness = false;
  each.want_normal = false;
  each.threads = 1;
  return each;
}

double Extent(const Box& box) { return (box.high - box.low).maxCoeff(); }

}  // namespace

absl::Status ValidateBodyOptions(const QueryOptions& options, const OptionNames& names) {
  if (options.method == Method::kTextbookSat) {
    return absl::InvalidArgumentError(
        absl::StrCat(names.textbook, " applies to pairs of hulls, not of bodies; leave it out"));
  }
  return ValidateOptions(options, names);
}

void BodySearch::PlacedLeaf::Enter(uint32_t leaf) {
  if (node == leaf) return;
  node = leaf;
  for (auto& piece : pieces) piece.reset();
}

const PlacedHull& BodySearch::PlacedLeaf::At(const PlacedBody& body, uint32_t slot,
                                             uint32_t piece) {
  if (!pieces[slot]) pieces[slot].emplace(body, piece);
  return pieces[slot]->placed();
}

BodySearch::BodySearch(const PlacedBody& a, const PlacedBody& b, const QueryOptions& options)
    : a_(&a),
      b_(&b),
      x_(IsInOrder(a, b) ? &a : &b),
      y_(x_ == &a ? &b : &a),
      options_(&options),
      each_(OptionsOfEachPair(options)),
      wants_least_(each_.want_separation),
      gap_(*x_, *y_),
      poll_(options.should_stop, kStepsPerPoll) {
  HULLD_DCHECK(ValidateBodyOptions(options).ok());
  UpdateLimit();
  if (!x_->body().tree().empty() && !y_->body().tree().empty()) Push(0, 0);
}

absl::StatusOr<bool> BodySearch::Advance(uint64_t steps) {
  for (; steps > 0 && !ended_; --steps) {
    if (poll_.Step()) return absl::CancelledError("the query was cancelled");
    if (absl::Status s = found_ ? Prove() : Search(); !s.ok()) return s;
    ended_ = found_ && (!options_->want_certificate || (certification_ && certification_->ended()));
  }
  return ended_;
}

// Makes one step toward the relation.
absl::Status BodySearch::Search() {
  if (!candidates_.empty()) {
    const Candidate candidate = candidates_.back();
    candidates_.pop_back();
    if (candidate.gap <= Limit()) return Query(candidate);
  } else if (!waiting_.empty()) {
    const Nodes nodes = waiting_.back();
    waiting_.pop_back();
    if (nodes.gap <= Limit()) Descend(nodes);
  } else {
    found_ = true;
  }
  return absl::OkStatus();
}

// Makes one step toward its certificates.
absl::Status BodySearch::Prove() {
  if (certification_) return certification_->Step();
  certification_.emplace(*a_, *b_, *options_, relation_, decided_);
  return absl::OkStatus();
}

double BodySearch::Gap(const Box& of_x, const Box& of_y) {
  ++counts_.boxes;
  return gap_.AtLeast(of_x, of_y);
}

void BodySearch::Push(uint32_t x, uint32_t y) {
  const double gap = Gap(x_->body().tree().box(x), y_->body().tree().box(y));
  // Infinite if a box is empty.
  if (gap <= Limit() && gap < kInfinity) waiting_.push_back({x, y, gap});
}

// Replaces the larger of the two nodes by its children; the nearer child is visited first.
void BodySearch::Descend(const Nodes& nodes) {
  const BoxTree& tree_x = x_->body().tree();
  const BoxTree& tree_y = y_->body().tree();
  const bool is_leaf_x = tree_x.is_leaf(nodes.x);
  const bool is_leaf_y = tree_y.is_leaf(nodes.y);
  if (is_leaf_x && is_leaf_y) return EnterLeaves(nodes);
  const bool splits_x =
      !is_leaf_x && (is_leaf_y || Extent(tree_x.box(nodes.x)) >= Extent(tree_y.box(nodes.y)));
  const size_t before = waiting_.size();
  if (splits_x) {
    for (const uint32_t child : tree_x.children(nodes.x)) Push(child, nodes.y);
  } else {
    for (const uint32_t child : tree_y.children(nodes.y)) Push(nodes.x, child);
  }
  if (waiting_.size() == before + 2 && waiting_[before].gap < waiting_[before + 1].gap) {
    std::swap(waiting_[before], waiting_[before + 1]);
  }
}

void BodySearch::EnterLeaves(const Nodes& nodes) {
  const BoxTree& tree_x = x_->body().tree();
  const BoxTree& tree_y = y_->body().tree();
  leaf_x_.Enter(nodes.x);
  leaf_y_.Enter(nodes.y);
  const auto boxes_x = tree_x.boxes(nodes.x);
  const auto boxes_y = tree_y.boxes(nodes.y);
  for (uint32_t i = 0; i < boxes_x.size(); ++i) {
    for (uint32_t j = 0; j < boxes_y.size(); ++j) {
      const double gap = Gap(boxes_x[i], boxes_y[j]);
      if (gap > Limit() || gap == kInfinity) continue;
      candidates_.push_back({i, j, tree_x.indices(nodes.x)[i], tree_y.indices(nodes.y)[j], gap});
    }
  }
  std::sort(candidates_.begin(), candidates_.end(), [](const Candidate& p, const Candidate& q) {
    if (p.gap != q.gap) return p.gap > q.gap;
    return std::pair(p.piece_x, p.piece_y) > std::pair(q.piece_x, q.piece_y);
  });
}

absl::Status BodySearch::Query(const Candidate& candidate) {
  const PlacedHull& x = leaf_x_.At(*x_, candidate.slot_x, candidate.piece_x);
  const PlacedHull& y = leaf_y_.At(*y_, candidate.slot_y, candidate.piece_y);
  const bool swapped = x_ != a_;
  ++counts_.pairs;
  const absl::StatusOr<Answer> answer =
      swapped ? CheckCollision(y, x, each_) : CheckCollision(x, y, each_);
  if (!answer.ok()) return answer.status();
  const PiecePair pieces = swapped ? PiecePair{candidate.piece_y, candidate.piece_x}
                                   : PiecePair{candidate.piece_x, candidate.piece_y};
  rung_ = std::max(rung_, answer->rung);
  if (wants_least_) {
    TakeUpSeparation(*answer, pieces);
  } else {
    TakeUp(*answer, pieces);
  }
  return absl::OkStatus();
}

void BodySearch::TakeUp(const Answer& answer, PiecePair pieces) {
  const bool within = answer.within_clearance.value_or(false);
  const bool is_stronger = Strength(answer.relation) > Strength(relation_);
  // A separated pair within the clearance decides if no pair collides.
  if (is_stronger || (within && !decided_)) decided_ = pieces;
  if (is_stronger) relation_ = answer.relation;
  if (!is_stronger && !within) return;
  within_clearance_ |= within;
  UpdateLimit();
}

void BodySearch::UpdateLimit() {
  const bool is_relation_known = relation_ == Relation::kOverlapping;
  if (within_clearance_) each_.clearance.reset();
  limit_ = std::max(is_relation_known ? -kInfinity : 0, each_.clearance.value_or(-kInfinity));
  found_ = is_relation_known && !each_.clearance.has_value();
}

void BodySearch::TakeUpSeparation(const Answer& answer, PiecePair pieces) {
  HULLD_CHECK(answer.separation.has_value());
  const Separation& separation = *answer.separation;
  if (Strength(answer.relation) > Strength(relation_)) relation_ = answer.relation;
  within_clearance_ |= answer.within_clearance.value_or(false);
  min_low_ = std::min(min_low_, separation.value - separation.bound);
  min_high_ = std::min(min_high_, separation.value + separation.bound);
  if (decided_ && separation.value >= min_value_) return;
  min_value_ = separation.value;
  decided_ = pieces;
}

absl::StatusOr<BodyAnswer> BodySearch::Take() {
  HULLD_CHECK(ended_);
  absl::StatusOr<BodyAnswer> result = wants_least_ && decided_ ? TakeLeast() : TakeRelation();
  if (result.ok() && certification_) result->certificates = certification_->Take();
  return result;
}

BodyAnswer BodySearch::TakeRelation() const {
  BodyAnswer result;
  result.answer.relation = relation_;
  result.answer.rung = rung_;
  result.pieces = decided_;
  if (options_->clearance) result.answer.within_clearance = within_clearance_;
  if (!wants_least_) return result;
  // All hulls are empty.
  if (options_->want_separation) result.answer.separation = Separation{kInfinity, 0};
  if (options_->want_analysis) result.answer.analysis = Analysis();
  return result;
}

// Returns the answer of the deciding pair, with the relation and bounds of the bodies.
absl::StatusOr<BodyAnswer> BodySearch::TakeLeast() const {
  const PlacedPiece a(*a_, decided_->a);
  const PlacedPiece b(*b_, decided_->b);
  absl::StatusOr<Answer> answer = CheckCollision(a.placed(), b.placed(), OfDecidingPair(*options_));
  if (!answer.ok()) return answer.status();
  BodyAnswer result = {{decided_, {}}, *std::move(answer)};
  // Signs of separations are exact, so the smallest separation has the sign of the strongest
  // relation.
  HULLD_CHECK(result.answer.relation == relation_);
  result.answer.rung = rung_;
  if (options_->clearance) result.answer.within_clearance = within_clearance_;
  if (!result.answer.separation || relation_ == Relation::kTouching) return result;
  Separation& separation = *result.answer.separation;
  // Another pair with smaller bounds may have the smallest separation.
  const double bound = std::max(separation.value - min_low_, min_high_ - separation.value);
  if (bound > separation.bound) separation.bound = std::nextafter(bound, kInfinity);
  return result;
}

absl::StatusOr<BodyAnswer> CheckBodies(const PlacedBody& a, const PlacedBody& b,
                                       const QueryOptions& options, BodyCounts* counts) {
  if (absl::Status s = ValidateBodyOptions(options); !s.ok()) return s;
  BodySearch search(a, b, options);
  const absl::StatusOr<bool> ended = search.Advance(std::numeric_limits<uint64_t>::max());
  if (counts != nullptr) *counts = search.counts();
  if (!ended.ok()) return ended.status();
  return search.Take();
}

}  // namespace hulld
