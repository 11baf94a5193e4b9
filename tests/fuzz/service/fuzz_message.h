#ifndef HULLD_TESTS_FUZZ_SERVICE_FUZZ_MESSAGE_H_
#define HULLD_TESTS_FUZZ_SERVICE_FUZZ_MESSAGE_H_

#include <google/protobuf/message.h>

#include <cstddef>
#include <cstdint>
#include <string>

#include "tests/fuzz/byte_reader.h"

namespace hulld::fuzz {

// What a client could know that makes its messages meaningful more often than chance does.
struct MessageHints {
  // The last revision that the server named.
  uint64_t revision = 0;
  // The next sequence of the stream.
  uint64_t sequence = 1;
  // How many placements the stream has.
  size_t placements = 0;
  // The store, once a reply named it.
  std::string store_id = {};
};

// Fills any message by reflection from bytes, field by field in the order of their numbers. Field
// names are its grammar: IDs come from a small dictionary of valid, malformed and very long ones,
// coordinates in threes, indices near the bounds of the placements that came before them, and now
// and then something that does not fit. Most messages are tame, of small numbers; the others take
// doubles from the subnormals to infinity and NaN. Enums may be unknown, and so may fields.
// Strings are UTF-8. Deterministic.
void FillMessage(ByteReader& in, const MessageHints& hints, google::protobuf::Message* message);

// An ID of the dictionary.
std::string FuzzHullId(ByteReader& in);

}  // namespace hulld::fuzz

#endif  // HULLD_TESTS_FUZZ_SERVICE_FUZZ_MESSAGE_H_
