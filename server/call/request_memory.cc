#include "server/call/request_memory.h"

#include <absl/strings/str_cat.h>

#include <chrono>

#include "server/contract/errors.h"

namespace hulld::server {
namespace {

constexpr char kFlag[] = "request-memory";
// A large request takes about as long as a batch.
constexpr std::chrono::milliseconds kRetry(1000);

}  // namespace

absl::Status RequestMemory::Take(uint64_t bytes, Share& share) {
  share.Release();
  if (bytes > limit_bytes_) {
    return LimitExceeded(absl::StrCat("the message would take more than ", limit_bytes_,
                                      " bytes of memory; split it into smaller messages"),
                         limit_bytes_, kFlag);
  }
  const uint64_t taken = taken_.fetch_add(bytes, std::memory_order_relaxed) + bytes;
  if (taken > limit_bytes_) {
    taken_.fetch_sub(bytes, std::memory_order_relaxed);
    return Overloaded("requests in flight use all request memory", limit_bytes_, kFlag, kRetry);
  }
  share.memory_ = this;
  share.bytes_ = bytes;
  return absl::OkStatus();
}

}  // namespace hulld::server
