// Style of the contract: the rules of buf's category STANDARD, each under its name there, and a few
// of the project's own. Not checked, because the contract cannot break them: the PACKAGE_SAME_*
// rules about options (no file sets one) and PROTOVALIDATE (not used).

#include <gmock/gmock.h>
#include <google/protobuf/descriptor.pb.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <functional>
#include <regex>
#include <set>
#include <string>
#include <vector>

#include "tests/proto/contract_files.h"

namespace hulld {
namespace style_test {

using google::protobuf::Descriptor;
using google::protobuf::EnumDescriptor;
using google::protobuf::EnumValueDescriptor;
using google::protobuf::FieldDescriptor;
using google::protobuf::FileDescriptor;
using google::protobuf::MethodDescriptor;
using google::protobuf::ServiceDescriptor;

constexpr char kPackage[] = "hulld.v1";

bool Matches(const std::string& name, const char* pattern) {
  return std::regex_match(name, std::regex(pattern));
}
bool IsPascal(const std::string& name) { return Matches(name, "[A-Z][A-Za-z0-9]*"); }
bool IsLowerSnake(const std::string& name) { return Matches(name, "[a-z][a-z0-9]*(_[a-z0-9]+)*"); }
bool IsUpperSnake(const std::string& name) { return Matches(name, "[A-Z][A-Z0-9]*(_[A-Z0-9]+)*"); }

// "AxisKind" -> "AXIS_KIND".
std::string UpperSnake(const std::string& pascal) {
  std::string name;
  for (const char c : pascal) {
    if (!name.empty() && c >= 'A' && c <= 'Z') name += '_';
    name += static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
  }
  return name;
}

template <typename Element>
std::string CommentOf(const Element& element) {
  google::protobuf::SourceLocation location;
  return element.GetSourceLocation(&location) ? location.leading_comments : "";
}

class ContractStyle : public testing::Test {
 protected:
  void SetUp() override { ASSERT_GE(contract_.files().size(), 6); }

  void ForEachMessage(const std::function<void(const Descriptor&)>& check) const {
    for (const FileDescriptor* file : contract_.files()) {
      for (const Descriptor* message : MessagesOf(*file)) check(*message);
    }
  }
  void ForEachEnum(const std::function<void(const EnumDescriptor&)>& check) const {
    for (const FileDescriptor* file : contract_.files()) {
      for (const EnumDescriptor* type : EnumsOf(*file)) check(*type);
    }
  }
  void ForEachService(const std::function<void(const ServiceDescriptor&)>& check) const {
    for (const FileDescriptor* file : contract_.files()) {
      for (int i = 0; i < file->service_count(); ++i) check(*file->service(i));
    }
  }
  void ForEachRpc(const std::function<void(const MethodDescriptor&)>& check) const {
    ForEachService([&](const ServiceDescriptor& service) {
      for (int i = 0; i < service.method_count(); ++i) check(*service.method(i));
    });
  }

  const ContractFiles contract_;
};

// PACKAGE_DEFINED, PACKAGE_DIRECTORY_MATCH, PACKAGE_SAME_DIRECTORY, DIRECTORY_SAME_PACKAGE,
// PACKAGE_LOWER_SNAKE_CASE, PACKAGE_VERSION_SUFFIX, FILE_LOWER_SNAKE_CASE, SYNTAX_SPECIFIED.
TEST_F(ContractStyle, FilePathsMatchTheirPackages) {
  for (const FileDescriptor* file : contract_.files()) {
    const std::filesystem::path path(file->name());
    EXPECT_EQ(file->package(), kPackage) << file->name();
    EXPECT_EQ(path.parent_path(), "hulld/v1");
    EXPECT_TRUE(IsLowerSnake(path.stem().string())) << file->name();
    EXPECT_EQ(file->syntax(), FileDescriptor::SYNTAX_PROTO3) << file->name();
  }
}

// IMPORT_NO_PUBLIC, IMPORT_NO_WEAK, IMPORT_USED.
TEST_F(ContractStyle, ImportsAreUsedAndPlain) {
  for (const FileDescriptor* file : contract_.files()) {
    EXPECT_EQ(file->public_dependency_count(), 0) << file->name();
    EXPECT_EQ(file->weak_dependency_count(), 0) << file->name();
    std::set<const FileDescriptor*> used;
    for (const Descriptor* message : MessagesOf(*file)) {
      for (int i = 0; i < message->field_count(); ++i) {
        const FieldDescriptor& field = *message->field(i);
        if (field.message_type() != nullptr) used.insert(field.message_type()->file());
        if (field.enum_type() != nullptr) used.insert(field.enum_type()->file());
      }
    }
    for (int i = 0; i < file->dependency_count(); ++i) {
      EXPECT_EQ(used.count(file->dependency(i)), 1)
          << file->name() << " does not need " << file->dependency(i)->name();
    }
  }
}

// MESSAGE_PASCAL_CASE, FIELD_LOWER_SNAKE_CASE, ONEOF_LOWER_SNAKE_CASE.
TEST_F(ContractStyle, MessagesAndFieldsAreNamedAlike) {
  int fields = 0;
  ForEachMessage([&](const Descriptor& message) {
    EXPECT_TRUE(IsPascal(message.name())) << message.full_name();
    for (int i = 0; i < message.field_count(); ++i, ++fields) {
      EXPECT_TRUE(IsLowerSnake(message.field(i)->name())) << message.field(i)->full_name();
    }
    for (int i = 0; i < message.real_oneof_decl_count(); ++i) {
      EXPECT_TRUE(IsLowerSnake(message.oneof_decl(i)->name()));
    }
  });
  EXPECT_GT(fields, 150);
}

// ENUM_PASCAL_CASE, ENUM_VALUE_UPPER_SNAKE_CASE, ENUM_VALUE_PREFIX, ENUM_ZERO_VALUE_SUFFIX,
// ENUM_FIRST_VALUE_ZERO, ENUM_NO_ALLOW_ALIAS.
TEST_F(ContractStyle, EnumValuesCarryTheirEnumAndStartUnspecified) {
  int enums = 0;
  ForEachEnum([&](const EnumDescriptor& type) {
    ++enums;
    EXPECT_TRUE(IsPascal(type.name())) << type.full_name();
    EXPECT_FALSE(type.options().allow_alias()) << type.full_name();
    const std::string prefix = UpperSnake(type.name()) + "_";
    EXPECT_EQ(type.value(0)->number(), 0);
    EXPECT_EQ(type.value(0)->name(), prefix + "UNSPECIFIED");
    for (int i = 0; i < type.value_count(); ++i) {
      const std::string& name = type.value(i)->name();
      EXPECT_TRUE(IsUpperSnake(name)) << name;
      EXPECT_EQ(name.rfind(prefix, 0), 0) << name;
    }
  });
  EXPECT_GE(enums, 8);
}

// SERVICE_PASCAL_CASE, SERVICE_SUFFIX, RPC_PASCAL_CASE, RPC_REQUEST_STANDARD_NAME,
// RPC_RESPONSE_STANDARD_NAME, RPC_REQUEST_RESPONSE_UNIQUE.
TEST_F(ContractStyle, EachRpcHasItsOwnRequestAndResponse) {
  ForEachService([](const ServiceDescriptor& service) {
    EXPECT_TRUE(IsPascal(service.name()));
    EXPECT_TRUE(Matches(service.name(), ".+Service")) << service.name();
  });
  std::set<const Descriptor*> types;
  int rpcs = 0;
  ForEachRpc([&](const MethodDescriptor& rpc) {
    ++rpcs;
    EXPECT_TRUE(IsPascal(rpc.name()));
    EXPECT_EQ(rpc.input_type()->name(), rpc.name() + "Request");
    EXPECT_EQ(rpc.output_type()->name(), rpc.name() + "Response");
    EXPECT_TRUE(types.insert(rpc.input_type()).second) << rpc.full_name();
    EXPECT_TRUE(types.insert(rpc.output_type()).second) << rpc.full_name();
  });
  EXPECT_GE(rpcs, 13);
}

// Rules of buf's category COMMENTS: COMMENT_SERVICE and COMMENT_RPC.
TEST_F(ContractStyle, ServicesAndRpcsAreExplained) {
  ForEachService([](const ServiceDescriptor& service) {
    EXPECT_NE(CommentOf(service), "") << service.full_name();
  });
  ForEachRpc([](const MethodDescriptor& rpc) { EXPECT_NE(CommentOf(rpc), "") << rpc.full_name(); });
}

// The comment of a reason is its reference for clients, so it must state the code.
TEST_F(ContractStyle, EveryErrorReasonStatesItsCode) {
  const std::regex code(
      " (INVALID_ARGUMENT|NOT_FOUND|ALREADY_EXISTS|ABORTED|FAILED_PRECONDITION|"
      "DATA_LOSS|RESOURCE_EXHAUSTED|UNAVAILABLE|UNAUTHENTICATED|"
      "PERMISSION_DENIED)[:.][^]*");
  int reasons = 0;
  ForEachEnum([&](const EnumDescriptor& type) {
    if (type.name() != "ErrorReason") return;
    for (int i = 1; i < type.value_count(); ++i, ++reasons) {
      EXPECT_TRUE(std::regex_match(CommentOf(*type.value(i)), code)) << type.value(i)->name();
    }
  });
  EXPECT_GE(reasons, 15);
}

}  // namespace style_test
}  // namespace hulld
