#include "server/store/postgres/parameters.h"

#include <utility>

namespace hulld::server {
namespace {

template <typename T>
std::string NetworkOrder(T number) {
  std::string bytes(sizeof(T), '\0');
  for (size_t i = 0; i < sizeof(T); ++i) {
    bytes[i] = static_cast<char>(number >> (8 * (sizeof(T) - 1 - i)));
  }
  return bytes;
}

}  // namespace

std::string EncodeBigint(uint64_t number) { return NetworkOrder(number); }

uint64_t DecodeBigint(std::string_view bytes) {
  uint64_t number = 0;
  for (const char c : bytes) number = number << 8 | static_cast<unsigned char>(c);
  return number;
}

std::string EncodeInteger(uint32_t number) { return NetworkOrder(number); }

void ArrayParameter::Add(std::string_view value) {
  ++count_;
  elements_ += EncodeInteger(static_cast<uint32_t>(value.size()));
  elements_ += value;
}

// Header: number of dimensions, null flag, element type; then, per dimension, its length and its
// first index. Source: array_recv in PostgreSQL's utils/adt/arrayfuncs.c.
std::string ArrayParameter::Take() {
  std::string array = EncodeInteger(1) + EncodeInteger(0) +
                      EncodeInteger(static_cast<uint32_t>(element_)) + EncodeInteger(count_) +
                      EncodeInteger(1);
  array += std::exchange(elements_, {});
  count_ = 0;
  return array;
}

}  // namespace hulld::server
