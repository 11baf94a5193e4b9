#include "server/store/postgres/parameters.h"

#include <utility>

namespace hulld::server {

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
