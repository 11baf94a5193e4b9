#include "client/hullctl/command_line/deletion.h"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_join.h>
#include <unistd.h>

#include <algorithm>
#include <iostream>

#include "client/formats/text_number.h"

namespace hulld {
namespace {

std::string Naming(const std::vector<std::string>& ids) {
  constexpr size_t kNamed = 5;
  const auto end = ids.begin() + static_cast<ptrdiff_t>(std::min(ids.size(), kNamed));
  return absl::StrCat(absl::StrJoin(ids.begin(), end, ", "), ids.size() > kNamed ? ", ..." : "");
}

}  // namespace

absl::StatusOr<bool> ConfirmDeletion(const Invocation& run, const std::vector<std::string>& ids,
                                     const std::string& one, const std::string& many) {
  const bool is_terminal = isatty(STDIN_FILENO) != 0 && isatty(STDERR_FILENO) != 0;
  if (!is_terminal) {
    return absl::InvalidArgumentError(
        absl::StrCat("refusing to delete ", Counted(ids.size(), one, many), " (", Naming(ids),
                     ") without confirmation; pass --yes"));
  }
  run.err << "Delete " << Counted(ids.size(), one, many) << " (" << Naming(ids) << ")? [y/N] "
          << std::flush;
  std::string answer;
  std::getline(std::cin, answer);
  return answer == "y" || answer == "Y" || answer == "yes";
}

}  // namespace hulld
