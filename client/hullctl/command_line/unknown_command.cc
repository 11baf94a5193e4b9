#include "client/hullctl/command_line/unknown_command.h"

#include <algorithm>
#include <cstddef>

namespace hulld {
namespace {

// The number of letters to insert, delete, replace or exchange with their neighbours that makes b
// of a.
size_t EditDistance(const std::string& a, const std::string& b) {
  // distance[i][j]: of the first i letters of a and the first j of b.
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

// Empty when none is near.
std::string NearestCommand(const std::string& word, const std::vector<std::string>& commands) {
  for (const std::string& command : commands) {
    if (word.size() > 1 && command.rfind(word, 0) == 0) return command;
  }
  std::string nearest;
  size_t least = std::max<size_t>(1, word.size() / 3) + 1;
  for (const std::string& command : commands) {
    const size_t distance = EditDistance(word, command);
    if (distance >= least) continue;
    least = distance;
    nearest = command;
  }
  return nearest;
}

}  // namespace

std::string ExplainUnknownCommand(const std::string& word,
                                  const std::vector<std::string>& commands) {
  const std::string nearest = NearestCommand(word, commands);
  std::string text = "Unknown command \"" + word + "\".";
  if (!nearest.empty()) text += " Did you mean \"" + nearest + "\"?";
  return text;
}

}  // namespace hulld
