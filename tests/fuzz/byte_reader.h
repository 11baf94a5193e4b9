#ifndef HULLD_TESTS_FUZZ_BYTE_READER_H_
#define HULLD_TESTS_FUZZ_BYTE_READER_H_

#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <span>

namespace hulld::fuzz {

// Reads the bytes of a program in order, then zeros. Read each in a separate statement: compilers
// differ in the evaluation order of operands.
class ByteReader {
 public:
  explicit ByteReader(std::span<const uint8_t> bytes) : rest_(bytes) {}

  bool empty() const { return rest_.empty(); }
  uint8_t Byte() {
    if (rest_.empty()) return 0;
    const uint8_t byte = rest_.front();
    rest_ = rest_.subspan(1);
    return byte;
  }
  // Returns a number in [0, n).
  size_t Below(size_t n) { return Byte() % n; }
  // True with probability 1/n; false after the end.
  bool OneOf(size_t n) { return Below(n) == n - 1; }
  // Returns an integer in [-4, 3].
  double SmallInteger() { return static_cast<double>(Byte() % 8) - 4; }
  // Returns an integer in [-128, 127].
  double SignedByte() { return static_cast<double>(static_cast<int8_t>(Byte())); }
  uint64_t Bits() {
    uint64_t bits = 0;
    for (int i = 0; i < 8; ++i) bits = bits << 8 | Byte();
    return bits;
  }
  double Raw() { return std::bit_cast<double>(Bits()); }
  // Returns a power of two from the least subnormal to the largest that leaves SignedByte finite.
  double PowerOfTwo() {
    constexpr int kExponents[] = {-1074, -1022, -700, -360, -307, -100, -3,
                                  0,     3,     100,  326,  331,  700,  1016};
    return std::ldexp(1.0, kExponents[Below(std::size(kExponents))]);
  }

 private:
  std::span<const uint8_t> rest_;
};

// A small generator that expands one seed byte.
class Scatter {
 public:
  explicit Scatter(uint32_t seed) : state_(seed * 2654435761u + 1) {}
  double Between(int low, int high) {
    state_ = state_ * 1664525u + 1013904223u;
    return low + static_cast<int>((state_ >> 12) % static_cast<uint32_t>(high - low + 1));
  }

 private:
  uint32_t state_;
};

}  // namespace hulld::fuzz

#endif  // HULLD_TESTS_FUZZ_BYTE_READER_H_
