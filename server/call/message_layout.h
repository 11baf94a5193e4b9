#ifndef HULLD_SERVER_CALL_MESSAGE_LAYOUT_H_
#define HULLD_SERVER_CALL_MESSAGE_LAYOUT_H_

#include <google/protobuf/descriptor.h>
#include <google/protobuf/io/coded_stream.h>

#include <cstdint>
#include <string_view>
#include <vector>

namespace hulld::server {

// Memory layout of each field of a message type, for computing a message's parsed size from its
// bytes before parsing. An empty submessage takes two bytes on the wire but about a hundred in
// memory.
class MessageLayout {
 public:
  // Returns the layout of a compiled-in type, cached after the first call. Thread-safe.
  static const MessageLayout& Of(const google::protobuf::Descriptor& type);

  // Returns an upper bound on the memory, in bytes, of a message after parsing. Stops counting
  // above `limit`. Includes unknown fields, which parsing keeps. Counts a malformed message up to
  // the point where parsing fails. Cost: O(fields), a few ns each; packed numbers at memory speed.
  uint64_t ParsedBytes(std::string_view message, uint64_t limit) const;

 private:
  // A number, a string, or a message. Any other field counts as unknown.
  struct Field {
    bool is_number() const { return element_bytes > 0; }

    bool is_repeated = false;
    bool is_text = false;
    // Wire type of a single value. Lists of numbers may be packed or not.
    uint8_t wire_type = 0;
    // Bytes of a number in memory.
    uint32_t element_bytes = 0;
    const MessageLayout* message = nullptr;
  };

  explicit MessageLayout(const google::protobuf::Descriptor& type);

  void Count(google::protobuf::io::CodedInputStream& input, uint64_t limit, int depth,
             uint64_t& bytes) const;
  static bool CountDelimited(google::protobuf::io::CodedInputStream& input, const Field& field,
                             uint64_t limit, int depth, uint64_t& bytes);

  // Indexed by field number; gaps are unknown fields.
  std::vector<Field> fields_;
  // Size of an empty message.
  uint64_t own_bytes_ = 0;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_CALL_MESSAGE_LAYOUT_H_
