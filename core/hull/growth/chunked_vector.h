#ifndef HULLD_CORE_HULL_GROWTH_CHUNKED_VECTOR_H_
#define HULLD_CORE_HULL_GROWTH_CHUNKED_VECTOR_H_

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "core/base/check.h"

namespace hulld {

// A vector that grows in chunks of 256 elements and never moves one: no single push_back costs
// more than a chunk, however long the vector, and nothing is held in reserve for a doubling.
//
// It can keep a journal of what changes, to undo it: the old value of each element, when it is
// changed for the first time. That costs as much as what changes, not as what is there.
template <typename T>
class ChunkedVector {
 public:
  ChunkedVector() = default;
  // Requires that no journal is kept.
  ChunkedVector(const ChunkedVector& other) { *this = other; }
  ChunkedVector& operator=(const ChunkedVector& other) {
    if (this == &other) return *this;
    HULLD_CHECK(journal_end_ == 0 && other.journal_end_ == 0);
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
  const T& operator[](size_t i) const { return chunks_[i >> kBits]->elements[i & kMask]; }
  // The element, to be changed; where a journal is kept, that notes what it was.
  T& Mutable(size_t i) {
    Chunk& chunk = *chunks_[i >> kBits];
    if (i < journal_end_) Note(chunk, i);
    return chunk.elements[i & kMask];
  }

  bool empty() const { return size_ == 0; }
  const T& back() const { return (*this)[size_ - 1]; }
  // Keeps the memory.
  void pop_back() { --size_; }
  // The journal included.
  size_t MemoryBytes() const {
    return chunks_.size() * sizeof(Chunk) + chunks_.capacity() * sizeof(chunks_[0]) +
           journal_.capacity() * sizeof(Change);
  }

  void push_back(const T& value) { Mutable(Extend()) = value; }
  // Appends an element that is still to be assigned, by Mutable; returns its index.
  size_t Extend() {
    if (size_ >> kBits == chunks_.size())
      chunks_.push_back(std::make_unique_for_overwrite<Chunk>());
    return size_++;
  }

  // Starts a journal. Requires that none is kept.
  void StartJournal() {
    HULLD_CHECK(journal_.empty() && journal_end_ == 0);
    journal_end_ = size_;
    size_before_ = size_;
  }
  // Makes everything as it was when the journal was started, and ends it. Cost: the changes.
  void Undo() {
    for (const Change& change : journal_) {
      chunks_[change.index >> kBits]->elements[change.index & kMask] = change.before;
    }
    size_ = size_before_;
    EndJournal();
    chunks_.resize((size_ + kMask) >> kBits);
  }
  // Ends the journal and keeps what changed. Cost: the changes.
  void EndJournal() {
    for (const Change& change : journal_) {
      chunks_[change.index >> kBits]->noted[(change.index & kMask) / 64] = 0;
    }
    journal_ = {};
    journal_end_ = 0;
  }
  // What the journal holds.
  size_t JournalBytes() const { return journal_.size() * sizeof(Change); }

 private:
  static constexpr int kBits = 8;
  static constexpr size_t kMask = (size_t{1} << kBits) - 1;
  struct Chunk {
    T elements[kMask + 1];
    // By element, a bit: the journal has it.
    std::array<uint64_t, (kMask + 1) / 64> noted{};
  };
  struct Change {
    size_t index;
    T before;
  };

  void Note(Chunk& chunk, size_t i) {
    uint64_t& noted = chunk.noted[(i & kMask) / 64];
    const uint64_t bit = uint64_t{1} << (i % 64);
    if ((noted & bit) != 0) return;
    noted |= bit;
    journal_.push_back({i, chunk.elements[i & kMask]});
  }

  std::vector<std::unique_ptr<Chunk>> chunks_;
  size_t size_ = 0;
  // The journal is about elements below this; 0 when there is none.
  size_t journal_end_ = 0;
  size_t size_before_ = 0;
  std::vector<Change> journal_;
};

}  // namespace hulld

#endif  // HULLD_CORE_HULL_GROWTH_CHUNKED_VECTOR_H_
