#ifndef HULLD_CLIENT_FORMATS_BINARY_SCALAR_H_
#define HULLD_CLIENT_FORMATS_BINARY_SCALAR_H_

#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>

namespace hulld {

// Scalar types of binary PLY and PCD files.
enum class ScalarType {
  kInt8,
  kUint8,
  kInt16,
  kUint16,
  kInt32,
  kUint32,
  kInt64,
  kUint64,
  kFloat,
  kDouble
};

inline constexpr size_t kMaxScalarBytes = 8;

constexpr size_t SizeOf(ScalarType type) {
  // In the order of ScalarType.
  constexpr size_t kSizes[] = {1, 1, 2, 2, 4, 4, 8, 8, 4, 8};
  return kSizes[static_cast<size_t>(type)];
}

template <typename Scalar>
double LoadAs(const unsigned char* little_endian) {
  static_assert(std::endian::native == std::endian::little, "bytes are loaded as they lie");
  Scalar scalar;
  std::memcpy(&scalar, little_endian, sizeof(scalar));
  return static_cast<double>(scalar);
}

inline constexpr char kNoDouble[] =
    "a coordinate is a 64-bit integer that no double represents exactly; store it as a double";

// Returns false for a 64-bit integer that LoadScalar would round.
inline bool IsDouble(ScalarType type, const unsigned char* bytes, bool big_endian) {
  if (type != ScalarType::kInt64 && type != ScalarType::kUint64) return true;
  uint64_t magnitude = 0;
  for (int i = 0; i < 8; ++i) magnitude = magnitude << 8 | bytes[big_endian ? i : 7 - i];
  if (type == ScalarType::kInt64 && magnitude >> 63 != 0) magnitude = 0 - magnitude;
  return static_cast<int>(std::bit_width(magnitude)) - std::countr_zero(magnitude) <= 53;
}

// Returns the value stored in SizeOf(type) bytes. Exact, except for 64-bit integers beyond 2^53,
// which are rounded to nearest (see IsDouble).
inline double LoadScalar(ScalarType type, const unsigned char* bytes, bool big_endian) {
  unsigned char little[kMaxScalarBytes];
  const size_t size = SizeOf(type);
  for (size_t i = 0; i < size; ++i) little[i] = bytes[big_endian ? size - 1 - i : i];
  switch (type) {
    case ScalarType::kInt8:
      return LoadAs<int8_t>(little);
    case ScalarType::kUint8:
      return LoadAs<uint8_t>(little);
    case ScalarType::kInt16:
      return LoadAs<int16_t>(little);
    case ScalarType::kUint16:
      return LoadAs<uint16_t>(little);
    case ScalarType::kInt32:
      return LoadAs<int32_t>(little);
    case ScalarType::kUint32:
      return LoadAs<uint32_t>(little);
    case ScalarType::kInt64:
      return LoadAs<int64_t>(little);
    case ScalarType::kUint64:
      return LoadAs<uint64_t>(little);
    case ScalarType::kFloat:
      return LoadAs<float>(little);
    case ScalarType::kDouble:
      return LoadAs<double>(little);
  }
  return 0;
}

}  // namespace hulld

#endif  // HULLD_CLIENT_FORMATS_BINARY_SCALAR_H_
