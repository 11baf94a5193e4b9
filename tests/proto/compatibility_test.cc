// Contract of v1 with its clients, line by line in v1.txt: messages, fields with number, type, and
// presence, enum values, RPCs, and numbers that must never be reused. Every recorded line must stay
// true; new lines may be added. After an addition, record it:
//
//   HULLD_RECORD_CONTRACT=1 build/release/bin/proto_test --gtest_filter='Compatibility.*'
//
// Recording fails while a recorded line is violated. Only a new version of the API (hulld.v2) may
// violate one.

#include <gmock/gmock.h>
#include <google/protobuf/descriptor.pb.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <set>
#include <string>
#include <vector>

#include "tests/proto/contract_files.h"
#include "tests/source_tree.h"

namespace hulld {
namespace compatibility_test {

using google::protobuf::Descriptor;
using google::protobuf::DescriptorProto;
using google::protobuf::EnumDescriptor;
using google::protobuf::EnumDescriptorProto;
using google::protobuf::FieldDescriptor;
using google::protobuf::FileDescriptor;
using google::protobuf::MethodDescriptor;
using google::protobuf::ServiceDescriptor;
using testing::IsEmpty;

using Lines = std::vector<std::string>;

std::filesystem::path Record() { return SourceTree() / "tests/proto/v1.txt"; }

std::string TypeOf(const FieldDescriptor& field) {
  if (field.message_type() != nullptr) return field.message_type()->full_name();
  if (field.enum_type() != nullptr) return field.enum_type()->full_name();
  return field.type_name();
}

std::string PresenceOf(const FieldDescriptor& field) {
  if (field.is_repeated()) return field.is_packed() ? "repeated packed " : "repeated ";
  if (field.real_containing_oneof() != nullptr) {
    return "oneof " + field.real_containing_oneof()->name() + " ";
  }
  return field.has_presence() && field.message_type() == nullptr ? "optional " : "";
}

// Both ends are inclusive.
std::string RangeText(int first, int last) {
  return first == last ? std::to_string(first)
                       : std::to_string(first) + " to " + std::to_string(last);
}

void Describe(const Descriptor& message, Lines* lines) {
  lines->push_back("message " + message.full_name());
  for (int i = 0; i < message.field_count(); ++i) {
    const FieldDescriptor& field = *message.field(i);
    lines->push_back("field " + field.full_name() + " = " + std::to_string(field.number()) + ": " +
                     PresenceOf(field) + TypeOf(field));
  }
  for (int i = 0; i < message.reserved_range_count(); ++i) {
    // The end is exclusive.
    const Descriptor::ReservedRange& range = *message.reserved_range(i);
    lines->push_back("reserved " + message.full_name() + ": " +
                     RangeText(range.start, range.end - 1));
  }
}

void Describe(const EnumDescriptor& type, Lines* lines) {
  lines->push_back("enum " + type.full_name());
  for (int i = 0; i < type.value_count(); ++i) {
    lines->push_back("value " + type.value(i)->full_name() + " = " +
                     std::to_string(type.value(i)->number()) + ": " + type.full_name());
  }
  for (int i = 0; i < type.reserved_range_count(); ++i) {
    // The end is inclusive.
    const EnumDescriptor::ReservedRange& range = *type.reserved_range(i);
    lines->push_back("reserved " + type.full_name() + ": " + RangeText(range.start, range.end));
  }
}

void Describe(const ServiceDescriptor& service, Lines* lines) {
  lines->push_back("service " + service.full_name());
  for (int i = 0; i < service.method_count(); ++i) {
    const MethodDescriptor& rpc = *service.method(i);
    lines->push_back("rpc " + rpc.full_name() + ": " + (rpc.client_streaming() ? "stream " : "") +
                     rpc.input_type()->full_name() + " -> " +
                     (rpc.server_streaming() ? "stream " : "") + rpc.output_type()->full_name());
  }
}

// Returns all properties that clients can rely on, in the order of the files.
Lines DescribeContract(const ContractFiles& contract) {
  Lines lines;
  for (const FileDescriptor* file : contract.files()) {
    for (int i = 0; i < file->service_count(); ++i) Describe(*file->service(i), &lines);
    for (const EnumDescriptor* type : EnumsOf(*file)) Describe(*type, &lines);
    for (const Descriptor* message : MessagesOf(*file)) Describe(*message, &lines);
  }
  return lines;
}

Lines ReadRecord() {
  Lines lines;
  std::ifstream file(Record());
  for (std::string line; std::getline(file, line);) lines.push_back(line);
  return lines;
}

// Returns the elements of `lines` that are not in `others`.
Lines Missing(const Lines& lines, const Lines& others) {
  const std::set<std::string> known(others.begin(), others.end());
  Lines missing;
  std::copy_if(lines.begin(), lines.end(), std::back_inserter(missing),
               [&known](const std::string& line) { return known.count(line) == 0; });
  return missing;
}

TEST(Compatibility, TheRecordedContractOfV1StillHolds) {
  const ContractFiles contract;
  ASSERT_GE(contract.files().size(), 6);
  const Lines now = DescribeContract(contract);
  const Lines recorded = ReadRecord();
  const Lines broken = Missing(recorded, now);
  EXPECT_THAT(broken, IsEmpty()) << "clients of v1 rely on these";
  if (std::getenv("HULLD_RECORD_CONTRACT") != nullptr && broken.empty()) {
    std::ofstream file(Record());
    for (const std::string& line : now) file << line << "\n";
    ASSERT_TRUE(file.good());
    return;
  }
  EXPECT_THAT(Missing(now, recorded), IsEmpty())
      << "unrecorded additions; record them as described at the top of compatibility_test.cc";
}

// Tests the check: each of these changes breaks a line, an addition breaks none.
TEST(Compatibility, IncompatibleChangesAreFoundAndAdditionsAreAccepted) {
  google::protobuf::FileDescriptorProto file;
  file.set_name("a.proto");
  file.set_syntax("proto3");
  DescriptorProto& message = *file.add_message_type();
  message.set_name("M");
  google::protobuf::FieldDescriptorProto& field = *message.add_field();
  field.set_name("f");
  field.set_number(1);
  field.set_type(google::protobuf::FieldDescriptorProto::TYPE_INT32);
  field.set_label(google::protobuf::FieldDescriptorProto::LABEL_OPTIONAL);
  EnumDescriptorProto& type = *file.add_enum_type();
  type.set_name("E");
  type.add_value()->set_name("E_UNSPECIFIED");
  type.mutable_value(0)->set_number(0);
  const auto describe = [](const google::protobuf::FileDescriptorProto& proto) {
    google::protobuf::DescriptorPool pool;
    const FileDescriptor* const built = pool.BuildFile(proto);
    Lines lines;
    Describe(*built->enum_type(0), &lines);
    Describe(*built->message_type(0), &lines);
    return lines;
  };
  const Lines before = describe(file);
  const auto broken_by = [&](const auto& change) {
    google::protobuf::FileDescriptorProto changed = file;
    change(changed);
    return Missing(before, describe(changed)).size();
  };
  using File = google::protobuf::FileDescriptorProto;
  const auto first_field = [](File& f) { return f.mutable_message_type(0)->mutable_field(0); };
  EXPECT_EQ(broken_by([&](File& f) { first_field(f)->set_number(2); }), 1);
  EXPECT_EQ(broken_by([&](File& f) { first_field(f)->set_name("g"); }), 1);
  EXPECT_EQ(broken_by([&](File& f) {
              first_field(f)->set_type(google::protobuf::FieldDescriptorProto::TYPE_INT64);
            }),
            1);
  EXPECT_EQ(broken_by([&](File& f) {
              first_field(f)->set_label(google::protobuf::FieldDescriptorProto::LABEL_REPEATED);
            }),
            1);
  EXPECT_EQ(broken_by([&](File& f) { f.mutable_message_type(0)->clear_field(); }), 1);
  EXPECT_EQ(broken_by([](File& f) { f.mutable_message_type(0)->set_name("N"); }), 2);
  EXPECT_EQ(broken_by([](File& f) {
              auto* const added = f.mutable_message_type(0)->add_field();
              *added = f.message_type(0).field(0);
              added->set_name("g");
              added->set_number(7);
            }),
            0);
}

}  // namespace compatibility_test
}  // namespace hulld
