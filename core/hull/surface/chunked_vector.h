#ifndef HULLD_CORE_HULL_SURFACE_CHUNKED_VECTOR_H_
#define HULLD_CORE_HULL_SURFACE_CHUNKED_VECTOR_H_

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include "core/base/check.h"

namespace hulld {

// A vector that grows in chunks of 256 elements: no push_back costs more than one chunk, regardless
// of the size, and there is no spare capacity from doubling. Only a first chunk that is not full
// grows by doubling, so that small vectors stay small; its elements then move.
//
// It can keep a journal for undo: the old value of each element at its first change. The journal
// costs as much as the changes, regardless of the size.
template <typename T>
class ChunkedVector {
 public:
  ChunkedVector() = default;
  // Requires: no journal.
  ChunkedVector(const ChunkedVector& other) { *this = other; }
  ChunkedVector& operator=(const ChunkedVector& other) {
    if (this == &other) return *this;
    HULLD_CHECK(journal_end_ == 0 && other.journal_end_ == 0);
    chunks_.clear();
    for (size_t first = 0; first < other.size_; first += kChunk) {
      const size_t capacity = first == 0 ? other.first_capacity_ : kChunk;
      const T* const from = other.chunks_[first >> kBits].get();
      chunks_.push_back(std::make_unique_for_overwrite<T[]>(capacity));
      std::copy_n(from, std::min(kChunk, other.size_ - first), chunks_.back().get());
    }
    noted_.clear();
    first_capacity_ = chunks_.empty() ? 0 : other.first_capacity_;
    size_ = other.size_;
    return *this;
  }
  ChunkedVector(ChunkedVector&&) noexcept = default;
  ChunkedVector& operator=(ChunkedVector&&) noexcept = default;

  size_t size() const { return size_; }
  const T& operator[](size_t i) const { return chunks_[i >> kBits][i & kMask]; }
  // Returns the element for modification, and records its old value in the journal, if any. Always
  // inlined: the loops over triangles call it for each neighbor. Observed: hulls of points on a
  // sphere take 0.9 of the time.
  [[gnu::always_inline]] T& Mutable(size_t i) {
    if (i < journal_end_) Note(i);
    return chunks_[i >> kBits][i & kMask];
  }

  bool empty() const { return size_ == 0; }
  const T& back() const { return (*this)[size_ - 1]; }
  // Keeps the memory.
  void pop_back() { --size_; }
  // Includes the journal.
  size_t MemoryBytes() const {
    const size_t elements = chunks_.empty() ? 0 : first_capacity_ + (chunks_.size() - 1) * kChunk;
    return elements * sizeof(T) + chunks_.capacity() * sizeof(chunks_[0]) +
           noted_.capacity() * sizeof(Noted) + journal_.capacity() * sizeof(Change);
  }

  void push_back(const T& value) {
    // A copy, because `value` may be an element that moves.
    const T copy = value;  // NOLINT(performance-unnecessary-copy-initialization)
    Mutable(Extend()) = copy;
  }
  // Appends an unassigned element, to be set by Mutable; returns its index.
  size_t Extend() {
    if (size_ < kChunk) {
      if (size_ == first_capacity_) GrowFirst();
    } else if (size_ >> kBits == chunks_.size()) {
      chunks_.push_back(std::make_unique_for_overwrite<T[]>(kChunk));
    }
    return size_++;
  }

  // Starts a journal. Requires: no journal.
  void StartJournal() {
    HULLD_CHECK(journal_.empty() && journal_end_ == 0);
    journal_end_ = size_;
  }
  // Restores the state at the start of the journal, and ends it. Cost: O(changes).
  void Undo() {
    for (const Change& change : journal_) {
      chunks_[change.index >> kBits][change.index & kMask] = change.before;
    }
    size_ = journal_end_;
    EndJournal();
    chunks_.resize((size_ + kMask) >> kBits);
    if (noted_.size() > chunks_.size()) noted_.resize(chunks_.size());
    if (chunks_.empty()) first_capacity_ = 0;
  }
  // Ends the journal and keeps the changes. Cost: O(changes).
  void EndJournal() {
    for (const Change& change : journal_) {
      noted_[change.index >> kBits][(change.index & kMask) / 64] = 0;
    }
    journal_ = {};
    journal_end_ = 0;
  }
  // Memory of the journal, in bytes.
  size_t JournalBytes() const { return journal_.size() * sizeof(Change); }

 private:
  static constexpr int kBits = 8;
  static constexpr size_t kChunk = size_t{1} << kBits;
  static constexpr size_t kMask = kChunk - 1;
  static constexpr size_t kMinCapacity = 8;
  // One bit for each element of a chunk: set if the journal contains it.
  using Noted = std::array<uint64_t, kChunk / 64>;
  struct Change {
    size_t index;
    T before;
  };

  void GrowFirst() {
    const size_t capacity = std::max(kMinCapacity, 2 * size_);
    auto grown = std::make_unique_for_overwrite<T[]>(capacity);
    if (chunks_.empty()) chunks_.emplace_back();
    std::copy_n(chunks_[0].get(), size_, grown.get());
    chunks_[0] = std::move(grown);
    first_capacity_ = capacity;
  }

  [[gnu::noinline]] void Note(size_t i) {
    if (noted_.size() < chunks_.size()) noted_.resize(chunks_.size());
    uint64_t& noted = noted_[i >> kBits][(i & kMask) / 64];
    const uint64_t bit = uint64_t{1} << (i % 64);
    if ((noted & bit) != 0) return;
    noted |= bit;
    journal_.push_back({i, chunks_[i >> kBits][i & kMask]});
  }

  std::vector<std::unique_ptr<T[]>> chunks_;
  // By chunk; may be shorter than the list of chunks, so that a vector without a journal has none.
  std::vector<Noted> noted_;
  // Capacity of the first chunk.
  size_t first_capacity_ = 0;
  size_t size_ = 0;
  // Number of elements at the start of the journal, which covers these; 0 without a journal.
  size_t journal_end_ = 0;
  std::vector<Change> journal_;
};

}  // namespace hulld

#endif  // HULLD_CORE_HULL_SURFACE_CHUNKED_VECTOR_H_
