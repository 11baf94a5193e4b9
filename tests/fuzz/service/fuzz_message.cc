#include "tests/fuzz/service/fuzz_message.h"

#include <google/protobuf/descriptor.h>
#include <google/protobuf/unknown_field_set.h>

#include <algorithm>
#include <iterator>
#include <limits>
#include <vector>

namespace hulld::fuzz {
namespace {

using google::protobuf::EnumDescriptor;
using google::protobuf::FieldDescriptor;
using google::protobuf::Message;
using google::protobuf::OneofDescriptor;
using google::protobuf::Reflection;
using google::protobuf::UnknownFieldSet;

constexpr int kMaxDepth = 8;
constexpr double kLargest = 1e308;
constexpr double kTiny = std::numeric_limits<double>::denorm_min();

// The first ones are most likely to exist.
const std::vector<std::string>& HullIds() {
  static const auto* const ids = new std::vector<std::string>{
      "cube",
      "cube",
      "tetra",
      "tetra",
      "empty",
      "flat",
      "cell-1/arm",
      "cell-1/hand",
      "cell-10/arm",
      "a.b-c_d",
      std::string(256, 'x'),
      std::string(257, 'y'),
      std::string(5000, 'z'),
      "",
      "/",
      "a//b",
      "a/",
      "..",
      "a b",
      "h\xc3\xbcll",
      std::string("nul\0nul", 7),
      "%s%n",
      "no such hull",
      "none",
  };
  return *ids;
}

class MessageFiller {
 public:
  MessageFiller(ByteReader& in, const MessageHints& hints)
      : in_(in), hints_(hints), placements_(hints.placements), tame_(!in.OneOf(8)) {}

  void Fill(Message* message, int depth) {
    const auto* const descriptor = message->GetDescriptor();
    for (int i = 0; i < descriptor->field_count(); ++i) {
      const FieldDescriptor* const field = descriptor->field(i);
      if (field->real_containing_oneof() != nullptr) continue;
      if (field->is_repeated()) {
        FillRepeated(message, field, depth);
      } else if (IsPresent(*field)) {
        FillOne(message, field, depth);
      }
    }
    for (int i = 0; i < descriptor->real_oneof_decl_count(); ++i) {
      FillOneof(message, descriptor->oneof_decl(i), depth);
    }
    auto* const placement = dynamic_cast<v1::Placement*>(message);
    // A placement has an ID or points; one with both is refused.
    if (placement != nullptr && placement->has_points() && !in_.OneOf(4)) {
      placement->clear_hull_id();
    }
    if (in_.OneOf(64)) {
      AddUnknown(message->GetReflection()->MutableUnknownFields(message), depth);
    }
  }

 private:
  // Optional fields are present with probability 1/4; fields that every request needs, nearly
  // always.
  bool IsPresent(const FieldDescriptor& field) {
    const std::string& name = field.name();
    // Most calls do not accept motions.
    if (name == "end_pose" || name == "max_time_error" || name == "resolution") {
      return in_.OneOf(32);
    }
    // Most scenes have no limit, and no motion.
    if (name == "first_only" || name == "every_piece") return in_.OneOf(16);
    if (field.has_optional_keyword() || name == "tolerance" || name == "simplification") {
      return in_.OneOf(4);
    }
    // Requests have placements in one form; programs pack them themselves.
    if (name == "packed_placements") return in_.OneOf(32);
    if (field.full_name() == "hulld.v1.Placement.points") return in_.OneOf(24);
    if (name == "freshness" || name == "radius") return in_.OneOf(8);
    if (field.cpp_type() == FieldDescriptor::CPPTYPE_MESSAGE) return !in_.OneOf(8);
    return !in_.OneOf(32);
  }

  void FillOneof(Message* message, const OneofDescriptor* oneof, int depth) {
    const size_t chosen = in_.Below(static_cast<size_t>(4 * oneof->field_count() + 1));
    if (chosen == static_cast<size_t>(4 * oneof->field_count())) return;
    FillOne(message, oneof->field(static_cast<int>(chosen) / 4), depth);
  }

  void FillOne(Message* message, const FieldDescriptor* field, int depth) {
    const Reflection& r = *message->GetReflection();
    switch (field->cpp_type()) {
      case FieldDescriptor::CPPTYPE_INT32:
        return r.SetInt32(message, field, static_cast<int32_t>(Integer(*field)));
      case FieldDescriptor::CPPTYPE_INT64:
        return r.SetInt64(message, field, static_cast<int64_t>(Integer(*field)));
      case FieldDescriptor::CPPTYPE_UINT32:
        return r.SetUInt32(message, field, static_cast<uint32_t>(Integer(*field)));
      case FieldDescriptor::CPPTYPE_UINT64:
        return r.SetUInt64(message, field, Integer(*field));
      case FieldDescriptor::CPPTYPE_DOUBLE:
        return r.SetDouble(message, field, Length(*field));
      case FieldDescriptor::CPPTYPE_FLOAT:
        return r.SetFloat(message, field, static_cast<float>(Double()));
      case FieldDescriptor::CPPTYPE_BOOL:
        return r.SetBool(message, field, in_.OneOf(3));
      case FieldDescriptor::CPPTYPE_ENUM:
        return r.SetEnumValue(message, field, Enum(*field->enum_type()));
      case FieldDescriptor::CPPTYPE_STRING:
        return r.SetString(message, field, String(*field));
      case FieldDescriptor::CPPTYPE_MESSAGE:
        if (depth < kMaxDepth) Fill(r.MutableMessage(message, field), depth + 1);
        return;
    }
  }

  void FillRepeated(Message* message, const FieldDescriptor* field, int depth) {
    const Reflection& r = *message->GetReflection();
    const size_t count = Count(*field);
    // Long lists expand one byte.
    Scatter scatter(in_.Byte());
    const bool scattered = count > 12;
    for (size_t i = 0; i < count; ++i) {
      switch (field->cpp_type()) {
        case FieldDescriptor::CPPTYPE_DOUBLE:
          r.AddDouble(message, field, scattered ? Near(scatter) : Double());
          break;
        case FieldDescriptor::CPPTYPE_FLOAT:
          r.AddFloat(message, field, static_cast<float>(scattered ? Near(scatter) : Double()));
          break;
        case FieldDescriptor::CPPTYPE_UINT32:
          r.AddUInt32(message, field, scattered ? Index(scatter) : Index());
          break;
        case FieldDescriptor::CPPTYPE_STRING:
          r.AddString(message, field, String(*field));
          break;
        case FieldDescriptor::CPPTYPE_MESSAGE:
          if (depth < kMaxDepth) Fill(r.AddMessage(message, field), depth + 1);
          break;
        default:
          return;
      }
    }
    if (field->name() != "placements") return;
    if (field->cpp_type() == FieldDescriptor::CPPTYPE_MESSAGE) placements_ = count;
    moved_ = count;
  }

  // Returns the length of a list, mostly consistent with the message.
  size_t Count(const FieldDescriptor& field) {
    constexpr size_t kLengths[] = {0, 1, 1, 2, 2, 2, 3, 3, 4, 4, 5, 6, 8, 12, 20, 70};
    const std::string& name = field.name();
    size_t count = kLengths[in_.Below(std::size(kLengths))];
    const size_t slip = in_.OneOf(24) ? 1 : 0;
    if (name == "xyz" || name == "xyz_float") {
      if (name == "xyz_float" && !in_.OneOf(4)) return 0;
      return 3 * count + slip;
    }
    if (name == "poses") return 7 * moved_ + slip;
    if (name == "pairs") return 2 * count + slip;
    if (name == "groups") return in_.OneOf(3) ? placements_ + slip : 0;
    if (name == "ignored_group_pairs") return in_.OneOf(8) ? 2 + slip : 0;
    if (field.cpp_type() == FieldDescriptor::CPPTYPE_MESSAGE) return std::min<size_t>(count, 12);
    // An update names each placement at most once.
    if (name == "placements") return std::min(count, in_.OneOf(16) ? count : size_t{1});
    return count;
  }

  double Near(Scatter& scatter) const { return scatter.Between(-5, 5); }

  double Double() {
    const size_t kind = in_.Below(16);
    if (tame_ || kind < 4) return kind < 13 ? in_.SmallInteger() : 0.1 * in_.SignedByte();
    constexpr double kOdd[] = {-0.0,
                               kTiny,
                               -kTiny,
                               0x1p-1022,
                               kLargest,
                               -kLargest,
                               std::numeric_limits<double>::max(),
                               0x1p511,
                               0x1.0000000000001p0,
                               0x1.fffffffffffffp-1};
    if (kind < 11) return kOdd[in_.Below(std::size(kOdd))];
    if (kind == 11) return std::numeric_limits<double>::infinity();
    if (kind == 12) return std::numeric_limits<double>::quiet_NaN();
    if (kind == 13) return in_.PowerOfTwo();
    return in_.Raw();
  }

  // Tame lengths are not negative.
  double Length(const FieldDescriptor& field) {
    const std::string& name = field.name();
    const double number = Double();
    const bool is_length = name == "tolerance" || name == "max_error" || name == "clearance" ||
                           name == "radius" || name == "radii" || name == "max_time_error" ||
                           name == "resolution";
    return is_length && tame_ ? std::abs(number) : number;
  }

  uint64_t Any() {
    constexpr uint64_t kOdd[] = {0,          1,          2,      0x7fffffff, 0x80000000,
                                 0xffffffff, 1ull << 32, 1000,   1001,       1ull << 63,
                                 ~0ull - 1,  ~0ull,      100001, 70000};
    return in_.OneOf(8) ? in_.Bits() : kOdd[in_.Below(std::size(kOdd))];
  }

  uint64_t Integer(const FieldDescriptor& field) {
    if (in_.OneOf(24)) return Any();
    const std::string& name = field.name();
    if (name == "sequence") return hints_.sequence;
    if (name == "if_revision") return in_.OneOf(4) ? in_.Below(40) : hints_.revision;
    if (name == "at_least_revision") return in_.OneOf(4) ? in_.Below(40) : hints_.revision;
    if (name == "movers") return in_.Below(placements_ + 2);
    if (name == "max_vertices") return in_.Below(20);
    return in_.Below(12);
  }

  // Mostly in range.
  uint32_t Index() {
    if (in_.OneOf(48)) return static_cast<uint32_t>(Any());
    return static_cast<uint32_t>(in_.Below(std::max<size_t>(placements_, 1)));
  }
  uint32_t Index(Scatter& scatter) const {
    return static_cast<uint32_t>(
        scatter.Between(0, std::max(static_cast<int>(placements_) - 1, 0)));
  }

  int Enum(const EnumDescriptor& type) {
    constexpr int kUnknown[] = {-1, 77, std::numeric_limits<int>::max(),
                                std::numeric_limits<int>::min()};
    if (in_.OneOf(24)) return kUnknown[in_.Below(std::size(kUnknown))];
    return type.value(static_cast<int>(in_.Below(static_cast<size_t>(type.value_count()))))
        ->number();
  }

  std::string String(const FieldDescriptor& field) {
    const std::string& name = field.name();
    if (name == "hull_id") return FuzzHullId(in_);
    // The ID may also be a hull's.
    if (name == "body_id" && !in_.OneOf(8)) return in_.OneOf(2) ? "body/a" : "body/b";
    if (name == "body_id") return FuzzHullId(in_);
    if (name == "prefix") {
      constexpr const char* kPrefixes[] = {"", "", "", "c", "cell-1", "cell-1/", "zz", "/"};
      return kPrefixes[in_.Below(std::size(kPrefixes))];
    }
    if (name == "store_id" && !in_.OneOf(8)) return hints_.store_id;
    if (name == "page_token") {
      constexpr const char* kTokens[] = {"", "", "", "", "", "AGN1YmU=", "AGN1YmU", "!", "AA=="};
      return kTokens[in_.Below(std::size(kTokens))];
    }
    static const std::string kTexts[] = {
        "w", "v", "", std::string(256, 'w'), std::string(257, 'w'), "-12345", "0", "\xe2\x82\xac"};
    return kTexts[in_.Below(std::size(kTexts))];
  }

  // Adds a field unknown to every API version.
  void AddUnknown(UnknownFieldSet* fields, int depth) {
    const int number = 1000 + static_cast<int>(in_.Below(7));
    switch (in_.Below(4)) {
      case 0:
        return fields->AddVarint(number, in_.Bits());
      case 1:
        return fields->AddFixed64(number, in_.Bits());
      case 2:
        return fields->AddLengthDelimited(number, std::string(in_.Byte(), '\xff'));
      default:
        if (depth < kMaxDepth) AddUnknown(fields->AddGroup(number), depth + 1);
    }
  }

  ByteReader& in_;
  const MessageHints hints_;
  // Counts of the current message: the placements in its table, and the placements that an update
  // moves.
  size_t placements_;
  size_t moved_ = 0;
  const bool tame_;
};

}  // namespace

void FillMessage(ByteReader& in, const MessageHints& hints, Message* message) {
  message->Clear();
  MessageFiller(in, hints).Fill(message, 0);
}

std::string FuzzHullId(ByteReader& in) {
  const std::vector<std::string>& ids = HullIds();
  // Half are among the first four.
  return in.OneOf(2) ? ids[in.Below(4)] : ids[in.Below(ids.size())];
}

}  // namespace hulld::fuzz
