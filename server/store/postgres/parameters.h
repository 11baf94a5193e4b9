#ifndef HULLD_SERVER_STORE_POSTGRES_PARAMETERS_H_
#define HULLD_SERVER_STORE_POSTGRES_PARAMETERS_H_

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "server/store/store_keys.h"

namespace hulld::server {

// Encodes a bigint in PostgreSQL's binary format. Revisions and other numbers stay below 2^63.
inline std::string EncodeBigint(uint64_t number) { return BigEndian(number); }
inline uint64_t DecodeBigint(std::string_view bytes) { return FromBigEndian(bytes); }
// Encodes an integer likewise.
inline std::string EncodeInteger(uint32_t number) { return BigEndian(number); }

// A one-dimensional array in PostgreSQL's binary format.
class ArrayParameter {
 public:
  enum class Element : uint32_t { kBytea = 17, kBigint = 20, kInteger = 23, kText = 25 };

  explicit ArrayParameter(Element element) : element_(element) {}
  // value: the element in binary format.
  void Add(std::string_view value);
  uint32_t count() const { return count_; }
  size_t bytes() const { return elements_.size(); }
  // Returns the array and clears it.
  std::string Take();

 private:
  Element element_;
  uint32_t count_ = 0;
  std::string elements_;
};

// A statement: the name of a prepared one, or the text of a statement without parameters.
struct Statement {
  const char* name = nullptr;
  const char* text = nullptr;
  // In binary format.
  std::vector<std::string> parameters = {};
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_STORE_POSTGRES_PARAMETERS_H_
