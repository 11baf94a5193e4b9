#ifndef HULLD_TESTS_PROTO_CONTRACT_FILES_H_
#define HULLD_TESTS_PROTO_CONTRACT_FILES_H_

#include <google/protobuf/descriptor.h>

#include <vector>

namespace hulld {

// The files of the contract (proto/hulld/v1) with their comments, as protoc reads them.
class ContractFiles {
 public:
  // Fails the test and stays empty if the descriptors cannot be read.
  ContractFiles();

  // In alphabetical order by name.
  const std::vector<const google::protobuf::FileDescriptor*>& files() const { return files_; }

 private:
  google::protobuf::DescriptorPool pool_;
  std::vector<const google::protobuf::FileDescriptor*> files_;
};

// Return all messages and enums of a file, including nested ones, in pre-order.
std::vector<const google::protobuf::Descriptor*> MessagesOf(
    const google::protobuf::FileDescriptor& file);
std::vector<const google::protobuf::EnumDescriptor*> EnumsOf(
    const google::protobuf::FileDescriptor& file);

}  // namespace hulld

#endif  // HULLD_TESTS_PROTO_CONTRACT_FILES_H_
