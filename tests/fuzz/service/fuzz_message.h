#ifndef HULLD_TESTS_FUZZ_SERVICE_FUZZ_MESSAGE_H_
#define HULLD_TESTS_FUZZ_SERVICE_FUZZ_MESSAGE_H_

#include <google/protobuf/message.h>

#include <cstddef>
#include <cstdint>
#include <string>

#include "tests/fuzz/byte_reader.h"

namespace hulld::fuzz {

// Client state that makes random messages meaningful more often.
struct MessageHints {
  // Last revision named by the server.
  uint64_t revision = 0;
  // Next sequence of the stream.
  uint64_t sequence = 1;
  // Number of placements of the stream.
  size_t placements = 0;
  // The store, if a reply has named it.
  std::string store_id = {};
};

// Fills any message by reflection from bytes, field by field in the order of their numbers. Field
// names determine the values: IDs come from a small dictionary of valid, malformed, and very long
// ones, coordinates in threes, indices near the bounds of the preceding placements, and sometimes
// mismatched values. Most messages are tame, with small numbers; the rest use doubles from the
// subnormals to infinity and NaN. Enums and fields may be unknown. Strings are UTF-8.
// Deterministic.
void FillMessage(ByteReader& in, const MessageHints& hints, google::protobuf::Message* message);

// Returns an ID of the dictionary.
std::string FuzzHullId(ByteReader& in);

}  // namespace hulld::fuzz

#endif  // HULLD_TESTS_FUZZ_SERVICE_FUZZ_MESSAGE_H_
