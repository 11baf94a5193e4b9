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
using google::protobuf::io::CodedInputStream;
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
constexpr int kMaxDepth = 100;
// Field numbers of the contract are small. A larger one counts as unknown, which needs more memory.
constexpr int kMaxFieldNumber = 255;

}  // namespace

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
    if (described.number() > kMaxFieldNumber) continue;
    const auto number = static_cast<size_t>(described.number());
    if (number >= fields_.size()) fields_.resize(number + 1);
    Field& field = fields_[number];
    field.is_repeated = described.is_repeated();
    if (field.is_repeated) own_bytes_ += kFirstElements;
    switch (described.cpp_type()) {
      case FieldDescriptor::CPPTYPE_STRING:
        field.is_text = true;
        break;
      case FieldDescriptor::CPPTYPE_MESSAGE:
        field.message = &Of(*described.message_type());
        break;
      case FieldDescriptor::CPPTYPE_DOUBLE:
      case FieldDescriptor::CPPTYPE_INT64:
      case FieldDescriptor::CPPTYPE_UINT64:
        field.element_bytes = 8;
        break;
      case FieldDescriptor::CPPTYPE_BOOL:
        field.element_bytes = 1;
        break;
      default:
        field.element_bytes = 4;
    }
    field.wire_type =
        WireFormat::WireTypeForFieldType(static_cast<WireFormat::FieldType>(described.type()));
  }
}

uint64_t MessageLayout::ParsedBytes(std::string_view message, uint64_t limit) const {
  uint64_t bytes = own_bytes_;
  CodedInputStream input(reinterpret_cast<const uint8_t*>(message.data()),
                         static_cast<int>(message.size()));
  Count(input, limit, 0, bytes);
  return bytes;
}

void MessageLayout::Count(CodedInputStream& input, uint64_t limit, int depth,
                          uint64_t& bytes) const {
  static const Field kNone;
  // Fields within a group count as unknown; the contract has no groups.
  int groups = 0;
  while (bytes <= limit) {
    const uint32_t tag = input.ReadTag();
    if (tag == 0) return;
    const auto number = static_cast<size_t>(WireFormat::GetTagFieldNumber(tag));
    const Field& field = groups > 0 || number >= fields_.size() ? kNone : fields_[number];
    const WireFormat::WireType type = WireFormat::GetTagWireType(tag);
    switch (type) {
      case WireFormat::WIRETYPE_START_GROUP:
        bytes += kUnknown;
        ++groups;
        break;
      case WireFormat::WIRETYPE_END_GROUP:
        if (--groups < 0) return;
        break;
      case WireFormat::WIRETYPE_LENGTH_DELIMITED:
        if (!CountDelimited(input, field, limit, depth, bytes)) return;
        break;
      default:
        if (!WireFormat::SkipField(&input, tag)) return;
        if (!field.is_number() || field.wire_type != type) {
          bytes += kUnknown;  // A number of the wrong wire type is kept as unknown.
        } else if (field.is_repeated) {
          bytes += kSlack * field.element_bytes;  // A list also accepts unpacked numbers.
        }
    }
  }
}

// Counts a length-delimited field. Returns false if it is malformed or nested too deeply.
bool MessageLayout::CountDelimited(CodedInputStream& input, const Field& field, uint64_t limit,
                                   int depth, uint64_t& bytes) {
  // Parsing allocates before it detects a malformed length.
  bytes += field.message != nullptr ? field.message->own_bytes_ : kAllocation;
  if (field.is_repeated && !field.is_number()) bytes += kListedPointer;
  int length = 0;
  if (!input.ReadVarintSizeAsInt(&length)) return false;
  const bool is_whole = length <= input.BytesUntilLimit();
  if (field.message != nullptr) {
    if (depth >= kMaxDepth) return false;
    const CodedInputStream::Limit outer = input.PushLimit(length);
    field.message->Count(input, limit, depth + 1, bytes);
    const bool is_read = input.BytesUntilLimit() == 0;
    input.PopLimit(outer);
    return is_whole && is_read;
  }
  const auto size = static_cast<uint64_t>(length);
  if (field.is_number() && field.is_repeated && field.wire_type == WireFormat::WIRETYPE_VARINT) {
    const void* data = nullptr;
    int available = 0;
    input.GetDirectBufferPointerInline(&data, &available);
    const auto* const begin = static_cast<const uint8_t*>(data);
    const auto ends_varint = [](uint8_t byte) { return byte < 0x80; };
    const auto count = std::count_if(begin, begin + std::min(length, available), ends_varint);
    bytes += kSlack * static_cast<uint64_t>(count) * field.element_bytes;
  } else if (field.is_number() && field.is_repeated) {
    bytes += kSlack * size;
  } else {
    bytes += (field.is_text ? kText : kUnknown) + size;
  }
  return input.Skip(length);
}

}  // namespace hulld::server
