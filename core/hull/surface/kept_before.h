#ifndef HULLD_CORE_HULL_SURFACE_KEPT_BEFORE_H_
#define HULLD_CORE_HULL_SURFACE_KEPT_BEFORE_H_

#include <memory>
#include <utility>

#include "core/base/check.h"

namespace hulld {

// Journal data other than the old values of elements. Costs only a pointer while no journal exists,
// the usual state of a hull.
template <typename T>
class KeptBefore {
 public:
  KeptBefore() = default;
  // Requires: no journal.
  KeptBefore(const KeptBefore& other) { *this = other; }
  KeptBefore& operator=(const KeptBefore& other) {
    HULLD_CHECK(!*this && !other);
    return *this;
  }
  KeptBefore(KeptBefore&&) noexcept = default;
  KeptBefore& operator=(KeptBefore&&) noexcept = default;

  void Start(T before) { value_ = std::make_unique<T>(std::move(before)); }
  void End() { value_.reset(); }

  explicit operator bool() const { return value_ != nullptr; }
  // Requires: a journal.
  T* operator->() {
    HULLD_DCHECK(value_ != nullptr);
    return value_.get();
  }
  const T* operator->() const {
    HULLD_DCHECK(value_ != nullptr);
    return value_.get();
  }

 private:
  std::unique_ptr<T> value_;
};

}  // namespace hulld

#endif  // HULLD_CORE_HULL_SURFACE_KEPT_BEFORE_H_
