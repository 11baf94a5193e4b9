#include "server/store/postgres/parameters.h"

#include <absl/strings/str_cat.h>

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
  return absl::StrCat(
      EncodeInteger(1), EncodeInteger(0), EncodeInteger(static_cast<uint32_t>(element_)),
      EncodeInteger(std::exchange(count_, 0)), EncodeInteger(1), std::exchange(elements_, {}));
}

}  // namespace hulld::server
