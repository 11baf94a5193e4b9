#include "core/query/textbook_sat.h"

#include <absl/status/status.h>
#include <absl/strings/str_cat.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <functional>
#include <mutex>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "core/base/check.h"
#include "core/base/stop_poll.h"
#include "core/numeric/error_bounds.h"
#include "core/numeric/exponent_limits.h"
#include "core/numeric/integer.h"
#include "core/numeric/vector.h"
#include "core/query/axis_description.h"
#include "core/query/exact/exact_pair.h"
#include "core/query/exact/exact_search.h"
#include "core/query/floating/float_pair.h"

namespace hulld {
namespace {

// A thread polls should_stop once per this many axes or projected vertices.
constexpr uint64_t kAxesPerPoll = 64;
constexpr uint64_t kVerticesPerPoll = uint64_t{1} << 18;
constexpr uint64_t kNone = UINT64_MAX;

// The result of testing an axis.
enum class Gap { kOverlap, kZero, kSeparated };

// A floating-point normal; each component is within `error` of the exact one.
struct FloatNormal {
  Vector n;
  double error;
};

// The candidate axes of a pair, by index. Tests are thread-safe after Prepare.
class AxisTable {
 public:
  // Both arguments must outlive the table.
  AxisTable(const FloatPair& filter, const std::function<bool()>& should_stop)
      : filter_(filter),
        should_stop_(should_stop),
        a_(filter.a().hull()),
        b_(filter.b().hull()),
        facets_a_(a_.facet_count()),
        facets_b_(b_.facet_count()),
        edges_b_(b_.edges().size()),
        edge_pairs_(a_.edges().size() * edges_b_) {
    if (filter.a().query_hull().dimension() == 3 || filter.b().query_hull().dimension() == 3)
      return;
    span_ = SpanOf(exact_.emplace(filter_, should_stop_));
  }

  // Includes the axes of a flat difference. O(1).
  uint64_t size() const { return facets_a_ + facets_b_ + edge_pairs_ + flat_count(); }

  // Computes the data that the tests need. Call before any test.
  void Prepare() {
    if (span_.dimension < 3 && !exact().stopped()) AppendFlatAxes();
    const size_t count_a = a_.vertices().size();
    const size_t count_b = b_.vertices().size();
    positions_a_.reserve(count_a);
    positions_b_.reserve(count_b);
    for (uint32_t i = 0; i < count_a; ++i) positions_a_.push_back(filter_.PositionA(i));
    for (uint32_t i = 0; i < count_b; ++i) positions_b_.push_back(filter_.PositionB(i));
  }

  // The pair in integers, with every vertex multiplied out. Created for the first axis that
  // floating point leaves open. Thread-safe.
  ExactPair& exact() {
    std::call_once(multiplied_out_, [this] {
      if (!exact_) exact_.emplace(filter_, should_stop_);
      exact_->CacheAllVertices();
      is_multiplied_out_.store(true, std::memory_order_release);
    });
    return *exact_;
  }
  // True if floating point left an axis open, or A - B is flat.
  bool is_multiplied_out() const { return is_multiplied_out_.load(std::memory_order_acquire); }

  // Number of axes tested between two polls.
  uint64_t block() const {
    const uint64_t vertices = a_.vertices().size() + b_.vertices().size();
    return std::clamp<uint64_t>(kVerticesPerPoll / vertices, 1, kAxesPerPoll);
  }
  // True if a test was interrupted; its result is then meaningless.
  bool stopped() const { return is_multiplied_out() && exact_->stopped(); }

  AxisKind KindOf(uint64_t axis) const {
    if (axis < facets_a_) return AxisKind::kFacetA;
    if (axis < facets_a_ + facets_b_) return AxisKind::kFacetB;
    if (axis < facets_a_ + facets_b_ + edge_pairs_) return AxisKind::kEdgeEdge;
    return AxisKind::kFlat;
  }

  Gap Test(uint64_t axis) {
    if (filter_.usable() && KindOf(axis) != AxisKind::kFlat) {
      const FloatNormal normal = Filtered(axis);
      const double gap = FloatGap(normal.n);
      const double d = kMinkowskiErrorFactor * filter_.size();
      const double bound = kGapNormalFactor * normal.error * filter_.size() +
                           kGapPositionFactor * normal.n.cwiseAbs().maxCoeff() * d;
      // Written so that a bound that underflowed to zero, or a NaN, is never certain.
      if (bound > kGapMinBound && gap > bound) return Gap::kSeparated;
      if (bound > kGapMinBound && gap < -bound) return Gap::kOverlap;
    }
    return ExactGap(Exact(axis));
  }

  // Returns the exact axis, oriented from A toward B. Requires: a gap of at least zero.
  IntegerVector Oriented(uint64_t axis) {
    const IntegerVector n = Exact(axis);
    if (SignOfGap(n) >= 0) return n;
    HULLD_DCHECK(SignOfGap(-n) >= 0);
    return -n;
  }

  size_t MemoryBytes() const {
    return (is_multiplied_out() ? exact_->MemoryBytes() : 0) +
           flat_axes_.capacity() * sizeof(IntegerVector) +
           (positions_a_.capacity() + positions_b_.capacity()) * sizeof(Vector);
  }

 private:
  // Facet corners, or the ends of an edge of A and of an edge of B.
  std::pair<Edge, Edge> EdgePair(uint64_t axis) const {
    const uint64_t pair = axis - facets_a_ - facets_b_;
    return {a_.edges()[pair / edges_b_], b_.edges()[pair % edges_b_]};
  }

  FloatNormal Filtered(uint64_t axis) const {
    Vector e;
    Vector f;
    const auto use_facet = [&](std::span<const uint32_t> facet, const std::vector<Vector>& v) {
      e = v[facet[1]] - v[facet[0]];
      f = v[facet[2]] - v[facet[0]];
    };
    if (axis < facets_a_) {
      use_facet(a_.facet(axis), positions_a_);
    } else if (axis < facets_a_ + facets_b_) {
      use_facet(b_.facet(axis - facets_a_), positions_b_);
    } else {
      const auto [edge_a, edge_b] = EdgePair(axis);
      e = positions_a_[edge_a.head] - positions_a_[edge_a.tail];
      f = positions_b_[edge_b.head] - positions_b_[edge_b.tail];
    }
    const double d = kMinkowskiErrorFactor * filter_.size();
    const double sizes = e.cwiseAbs().maxCoeff() + f.cwiseAbs().maxCoeff();
    return {e.cross(f), kNormalErrorFactor * d * (sizes + 3 * d)};
  }

  auto VerticesOfA() {
    return [&pair = exact()](uint32_t i) { return pair.VertexA(i); };
  }
  auto VerticesOfB() {
    return [&pair = exact()](uint32_t i) { return pair.VertexB(i); };
  }
  template <typename VertexOf>
  static IntegerVector Along(const Edge& edge, VertexOf vertex) {
    return vertex(edge.head) - vertex(edge.tail);
  }

  IntegerVector Exact(uint64_t axis) {
    const auto of_facet = [](std::span<const uint32_t> facet, auto vertex) -> IntegerVector {
      return Cross(vertex(facet[1]) - vertex(facet[0]), vertex(facet[2]) - vertex(facet[0]));
    };
    if (axis < facets_a_) return of_facet(a_.facet(axis), VerticesOfA());
    if (axis < facets_a_ + facets_b_) return of_facet(b_.facet(axis - facets_a_), VerticesOfB());
    if (axis < facets_a_ + facets_b_ + edge_pairs_) {
      const auto [edge_a, edge_b] = EdgePair(axis);
      return Cross(Along(edge_a, VerticesOfA()), Along(edge_b, VerticesOfB()));
    }
    return flat_axes_[axis - facets_a_ - facets_b_ - edge_pairs_];
  }

  // Returns the distance between the intervals times |n|; negative if they overlap.
  double FloatGap(const Vector& n) const {
    const auto range = [&n](const std::vector<Vector>& positions) {
      double low = INFINITY;
      double high = -INFINITY;
      for (const Vector& p : positions) {
        const double value = n.dot(p);
        low = std::min(low, value);
        high = std::max(high, value);
      }
      return std::pair(low, high);
    };
    const auto [low_a, high_a] = range(positions_a_);
    const auto [low_b, high_b] = range(positions_b_);
    return std::max(low_b - high_a, low_a - high_b);
  }

  // Returns the sign of min n.B - max n.A.
  int SignOfGap(const IntegerVector& n) { return -Sign(Dot(n, exact().Farthest(n).w)); }

  // Parallel edges define no axis.
  Gap ExactGap(const IntegerVector& n) {
    if (IsZero(n)) return Gap::kOverlap;
    const int sign = std::max(SignOfGap(n), SignOfGap(-n));
    return sign > 0 ? Gap::kSeparated : sign == 0 ? Gap::kZero : Gap::kOverlap;
  }

  uint64_t flat_count() const {
    if (span_.dimension == 3) return 0;
    return span_.dimension == 2 ? 1 + a_.edges().size() + edges_b_ : 3;
  }

  void AppendFlatAxes() {
    const MinkowskiSpan& span = span_;
    if (span.dimension == 3) return;
    if (span.dimension == 2) {
      flat_axes_.push_back(span.direction);
      for (const Edge& edge : a_.edges()) {
        flat_axes_.push_back(Cross(span.direction, Along(edge, VerticesOfA())));
      }
      for (const Edge& edge : b_.edges()) {
        flat_axes_.push_back(Cross(span.direction, Along(edge, VerticesOfB())));
      }
      return;
    }
    if (span.dimension == 1) {
      const IntegerVector across = AnyPerpendicular(span.direction);
      flat_axes_.push_back(across);
      flat_axes_.push_back(Cross(span.direction, across));
      flat_axes_.push_back(span.direction);
      return;
    }
    for (int i = 0; i < 3; ++i) {
      IntegerVector unit = {0, 0, 0};
      unit[i] = 1;
      flat_axes_.push_back(unit);
    }
  }

  const FloatPair& filter_;
  const std::function<bool()>& should_stop_;
  const Hull& a_;
  const Hull& b_;
  uint64_t facets_a_;
  uint64_t facets_b_;
  uint64_t edges_b_;
  uint64_t edge_pairs_;
  MinkowskiSpan span_ = {3, {0, 0, 0}};
  std::once_flag multiplied_out_;
  std::atomic<bool> is_multiplied_out_ = false;
  std::optional<ExactPair> exact_;
  std::vector<IntegerVector> flat_axes_;
  std::vector<Vector> positions_a_;
  std::vector<Vector> positions_b_;
};

void LowerTo(std::atomic<uint64_t>& lowest, uint64_t value) {
  uint64_t seen = lowest.load(std::memory_order_relaxed);
  while (value < seen && !lowest.compare_exchange_weak(seen, value, std::memory_order_relaxed)) {
  }
}

// Finds the lowest axis that separates and the lowest that shows a zero gap. Skips axes beyond a
// separating one, which cannot hide a lower axis.
struct Scan {
  using Clock = TextbookSearch::Clock;

  std::atomic<uint64_t> separated = kNone;
  std::atomic<uint64_t> zero = kNone;
  std::atomic<bool> stopped = false;
  // Threads claim blocks of axes in order.
  std::atomic<uint64_t> next_axis = 0;

  // Continues until `end`. Returns true if no axis is left to test.
  bool Run(AxisTable& axes, const QueryOptions& options, Clock::time_point end) {
    std::atomic<bool> paused = false;
#pragma omp parallel num_threads(std::max(1, options.threads)) if (options.threads > 1)
    {
      StopPoll poll(options.should_stop, 1);
      while (!paused.load(std::memory_order_relaxed) && !stopped.load(std::memory_order_relaxed)) {
        const uint64_t first = next_axis.fetch_add(axes.block(), std::memory_order_relaxed);
        if (IsLeft(first, axes) && poll.Step()) stopped = true;
        if (!IsLeft(first, axes) || poll.stopped()) break;
        RunBlock(axes, first, std::min(first + axes.block(), axes.size()));
        if (axes.stopped()) stopped = true;
        if (Clock::now() >= end) paused = true;
      }
    }
    return !stopped && !IsLeft(next_axis, axes);
  }

  bool IsLeft(uint64_t axis, const AxisTable& axes) const {
    return axis < axes.size() && axis <= separated.load(std::memory_order_relaxed);
  }

  void RunBlock(AxisTable& axes, uint64_t first, uint64_t end) {
    for (uint64_t axis = first; axis < end; ++axis) {
      const Gap gap = axes.Test(axis);
      if (axes.stopped()) return;
      if (gap == Gap::kZero) LowerTo(zero, axis);
      if (gap == Gap::kSeparated) {
        LowerTo(separated, axis);
        return;
      }
    }
  }
};

absl::Status Stopped() { return absl::CancelledError("textbook SAT was cancelled"); }

absl::Status CheckCount(uint64_t count, const QueryOptions& options) {
  if (count <= options.max_textbook_axes) return absl::OkStatus();
  return absl::ResourceExhaustedError(absl::StrCat(
      "textbook SAT would test ", count, " axes; the limit is ", options.max_textbook_axes));
}

}  // namespace

struct TextbookSearch::State {
  State(const PlacedHull& a, const PlacedHull& b, const QueryOptions& given_options)
      : options(given_options), filter(a, b), axes(filter, options.should_stop) {}

  const QueryOptions& options;
  FloatPair filter;
  AxisTable axes;
  Scan scan;
};

TextbookSearch::TextbookSearch(std::unique_ptr<State> state) : state_(std::move(state)) {}
TextbookSearch::TextbookSearch(TextbookSearch&&) noexcept = default;
TextbookSearch& TextbookSearch::operator=(TextbookSearch&&) noexcept = default;
TextbookSearch::~TextbookSearch() = default;

absl::StatusOr<TextbookSearch> TextbookSearch::Begin(const PlacedHull& placed_a,
                                                     const PlacedHull& placed_b,
                                                     const QueryOptions& options) {
  const Hull& a = placed_a.hull();
  const Hull& b = placed_b.hull();
  HULLD_CHECK(!a.empty() && !b.empty());
  // Checks the limit before any computation, and again with the axes of a flat difference.
  const uint64_t solid = a.facet_count() + b.facet_count() + a.edges().size() * b.edges().size();
  if (absl::Status status = CheckCount(solid, options); !status.ok()) return status;
  auto state = std::make_unique<State>(placed_a, placed_b, options);
  if (absl::Status status = CheckCount(state->axes.size(), options); !status.ok()) return status;
  state->axes.Prepare();
  if (state->axes.stopped()) return Stopped();
  return TextbookSearch(std::move(state));
}

absl::StatusOr<bool> TextbookSearch::Advance(Clock::time_point end) {
  const bool done = state_->scan.Run(state_->axes, state_->options, end);
  if (state_->scan.stopped) return Stopped();
  return done;
}

absl::StatusOr<Answer> TextbookSearch::Finish() {
  const QueryOptions& options = state_->options;
  const Scan& scan = state_->scan;
  AxisTable& axes = state_->axes;
  HULLD_CHECK(!scan.stopped && !scan.IsLeft(scan.next_axis, axes));
  Answer answer;
  answer.rung = Rung::kExact;
  uint64_t found = kNone;
  if (scan.separated != kNone) {
    answer.relation = Relation::kSeparated;
    found = scan.separated;
  } else if (scan.zero != kNone) {
    answer.relation = Relation::kTouching;
    found = scan.zero;
  } else {
    answer.relation = Relation::kOverlapping;
  }
  if (options.want_analysis) {
    Analysis analysis;
    analysis.axes_total = axes.size();
    analysis.axes_tested = answer.relation == Relation::kSeparated ? found + 1 : axes.size();
    if (found != kNone) {
      analysis.stage = axes.KindOf(found);
      analysis.axis_index = found;
    }
    answer.analysis = analysis;
  }
  if (options.want_axis && found != kNone) {
    SeparatingAxis axis = DescribeAxis(axes.exact(), axes.Oriented(found));
    if (axes.stopped()) return Stopped();
    axis.kind = axes.KindOf(found);
    answer.axis = std::move(axis);
  }
  return answer;
}

size_t TextbookSearch::MemoryBytes() const { return sizeof(State) + state_->axes.MemoryBytes(); }

absl::StatusOr<Answer> TextbookSat(const PlacedHull& a, const PlacedHull& b,
                                   const QueryOptions& options) {
  absl::StatusOr<TextbookSearch> search = TextbookSearch::Begin(a, b, options);
  if (!search.ok()) return search.status();
  const absl::StatusOr<bool> done = search->Advance(TextbookSearch::Clock::time_point::max());
  if (!done.ok()) return done.status();
  return search->Finish();
}

}  // namespace hulld
