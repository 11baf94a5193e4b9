#ifndef HULLD_CLIENT_HULLCTL_PRINTING_PROGRESS_BAR_H_
#define HULLD_CLIENT_HULLCTL_PRINTING_PROGRESS_BAR_H_

#include <chrono>
#include <cstdint>
#include <ostream>
#include <string>

namespace hulld {

// Progress of a task.
struct Progress {
  // Completed part of `total`; `total` is 0 if unknown.
  uint64_t done = 0;
  uint64_t total = 0;
  // The counted amount and its unit: "points", or "B" for bytes.
  uint64_t count = 0;
  const char* unit = "";
};

// Returns "[######----]  60 %  1200 points  400 points/s  2 s left"; without a total, no bar and no
// time left; in the first tenth of a second, no rate.
std::string ProgressText(const Progress& progress, double seconds);

// One line, redrawn in place at most ten times a second and not within the first second. Prints
// nothing if not shown.
class ProgressBar {
 public:
  // `total` 0 means unknown.
  ProgressBar(std::ostream& out, bool shown, const char* unit, uint64_t total);
  ~ProgressBar() { Clear(); }
  ProgressBar(const ProgressBar&) = delete;
  ProgressBar& operator=(const ProgressBar&) = delete;

  // Sets the completed part of the total, and the corresponding amount of the unit.
  void Update(uint64_t done, uint64_t count);
  // For a total in the displayed unit.
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
