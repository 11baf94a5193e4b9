#ifndef HULLD_CLIENT_HULLCTL_PRINTING_PAINTER_H_
#define HULLD_CLIENT_HULLCTL_PRINTING_PAINTER_H_

#include <string>

namespace hulld {

// What a colour says. A word always says it too.
enum class Hue { kHeading, kGood, kNotable, kBad };

// Puts colours round words, in terminals' escape sequences; leaves them alone unless it is on.
class Painter {
 public:
  Painter() = default;
  explicit Painter(bool on) : on_(on) {}

  std::string operator()(Hue hue, const std::string& text) const;

 private:
  bool on_ = false;
};

// Whether to paint: `when` is "always", "never" or "auto", which means on a terminal that can do
// it, unless $NO_COLOR is set (https://no-color.org).
bool WantsColour(const std::string& when, bool is_terminal);

// The number of columns that a text takes: escape sequences take none.
size_t VisibleWidth(const std::string& text);

}  // namespace hulld

#endif  // HULLD_CLIENT_HULLCTL_PRINTING_PAINTER_H_
