#ifndef HULLD_CORE_HULL_GROWTH_CHUNKED_VECTOR_H_
#define HULLD_CORE_HULL_GROWTH_CHUNKED_VECTOR_H_

#include <algorithm>
#include <cstddef>
#include <memory>
#include <utility>
#include <vector>

namespace hulld {

// A vector that grows in chunks of 256 elements: no single push_back costs more than a chunk,
// however long the vector, and nothing is held in reserve for a doubling. Only a first chunk that
// is not full yet grows by doubling, so that small vectors stay small; then its elements move.
template <typename T>
class ChunkedVector {
 public:
  ChunkedVector() = default;
  ChunkedVector(const ChunkedVector& other) { *this = other; }
  ChunkedVector& operator=(const ChunkedVector& other) {
    if (this == &other) return *this;
    chunks_.clear();
    for (size_t first = 0; first < other.size_; first += kChunk) {
      const size_t capacity = first == 0 ? other.first_capacity_ : kChunk;
      const T* const from = other.chunks_[first >> kBits].get();
      chunks_.push_back(std::make_unique_for_overwrite<T[]>(capacity));
      std::copy_n(from, std::min(kChunk, other.size_ - first), chunks_.back().get());
    }
    first_capacity_ = chunks_.empty() ? 0 : other.first_capacity_;
    size_ = other.size_;
    return *this;
  }
  ChunkedVector(ChunkedVector&&) noexcept = default;
  ChunkedVector& operator=(ChunkedVector&&) noexcept = default;

  size_t size() const { return size_; }
  T& operator[](size_t i) { return chunks_[i >> kBits][i & kMask]; }
  const T& operator[](size_t i) const { return chunks_[i >> kBits][i & kMask]; }

  bool empty() const { return size_ == 0; }
  const T& back() const { return (*this)[size_ - 1]; }
  // Keeps the memory.
  void pop_back() { --size_; }
  size_t MemoryBytes() const {
    const size_t elements = chunks_.empty() ? 0 : first_capacity_ + (chunks_.size() - 1) * kChunk;
    return elements * sizeof(T) + chunks_.capacity() * sizeof(chunks_[0]);
  }

  void push_back(const T& value) {
    const T copy = value;  // may be an element that moves
    (*this)[Extend()] = copy;
  }
  // Appends an element that is still to be assigned; returns its index.
  size_t Extend() {
    if (size_ < kChunk) {
      if (size_ == first_capacity_) GrowFirst();
    } else if (size_ >> kBits == chunks_.size()) {
      chunks_.push_back(std::make_unique_for_overwrite<T[]>(kChunk));
    }
    return size_++;
  }

 private:
  static constexpr int kBits = 8;
  static constexpr size_t kChunk = size_t{1} << kBits;
  static constexpr size_t kMask = kChunk - 1;
  static constexpr size_t kLeastCapacity = 8;

  void GrowFirst() {
    const size_t capacity = std::max(kLeastCapacity, 2 * size_);
    auto grown = std::make_unique_for_overwrite<T[]>(capacity);
    if (chunks_.empty()) chunks_.emplace_back();
    std::copy_n(chunks_[0].get(), size_, grown.get());
    chunks_[0] = std::move(grown);
    first_capacity_ = capacity;
  }

  std::vector<std::unique_ptr<T[]>> chunks_;
  // Elements that the first chunk has room for.
  size_t first_capacity_ = 0;
  size_t size_ = 0;
};

}  // namespace hulld

#endif  // HULLD_CORE_HULL_GROWTH_CHUNKED_VECTOR_H_
