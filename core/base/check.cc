#include "core/base/check.h"

#include <unistd.h>

#include <array>
#include <charconv>
#include <cstdlib>
#include <cstring>
#include <string_view>

namespace hulld {
namespace {

// Neither allocates nor locks, because the heap or a lock may be corrupt.
void WriteError(std::string_view text) {
  while (!text.empty()) {
    const ssize_t written = write(STDERR_FILENO, text.data(), text.size());
    if (written <= 0) return;
    text.remove_prefix(static_cast<size_t>(written));
  }
}

}  // namespace

void CheckFailed(const char* file, int line, const char* condition) noexcept {
  std::array<char, 16> digits;
  const char* end = std::to_chars(digits.data(), digits.data() + digits.size(), line).ptr;
  WriteError(file);
  WriteError(":");
  WriteError({digits.data(), static_cast<size_t>(end - digits.data())});
  WriteError(": check failed: ");
  WriteError(condition);
  WriteError("\n");
  std::abort();
}

}  // namespace hulld
