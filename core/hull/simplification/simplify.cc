#include "core/hull/simplification/simplify.h"

#include <absl/status/status.h>
#include <absl/strings/str_cat.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include "core/base/check.h"
#include "core/base/stop_poll.h"
#include "core/hull/simplification/enclosure.h"
#include "core/hull/simplification/inside_order.h"
#include "core/hull/simplification/inside_search.h"
#include "core/hull/simplification/subset_hull.h"
#include "core/hull/simplification/unit_scale.h"

namespace hulld {
namespace {

constexpr size_t kBoxVertices = 8;

absl::Status CheckTarget(const SimplifyTarget& target, size_t min_vertices) {
  if (std::isnan(target.max_error) || target.max_error < 0) {
    return absl::InvalidArgumentError(
        absl::StrCat("max_error is ", std::isnan(target.max_error) ? "NaN" : "negative",
                     "; use a length above 0, or 0 for no limit"));
  }
  if (std::isinf(target.max_error)) {
    return absl::InvalidArgumentError("max_error is infinite; use 0 for no limit");
  }
  if (target.max_vertices == 0 && target.max_error == 0) {
    return absl::InvalidArgumentError("set max_vertices, max_error, or both");
  }
  if (target.max_vertices != 0 && target.max_vertices < min_vertices) {
    return absl::InvalidArgumentError(absl::StrCat("max_vertices is ", target.max_vertices,
                                                   "; it must be at least ", min_vertices));
  }
  return absl::OkStatus();
}

absl::Status Stopped() { return absl::CancelledError("the simplification was cancelled"); }

// One call of SimplifyOutside, for a hull of dimension 2 or 3.
class OutsideSearch {
 public:
  OutsideSearch(const Hull& hull, const SimplifyTarget& target, StopPoll& poll)
      : hull_(hull),
        target_(target),
        poll_(poll),
        scale_(hull.max_abs_coordinate()),
        max_vertices_(target.max_vertices == 0
                          ? hull.vertices().size()
                          : std::min(target.max_vertices, hull.vertices().size())),
        order_(hull, scale_, poll),
        enclosure_(hull, order_.unit_points(), scale_, target.should_stop, poll) {}

  absl::StatusOr<SimplifiedHull> Run() {
    if (!poll_.stopped()) {
      if (hull_.vertices().size() <= max_vertices_) Consider(SimplifiedHull{hull_, 0});
      Consider(enclosure_.ByBox());
      if (target_.max_error > 0) Search();
      if (!best_ || !Reaches(*best_)) TryPushing(max_vertices_ / CornersPerVertex());
    }
    if (poll_.stopped()) return Stopped();
    // The box is a hull for all finite doubles, with no more vertices than the least permitted
    // limit.
    HULLD_CHECK(best_.has_value());
    return *std::move(best_);
  }

 private:
  bool Reaches(const SimplifiedHull& hull) const {
    return target_.max_error > 0 && hull.error <= target_.max_error;
  }

  // Orders hulls within max_error before all other hulls, and orders the former by number of
  // vertices, the latter by error.
  bool IsBetter(const SimplifiedHull& a, const SimplifiedHull& b) const {
    if (Reaches(a) != Reaches(b)) return Reaches(a);
    const size_t count_a = a.hull.vertices().size();
    const size_t count_b = b.hull.vertices().size();
    if (Reaches(a) && count_a != count_b) return count_a < count_b;
    return a.error != b.error ? a.error < b.error : count_a < count_b;
  }

  // Keeps the hull if it is the best so far. Returns true if it is within both limits.
  bool Consider(std::optional<SimplifiedHull> hull) {
    if (!hull || poll_.stopped() || hull->hull.vertices().size() > max_vertices_) return false;
    const bool reaches = Reaches(*hull);
    if (!best_ || IsBetter(*hull, *best_)) best_ = std::move(hull);
    return reaches;
  }

  // Returns the largest error of an enclosure that may be better than the best.
  double MaxError() const {
    return best_ ? std::max(best_->error, target_.max_error) : std::numeric_limits<double>::max();
  }

  bool TryPushing(size_t inside_vertices) {
    if (inside_vertices < order_.least()) return false;
    const std::vector<uint32_t> first = order_.First(inside_vertices);
    if (poll_.stopped()) return false;
    const std::optional<Hull> inside = HullOfSubset(hull_, first, poll_);
    return inside && Consider(enclosure_.ByPushing(*inside, MaxError()));
  }

  size_t CornersPerVertex() const { return hull_.dimension() == 2 ? 2 : 1; }

  // Pushing a vertex errs by at least the distance it is pushed, about the error of the inside
  // hull. The search starts there, continues in steps, and then bisects.
  void Search() {
    const size_t worthwhile =
        best_ && Reaches(*best_) ? best_->hull.vertices().size() : max_vertices_;
    const size_t max_vertices = worthwhile / CornersPerVertex();
    if (max_vertices < order_.least()) return;
    size_t fails = order_.CountFor(target_.max_error, max_vertices);
    if (TryPushing(fails)) return;
    size_t reaches = fails;
    do {
      if (reaches == max_vertices || poll_.stopped()) return;
      fails = reaches;
      reaches = std::min(max_vertices, reaches + reaches / 8 + 1);
    } while (!TryPushing(reaches));
    while (reaches - fails > 1 + reaches / 32 && !poll_.stopped()) {
      const size_t middle = fails + (reaches - fails) / 2;
      (TryPushing(middle) ? reaches : fails) = middle;
    }
  }

  const Hull& hull_;
  const SimplifyTarget& target_;
  StopPoll& poll_;
  const UnitScale scale_;
  const size_t max_vertices_;
  InsideOrder order_;
  Enclosure enclosure_;
  std::optional<SimplifiedHull> best_;
};

}  // namespace

absl::StatusOr<SimplifiedHull> SimplifyInside(const Hull& hull, const SimplifyTarget& target) {
  const auto least = static_cast<size_t>(hull.dimension() + 1);
  if (absl::Status s = CheckTarget(target, least); !s.ok()) return s;
  const size_t all = hull.vertices().size();
  const size_t max_vertices = target.max_vertices == 0 ? all : std::min(all, target.max_vertices);
  if (all <= least || (target.max_error == 0 && all == max_vertices)) {
    return SimplifiedHull{hull, 0};
  }
  StopPoll poll(target.should_stop);
  const VertexChoice choice = ChooseInside(hull, target.max_error, max_vertices, poll);
  if (poll.stopped()) return Stopped();
  std::optional<Hull> inside = HullOfSubset(hull, choice.vertices, poll);
  if (!inside) return Stopped();
  return SimplifiedHull{*std::move(inside), choice.error};
}

absl::StatusOr<SimplifiedHull> SimplifyOutside(const Hull& hull, const SimplifyTarget& target) {
  if (absl::Status s = CheckTarget(target, kBoxVertices); !s.ok()) return s;
  const size_t all = hull.vertices().size();
  if (all <= kBoxVertices || (target.max_error == 0 && all <= target.max_vertices)) {
    // With up to 8 vertices, no enclosure has an error of 0 and fewer vertices.
    return SimplifiedHull{hull, 0};
  }
  StopPoll poll(target.should_stop);
  return OutsideSearch(hull, target, poll).Run();
}

}  // namespace hulld
