#include "core/hull/simplification/inside_order.h"

#include <cstddef>

#include "core/base/check.h"

namespace hulld {

InsideOrder::InsideOrder(const Hull& hull, const UnitScale& scale, StopPoll& poll)
    : hull_(hull), scale_(scale), poll_(poll), unit_points_(scale.ToUnit(hull.vertices())) {
  HULLD_CHECK(hull.dimension() >= 2);
  if (hull.dimension() == 2) {
    polygon_.emplace(unit_points_, hull.facet(0), poll);
  } else {
    solid_.emplace(hull.vertices(), unit_points_, poll);
  }
  if (poll.stopped()) return;
  least_ = chosen().size();
  NoteError();
}

void InsideOrder::NoteError() {
  const bool is_complete = chosen().size() == hull_.vertices().size();
  const double error = polygon_ ? polygon_->DistanceBound() : solid_->DistanceBound();
  errors_.push_back(is_complete ? 0 : scale_.LengthFromUnit(error));
}

void InsideOrder::ExtendTo(size_t count) {
  HULLD_CHECK(count <= hull_.vertices().size());
  while (chosen().size() < count && !poll_.Step()) {
    if (polygon_) {
      polygon_->ChooseNext(poll_);
    } else {
      solid_->ChooseNext(poll_);
    }
    if (!poll_.stopped()) NoteError();
  }
}

size_t InsideOrder::CountFor(double error, size_t max_count) {
  HULLD_CHECK(max_count >= least_);
  size_t count = least_;
  while (count < max_count && !poll_.stopped() && ErrorAt(count) > error) ++count;
  return count;
}

double InsideOrder::ErrorAt(size_t count) {
  HULLD_CHECK(count >= least_);
  ExtendTo(count);
  return poll_.stopped() ? 0 : errors_[count - least_];
}

std::vector<uint32_t> InsideOrder::First(size_t count) {
  ExtendTo(count);
  if (poll_.stopped()) return {};
  return {chosen().begin(), chosen().begin() + static_cast<ptrdiff_t>(count)};
}

}  // namespace hulld
