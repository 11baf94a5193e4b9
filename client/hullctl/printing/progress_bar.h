#ifndef HULLD_CLIENT_HULLCTL_PRINTING_PROGRESS_BAR_H_
#define HULLD_CLIENT_HULLCTL_PRINTING_PROGRESS_BAR_H_

#include <chrono>
#include <cstdint>
#include <ostream>
#include <string>

namespace hulld {

// How far something is.
struct Progress {
  // How much of `total` is done; `total` is 0 when it is not known.
  uint64_t done = 0;
  uint64_t total = 0;
  // What is counted, and how much there is of it: "points", or "B" for bytes.
  uint64_t count = 0;
  const char* unit = "";
};

// "[######----]  60 %  1200 points  400 points/s  2 s left"; without a total no bar and no time
// left; before a tenth of a second no rate.
std::string ProgressText(const Progress& progress, double seconds);

// One line that is redrawn in place, at most ten times a second, and not within the first second;
// nothing at all when not shown.
class ProgressBar {
 public:
  // `total` 0 means unknown.
  ProgressBar(std::ostream& out, bool shown, const char* unit, uint64_t total);
  ~ProgressBar() { Clear(); }
  ProgressBar(const ProgressBar&) = delete;
  ProgressBar& operator=(const ProgressBar&) = delete;

  // `done` of the total, and how much of the unit that is.
  void Update(uint64_t done, uint64_t count);
  // For what is its own unit.
  void Update(uint64_t done) { Update(done, done); }
  // Removes the line, so that other output can follow.
  void Clear();

 private:
  std::ostream& out_;
  const bool shown_;
  bool drawn_ = false;
  Progress progress_;
  std::chrono::steady_clock::time_point start_;
  std::chrono::steady_clock::time_point next_;
};

}  // namespace hulld

#endif  // HULLD_CLIENT_HULLCTL_PRINTING_PROGRESS_BAR_H_
