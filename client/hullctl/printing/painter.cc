#include "client/hullctl/printing/painter.h"

#include <cstdlib>

namespace hulld {
namespace {

// The parameters of the escape sequences, in the order of Hue.
constexpr const char* kCodes[] = {"1", "32", "33", "31"};

}  // namespace

std::string Painter::operator()(Hue hue, const std::string& text) const {
  if (!on_) return text;
  return std::string("\x1b[") + kCodes[static_cast<size_t>(hue)] + "m" + text + "\x1b[0m";
}

bool WantsColor(const std::string& when, bool is_terminal) {
  if (when != "auto") return when == "always";
  const char* const no_color = std::getenv("NO_COLOR");
  const char* const terminal = std::getenv("TERM");
  const bool refused = no_color != nullptr && *no_color != '\0';
  const bool able = terminal != nullptr && std::string(terminal) != "dumb";
  return is_terminal && able && !refused;
}

size_t VisibleWidth(const std::string& text) {
  size_t width = 0;
  bool escaped = false;
  for (const char c : text) {
    if (c == '\x1b') escaped = true;
    if (!escaped) ++width;
    if (c == 'm') escaped = false;
  }
  return width;
}

}  // namespace hulld
