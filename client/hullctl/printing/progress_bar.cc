#include "client/hullctl/printing/progress_bar.h"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>

#include <algorithm>
#include <cmath>
#include <iterator>

namespace hulld {
namespace {

constexpr std::chrono::seconds kFirst(1);
constexpr std::chrono::milliseconds kStep(100);
// Minimum time, in seconds, before a rate is shown.
constexpr double kShortest = 0.1;

// Returns "950 points", "12.3k points", "4.6 MB".
std::string AmountText(double amount, const std::string& unit) {
  constexpr const char* kScales[] = {"", "k", "M", "G", "T"};
  size_t scale = 0;
  while (amount >= 9999.5 && scale + 1 < std::size(kScales)) {
    amount /= 1000;
    ++scale;
  }
  const std::string number =
      scale == 0 ? absl::StrFormat("%.0f", amount) : absl::StrFormat("%.1f", amount);
  if (unit == "B") return absl::StrCat(number, " ", kScales[scale], unit);
  return absl::StrCat(number, kScales[scale], " ", unit);
}

std::string TimeLeftText(double seconds) {
  const auto rounded = static_cast<uint64_t>(std::ceil(std::min(seconds, 1e9)));
  if (rounded < 120) return absl::StrCat(rounded, " s left");
  if (rounded < 7200) return absl::StrCat(rounded / 60, " min left");
  return absl::StrCat(rounded / 3600, " h left");
}

std::string BarText(double share) {
  constexpr size_t kWidth = 30;
  const auto filled = static_cast<size_t>(share * kWidth);
  return absl::StrFormat("[%s%s] %3d %%  ", std::string(filled, '#'),
                         std::string(kWidth - filled, '-'), static_cast<int>(share * 100));
}

}  // namespace

std::string ProgressText(const Progress& progress, double seconds) {
  std::string text;
  const auto done = static_cast<double>(progress.done);
  const auto total = static_cast<double>(progress.total);
  if (progress.total > 0) text = BarText(std::min(1.0, done / total));
  const auto count = static_cast<double>(progress.count);
  absl::StrAppend(&text, AmountText(count, progress.unit));
  if (seconds < kShortest) return text;
  absl::StrAppend(&text, "  ", AmountText(count / seconds, progress.unit), "/s");
  if (progress.total > 0 && progress.done > 0) {
    absl::StrAppend(&text, "  ", TimeLeftText(seconds * std::max(0.0, total - done) / done));
  }
  return text;
}

ProgressBar::ProgressBar(std::ostream& out, bool shown, const char* unit, uint64_t total)
    : out_(out),
      shown_(shown),
      progress_{0, total, 0, unit},
      start_(std::chrono::steady_clock::now()),
      next_(start_ + kFirst) {}

void ProgressBar::Update(uint64_t done, uint64_t count) {
  if (!shown_) return;
  const auto now = std::chrono::steady_clock::now();
  if (now < next_) return;
  next_ = now + kStep;
  drawn_ = true;
  progress_.done = done;
  progress_.count = count;
  const double seconds = std::chrono::duration<double>(now - start_).count();
  // CR, and "erase to the end of the line".
  out_ << "\r" << ProgressText(progress_, seconds) << "\x1b[K" << std::flush;
}

void ProgressBar::Clear() {
  if (!drawn_) return;
  drawn_ = false;
  out_ << "\r\x1b[K" << std::flush;
}

}  // namespace hulld
