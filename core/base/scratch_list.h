#ifndef HULLD_CORE_BASE_SCRATCH_LIST_H_
#define HULLD_CORE_BASE_SCRATCH_LIST_H_

#include <algorithm>
#include <cstddef>
#include <memory>
#include <type_traits>

#include "core/base/check.h"

namespace hulld {

// A list of temporary elements, reused by successive tasks. It keeps its memory, and leaves
// elements uninitialized until they are assigned. A copy is empty.
template <typename T>
class ScratchList {
  static_assert(std::is_trivially_copyable_v<T>);

 public:
  ScratchList() = default;
  ScratchList(const ScratchList&) {}
  ScratchList& operator=(const ScratchList& other) {
    if (this != &other) *this = ScratchList();
    return *this;
  }
  ScratchList(ScratchList&&) noexcept = default;
  ScratchList& operator=(ScratchList&&) noexcept = default;

  size_t size() const { return size_; }
  size_t capacity() const { return capacity_; }
  bool empty() const { return size_ == 0; }
  T* data() { return elements_.get(); }
  const T* data() const { return elements_.get(); }
  T* begin() { return data(); }
  T* end() { return data() + size_; }
  const T* begin() const { return data(); }
  const T* end() const { return data() + size_; }
  T& operator[](size_t i) { return elements_[i]; }
  const T& operator[](size_t i) const { return elements_[i]; }
  T& back() { return elements_[size_ - 1]; }
  const T& back() const { return elements_[size_ - 1]; }

  void clear() { size_ = 0; }
  // Requires: size <= capacity.
  void SetSize(size_t size) {
    HULLD_DCHECK(size <= capacity_);
    size_ = size;
  }
  // Grows the capacity to at least `room` elements in total; keeps the first `used`.
  void MakeRoom(size_t room, size_t used) {
    if (room > capacity_) Grow(room, used);
  }
  void push_back(const T& value) {
    const T copy = value;  // may be an element that moves
    MakeRoom(size_ + 1, size_);
    elements_[size_++] = copy;
  }
  void pop_back() { --size_; }

 private:
  void Grow(size_t room, size_t used) {
    capacity_ = std::max(room, 2 * capacity_);
    auto grown = std::make_unique_for_overwrite<T[]>(capacity_);
    std::copy_n(elements_.get(), used, grown.get());
    elements_ = std::move(grown);
  }

  std::unique_ptr<T[]> elements_;
  size_t size_ = 0;
  size_t capacity_ = 0;
};

}  // namespace hulld

#endif  // HULLD_CORE_BASE_SCRATCH_LIST_H_
