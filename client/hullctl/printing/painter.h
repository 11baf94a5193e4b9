#ifndef HULLD_CLIENT_HULLCTL_PRINTING_PAINTER_H_
#define HULLD_CLIENT_HULLCTL_PRINTING_PAINTER_H_

#include <string>

namespace hulld {

// Meaning of a color. The text always states it too.
enum class Hue { kHeading, kGood, kNotable, kBad };

// Colors words by terminal escape sequences; leaves them unchanged if disabled.
class Painter {
 public:
  Painter() = default;
  explicit Painter(bool on) : on_(on) {}

  std::string operator()(Hue hue, const std::string& text) const;

 private:
  bool on_ = false;
};

// Returns true if output is colored. `when` is "always", "never", or "auto": on a terminal that
// supports color, unless $NO_COLOR is set (https://no-color.org).
bool WantsColor(const std::string& when, bool is_terminal);

// Returns the number of columns of a text, without escape sequences.
size_t VisibleWidth(const std::string& text);

}  // namespace hulld

#endif  // HULLD_CLIENT_HULLCTL_PRINTING_PAINTER_H_
