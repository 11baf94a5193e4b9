#ifndef HULLD_CORE_BASE_BOXED_H_
#define HULLD_CORE_BASE_BOXED_H_

#include <memory>
#include <utility>

#include "core/base/check.h"

namespace hulld {

// An optional value on the heap. Takes one pointer if absent, so a structure with many optional
// parts is small when few are present. Copying copies the value.
template <typename T>
class Boxed {
 public:
  Boxed() = default;
  Boxed(T value) : value_(std::make_unique<T>(std::move(value))) {}  // NOLINT: as std::optional
  Boxed(Boxed&&) noexcept = default;
  Boxed& operator=(Boxed&&) noexcept = default;
  Boxed(const Boxed& other) : value_(other ? std::make_unique<T>(*other) : nullptr) {}
  Boxed& operator=(const Boxed& other) { return *this = Boxed(other); }

  bool has_value() const { return value_ != nullptr; }
  explicit operator bool() const { return has_value(); }

  // Requires: has_value().
  const T& operator*() const {
    HULLD_DCHECK(has_value());
    return *value_;
  }
  T& operator*() {
    HULLD_DCHECK(has_value());
    return *value_;
  }
  const T* operator->() const { return &**this; }
  T* operator->() { return &**this; }

 private:
  std::unique_ptr<T> value_;
};

}  // namespace hulld

#endif  // HULLD_CORE_BASE_BOXED_H_
