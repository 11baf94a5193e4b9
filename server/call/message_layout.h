#ifndef HULLD_SERVER_CALL_MESSAGE_LAYOUT_H_
#define HULLD_SERVER_CALL_MESSAGE_LAYOUT_H_

#include <google/protobuf/descriptor.h>
#include <google/protobuf/io/coded_stream.h>

#include <cstddef>
#include <cstdint>
#include <vector>

namespace hulld::server {

// What each field of a type of messages takes in memory once it is parsed, so that the bytes of a
// message tell what it will take before anybody parses it. Two bytes on the wire, an empty
// submessage, become a hundred in memory.
class MessageLayout {
 public:
  // The layout of a type that is compiled in; made once, and kept. Thread-safe.
  static const MessageLayout& Of(const google::protobuf::Descriptor& type);

  // Bytes of memory that the message in `input` takes once it is parsed, at most; more than `most`
  // as soon as it is more than that. Unknown fields, which parsing keeps, count too. Where the
  // message is malformed the count ends, as parsing will. Cost: O(fields), some ns each;
  // numbers in packed lists are counted at memory speed.
  uint64_t ParsedBytes(google::protobuf::io::CodedInputStream& input, uint64_t most) const;

 private:
  struct Field {
    enum class Kind : uint8_t { kUnknown, kNumber, kText, kMessage };
    Kind kind = Kind::kUnknown;
    bool is_repeated = false;
    // Whether its elements, where they are numbers, are varints on the wire; packed ones are of the
    // same kind.
    bool is_varint = false;
    uint32_t element_bytes = 0;
    const MessageLayout* message = nullptr;
  };

  explicit MessageLayout(const google::protobuf::Descriptor& type);

  class PiecedInput;
  class FlatInput;

  template <typename Input>
  void Count(Input& input, uint64_t most, int depth, uint64_t& bytes) const;
  template <typename Input>
  static bool CountDelimited(Input& input, const Field& field, uint64_t most, int depth,
                             uint64_t& bytes);
  const Field& FieldAt(int number) const;

  // By number; those in between are unknown.
  std::vector<Field> fields_;
  // An empty message.
  uint64_t own_bytes_ = 0;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_CALL_MESSAGE_LAYOUT_H_
