#include "client/hullctl/help/suggestion.h"

#include <absl/strings/ascii.h>
#include <absl/strings/str_cat.h>

#include <algorithm>
#include <cstddef>

namespace hulld {
namespace {

// Returns the minimum number of insertions, deletions, replacements, and swaps of adjacent letters
// that turn a into b.
size_t EditDistance(const std::string& a, const std::string& b) {
  // distance[i][j]: the distance between the first i letters of a and the first j of b.
  std::vector<std::vector<size_t>> distance(a.size() + 1, std::vector<size_t>(b.size() + 1));
  for (size_t i = 0; i <= a.size(); ++i) distance[i][0] = i;
  for (size_t j = 0; j <= b.size(); ++j) distance[0][j] = j;
  for (size_t i = 1; i <= a.size(); ++i) {
    for (size_t j = 1; j <= b.size(); ++j) {
      const size_t replaced = distance[i - 1][j - 1] + (a[i - 1] == b[j - 1] ? 0 : 1);
      distance[i][j] = std::min({distance[i - 1][j] + 1, distance[i][j - 1] + 1, replaced});
      const bool exchanged = i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1];
      if (exchanged) distance[i][j] = std::min(distance[i][j], distance[i - 2][j - 2] + 1);
    }
  }
  return distance[a.size()][b.size()];
}

// Empty if no word is close.
std::string Nearest(const std::string& word, const std::vector<std::string>& known) {
  const std::string letters = absl::AsciiStrToLower(word);
  const size_t first = letters.find_first_not_of('-');
  const bool is_prefix = first != std::string::npos && first + 1 < letters.size();
  for (const std::string& candidate : known) {
    const std::string start = absl::AsciiStrToLower(candidate.substr(0, letters.size()));
    if (is_prefix && start == letters) return candidate;
  }
  std::string nearest;
  size_t least = std::max<size_t>(1, letters.size() / 3) + 1;
  for (const std::string& candidate : known) {
    const size_t distance = EditDistance(letters, absl::AsciiStrToLower(candidate));
    if (distance >= least) continue;
    least = distance;
    nearest = candidate;
  }
  return nearest;
}

}  // namespace

std::string Suggestion(const std::string& word, const std::vector<std::string>& known) {
  const std::string nearest = Nearest(word, known);
  return nearest.empty() ? "" : absl::StrCat("; did you mean \"", nearest, "\"?");
}

}  // namespace hulld
