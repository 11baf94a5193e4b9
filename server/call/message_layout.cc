#include "server/call/message_layout.h"

#include <google/protobuf/message.h>
#include <google/protobuf/wire_format_lite.h>

#include <algorithm>
#include <map>
#include <memory>
#include <mutex>

#include "core/base/check.h"

namespace hulld::server {
namespace {

using google::protobuf::Descriptor;
using google::protobuf::FieldDescriptor;
using WireFormat = google::protobuf::internal::WireFormatLite;

// Maximum overhead of an allocation.
constexpr uint64_t kAllocation = 16;
// Lists grow by doubling, so up to half of their capacity is unused.
constexpr uint64_t kSlack = 2;
constexpr uint64_t kListedPointer = kSlack * sizeof(void*);
constexpr uint64_t kText = sizeof(std::string) + 2 * kAllocation;
// First allocation of a list.
constexpr uint64_t kFirstElements = 64;
// An entry of an UnknownFieldSet, and the string that it may point to.
constexpr uint64_t kUnknown = 2 * 16 + kText;
// The set itself, which each message may have.
constexpr uint64_t kUnknownSet = 48;
// Protobuf's depth limit.
constexpr int kDeepest = 100;
// Field numbers of the contract are small. A larger one counts as unknown, which needs more memory.
constexpr int kLargestNumber = 255;

bool IsVarint(FieldDescriptor::Type type) {
  switch (type) {
    case FieldDescriptor::TYPE_DOUBLE:
    case FieldDescriptor::TYPE_FLOAT:
    case FieldDescriptor::TYPE_FIXED64:
    case FieldDescriptor::TYPE_FIXED32:
    case FieldDescriptor::TYPE_SFIXED32:
    case FieldDescriptor::TYPE_SFIXED64:
      return false;
    default:
      return true;
  }
}

uint32_t ElementBytes(FieldDescriptor::CppType type) {
  switch (type) {
    case FieldDescriptor::CPPTYPE_DOUBLE:
    case FieldDescriptor::CPPTYPE_INT64:
    case FieldDescriptor::CPPTYPE_UINT64:
      return 8;
    case FieldDescriptor::CPPTYPE_BOOL:
      return 1;
    default:
      return 4;
  }
}

}  // namespace

// The unread part of a message.
class MessageLayout::Input {
 public:
  Input(const uint8_t* begin, const uint8_t* end) : next_(begin), end_(end) {}

  uint32_t ReadTag() {
    uint64_t tag = 0;
    return ReadVarint(&tag) ? static_cast<uint32_t>(tag) : 0;
  }
  bool ReadVarint(uint64_t* value) {
    if (next_ < end_ && *next_ < 0x80) {
      *value = *next_++;
      return true;
    }
    *value = 0;
    for (int shift = 0; shift < 70 && next_ < end_; shift += 7) {
      const uint8_t byte = *next_++;
      *value |= static_cast<uint64_t>(byte & 0x7f) << shift;
      if (byte < 0x80) return true;
    }
    return false;
  }
  bool Skip(uint32_t length) {
    if (length > left()) return false;
    next_ += length;
    return true;
  }
  uint64_t left() const { return static_cast<uint64_t>(end_ - next_); }
  // Removes and returns the next `length` bytes. Requires length <= left().
  Input Take(uint64_t length) {
    HULLD_DCHECK(length <= left());
    const uint8_t* const begin = next_;
    next_ += length;
    return {begin, next_};
  }
  uint64_t CountVarints() const {
    const auto ends_varint = [](uint8_t byte) { return byte < 0x80; };
    return static_cast<uint64_t>(std::count_if(next_, end_, ends_varint));
  }

 private:
  const uint8_t* next_;
  const uint8_t* const end_;
};

const MessageLayout& MessageLayout::Of(const Descriptor& type) {
  // Recursive: a layout requests the layouts of its fields. Self-referential types are not
  // supported; the contract has none.
  static std::recursive_mutex mutex;
  static auto& layouts = *new std::map<const Descriptor*, std::unique_ptr<const MessageLayout>>;
  const std::lock_guard lock(mutex);
  const auto known = layouts.find(&type);
  if (known != layouts.end()) {
    HULLD_CHECK(known->second != nullptr);
    return *known->second;
  }
  layouts[&type] = nullptr;
  std::unique_ptr<const MessageLayout> made(new MessageLayout(type));
  return *(layouts[&type] = std::move(made));
}

MessageLayout::MessageLayout(const Descriptor& type) {
  const google::protobuf::Message* const empty =
      google::protobuf::MessageFactory::generated_factory()->GetPrototype(&type);
  HULLD_CHECK(empty != nullptr);
  own_bytes_ = empty->SpaceUsedLong() + kAllocation + kUnknownSet;
  for (int i = 0; i < type.field_count(); ++i) {
    const FieldDescriptor& described = *type.field(i);
    if (described.number() > kLargestNumber) continue;
    const auto number = static_cast<size_t>(described.number());
    if (number >= fields_.size()) fields_.resize(number + 1);
    Field& field = fields_[number];
    field.is_repeated = described.is_repeated();
    if (field.is_repeated) own_bytes_ += kFirstElements;
    switch (described.cpp_type()) {
      case FieldDescriptor::CPPTYPE_STRING:
        field.kind = Field::Kind::kText;
        break;
      case FieldDescriptor::CPPTYPE_MESSAGE:
        field.kind = Field::Kind::kMessage;
        field.message = &Of(*described.message_type());
        break;
      default:
        field.kind = Field::Kind::kNumber;
        field.is_varint = IsVarint(described.type());
        field.element_bytes = ElementBytes(described.cpp_type());
        break;
    }
  }
}

const MessageLayout::Field& MessageLayout::FieldAt(int number) const {
  static const Field kNone;
  return static_cast<size_t>(number) < fields_.size() ? fields_[static_cast<size_t>(number)]
                                                      : kNone;
}

uint64_t MessageLayout::ParsedBytes(std::string_view message, uint64_t most) const {
  uint64_t bytes = own_bytes_;
  const auto* const begin = reinterpret_cast<const uint8_t*>(message.data());
  Input input(begin, begin + message.size());
  Count(input, most, 0, bytes);
  return bytes;
}

void MessageLayout::Count(Input& input, uint64_t most, int depth, uint64_t& bytes) const {
  // Fields within a group count as unknown; the contract has no groups.
  int groups = 0;
  while (bytes <= most) {
    const uint32_t tag = input.ReadTag();
    if (tag == 0) return;
    static const Field kNone;
    const Field& field = groups > 0 ? kNone : FieldAt(WireFormat::GetTagFieldNumber(tag));
    const bool is_number = field.kind == Field::Kind::kNumber;
    // A list also accepts unpacked numbers. A number of the wrong wire type is kept as unknown.
    const uint64_t number_bytes =
        !is_number ? kUnknown : (field.is_repeated ? kSlack * field.element_bytes : 0);
    switch (WireFormat::GetTagWireType(tag)) {
      case WireFormat::WIRETYPE_VARINT: {
        uint64_t value = 0;
        if (!input.ReadVarint(&value)) return;
        bytes += is_number && field.is_varint ? number_bytes : kUnknown;
        break;
      }
      case WireFormat::WIRETYPE_FIXED64:
        if (!input.Skip(8)) return;
        bytes +=
            is_number && !field.is_varint && field.element_bytes == 8 ? number_bytes : kUnknown;
        break;
      case WireFormat::WIRETYPE_FIXED32:
        if (!input.Skip(4)) return;
        bytes +=
            is_number && !field.is_varint && field.element_bytes == 4 ? number_bytes : kUnknown;
        break;
      case WireFormat::WIRETYPE_START_GROUP:
        bytes += kUnknown;
        ++groups;
        break;
      case WireFormat::WIRETYPE_END_GROUP:
        if (--groups < 0) return;
        break;
      case WireFormat::WIRETYPE_LENGTH_DELIMITED:
        if (!CountDelimited(input, field, most, depth, bytes)) return;
        break;
      default:
        return;
    }
  }
}

// Counts a length-delimited field. Returns false if it is malformed or nested too deeply.
bool MessageLayout::CountDelimited(Input& input, const Field& field, uint64_t most, int depth,
                                   uint64_t& bytes) {
  const bool is_number = field.kind == Field::Kind::kNumber;
  const bool is_message = field.kind == Field::Kind::kMessage;
  // Parsing allocates before it detects a malformed length.
  bytes += is_message ? field.message->own_bytes_ : kAllocation;
  if (field.is_repeated && !is_number) bytes += kListedPointer;
  uint64_t read = 0;
  if (!input.ReadVarint(&read)) return false;
  const auto length = static_cast<uint32_t>(read);
  if (length > INT32_MAX) return false;
  const bool is_whole = length <= input.left();
  Input value = input.Take(std::min<uint64_t>(length, input.left()));
  if (is_message) {
    if (depth >= kDeepest) return false;
    field.message->Count(value, most, depth + 1, bytes);
    return is_whole && value.left() == 0;
  }
  if (is_number && field.is_repeated && field.is_varint) {
    bytes += kSlack * value.CountVarints() * field.element_bytes;
  } else if (is_number && field.is_repeated) {
    bytes += kSlack * length;
  } else if (field.kind == Field::Kind::kText) {
    bytes += kText + length;
  } else {
    bytes += kUnknown + length;
  }
  return is_whole;
}

}  // namespace hulld::server
