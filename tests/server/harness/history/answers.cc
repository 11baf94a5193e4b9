#include "tests/server/harness/history/answers.h"

#include <chrono>

namespace hulld::server {
namespace {

constexpr std::chrono::seconds kDeadline(60);

}  // namespace

std::unique_ptr<grpc::ClientContext> NewContext() {
  auto context = std::make_unique<grpc::ClientContext>();
  context->set_deadline(std::chrono::system_clock::now() + kDeadline);
  return context;
}

void TakeVersion(const v1::HullVersion& version, const v1::ResponseHeader& header, Seen& seen) {
  seen.store_id = version.store_id();
  seen.store_revision = header.revision();
  seen.create_revision = version.create_revision();
  seen.revision = version.revision();
}

std::string MissingPiece(const std::string& said) {
  const std::string before = "hull \"";
  const size_t piece = said.find("\": piece ");
  if (piece == std::string::npos) return "";
  const size_t begin = said.find(before, piece) + before.size();
  return said.substr(begin, said.find('"', begin) - begin);
}

}  // namespace hulld::server
