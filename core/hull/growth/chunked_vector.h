#ifndef HULLD_CORE_HULL_GROWTH_CHUNKED_VECTOR_H_
#define HULLD_CORE_HULL_GROWTH_CHUNKED_VECTOR_H_

#include <cstddef>
#include <memory>
#include <vector>

namespace hulld {

// A vector that grows in chunks of 256 elements and never moves one: no single push_back costs
// more than a chunk, however long the vector, and nothing is held in reserve for a doubling.
template <typename T>
class ChunkedVector {
 public:
  ChunkedVector() = default;
  ChunkedVector(const ChunkedVector& other) { *this = other; }
  ChunkedVector& operator=(const ChunkedVector& other) {
    if (this == &other) return *this;
    chunks_.clear();
    for (size_t first = 0; first < other.size_; first += kMask + 1) {
      chunks_.push_back(std::make_unique<Chunk>(*other.chunks_[first >> kBits]));
    }
    size_ = other.size_;
    return *this;
  }
  ChunkedVector(ChunkedVector&&) noexcept = default;
  ChunkedVector& operator=(ChunkedVector&&) noexcept = default;

  size_t size() const { return size_; }
  T& operator[](size_t i) { return (*chunks_[i >> kBits])[i & kMask]; }
  const T& operator[](size_t i) const { return (*chunks_[i >> kBits])[i & kMask]; }

  bool empty() const { return size_ == 0; }
  const T& back() const { return (*this)[size_ - 1]; }
  // Keeps the memory.
  void pop_back() { --size_; }
  size_t MemoryBytes() const {
    return chunks_.size() * sizeof(Chunk) + chunks_.capacity() * sizeof(chunks_[0]);
  }

  void push_back(const T& value) { (*this)[Extend()] = value; }
  // Appends an element that is still to be assigned; returns its index.
  size_t Extend() {
    if (size_ >> kBits == chunks_.size())
      chunks_.push_back(std::make_unique_for_overwrite<Chunk>());
    return size_++;
  }

 private:
  static constexpr int kBits = 8;
  static constexpr size_t kMask = (size_t{1} << kBits) - 1;
  struct Chunk {
    T elements[kMask + 1];
    T& operator[](size_t i) { return elements[i]; }
    const T& operator[](size_t i) const { return elements[i]; }
  };

  std::vector<std::unique_ptr<Chunk>> chunks_;
  size_t size_ = 0;
};

}  // namespace hulld

#endif  // HULLD_CORE_HULL_GROWTH_CHUNKED_VECTOR_H_
