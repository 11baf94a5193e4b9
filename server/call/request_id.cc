#include "server/call/request_id.h"

#include <absl/strings/ascii.h>
#include <absl/strings/str_cat.h>

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <string_view>

#include "server/process/random_id.h"

namespace hulld::server {
namespace {

constexpr size_t kMaxCharacters = 128;
// The random part has 64 bits.
constexpr size_t kRandomCharacters = 16;

}  // namespace

bool IsRequestId(const std::string& text) {
  if (text.empty() || text.size() > kMaxCharacters) return false;
  return std::all_of(text.begin(), text.end(), [](char c) {
    return absl::ascii_isalnum(static_cast<unsigned char>(c)) ||
           std::string_view("-_.:/+=").find(c) != std::string_view::npos;
  });
}

std::string NextRequestId() {
  static const std::string kProcess = RandomId().substr(0, kRandomCharacters);
  static std::atomic<uint64_t> last = 0;
  return absl::StrCat(kProcess, "-", last.fetch_add(1, std::memory_order_relaxed) + 1);
}

}  // namespace hulld::server
