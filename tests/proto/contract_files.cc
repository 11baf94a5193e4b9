#include "tests/proto/contract_files.h"

#include <google/protobuf/descriptor.pb.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <string>

namespace hulld {
namespace {

using google::protobuf::Descriptor;
using google::protobuf::EnumDescriptor;
using google::protobuf::FileDescriptor;

constexpr char kFolder[] = "hulld/v1/";

void AddMessages(const Descriptor* message, std::vector<const Descriptor*>* messages) {
  messages->push_back(message);
  for (int i = 0; i < message->nested_type_count(); ++i) {
    AddMessages(message->nested_type(i), messages);
  }
}

}  // namespace

ContractFiles::ContractFiles() {
  google::protobuf::FileDescriptorSet set;
  std::ifstream file(HULLD_CONTRACT_DESCRIPTORS, std::ios::binary);
  EXPECT_TRUE(set.ParseFromIstream(&file)) << HULLD_CONTRACT_DESCRIPTORS;
  // Each file follows its imports.
  for (const google::protobuf::FileDescriptorProto& proto : set.file()) {
    const FileDescriptor* const built = pool_.BuildFile(proto);
    EXPECT_NE(built, nullptr) << proto.name();
    if (built != nullptr && built->name().rfind(kFolder, 0) == 0) files_.push_back(built);
  }
  std::sort(files_.begin(), files_.end(),
            [](const FileDescriptor* a, const FileDescriptor* b) { return a->name() < b->name(); });
}

std::vector<const Descriptor*> MessagesOf(const FileDescriptor& file) {
  std::vector<const Descriptor*> messages;
  for (int i = 0; i < file.message_type_count(); ++i) {
    AddMessages(file.message_type(i), &messages);
  }
  return messages;
}

std::vector<const EnumDescriptor*> EnumsOf(const FileDescriptor& file) {
  std::vector<const EnumDescriptor*> enums;
  for (int i = 0; i < file.enum_type_count(); ++i) enums.push_back(file.enum_type(i));
  for (const Descriptor* message : MessagesOf(file)) {
    for (int i = 0; i < message->enum_type_count(); ++i) enums.push_back(message->enum_type(i));
  }
  return enums;
}

}  // namespace hulld
