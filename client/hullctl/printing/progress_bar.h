#ifndef HULLD_CLIENT_HULLCTL_PRINTING_PROGRESS_BAR_H_
#define HULLD_CLIENT_HULLCTL_PRINTING_PROGRESS_BAR_H_

#include <chrono>
#include <cstdint>
#include <ostream>
#include <string>

namespace hulld {

// One line that is redrawn in place, at most ten times a second; nothing at all when not shown.
class ProgressBar {
 public:
  // `total` 0 means unknown: then only the amounts are shown.
  ProgressBar(std::ostream& out, bool shown, uint64_t total_bytes);
  ~ProgressBar() { Clear(); }

  void Update(uint64_t bytes, uint64_t points);
  // The same with a text of the caller's.
  void Show(const std::string& text);
  // Removes the line, so that other output can follow.
  void Clear();

 private:
  std::ostream& out_;
  bool shown_;
  bool drawn_ = false;
  uint64_t total_bytes_;
  std::chrono::steady_clock::time_point next_{};
};

// "[######----]  60 %  " for a share of 0 to 1.
std::string BarText(double share);

// "[######----]  60 %  1200 points", or "1200 points" when the total is unknown.
std::string ProgressText(uint64_t bytes, uint64_t total_bytes, uint64_t points);

}  // namespace hulld

#endif  // HULLD_CLIENT_HULLCTL_PRINTING_PROGRESS_BAR_H_
