#include "client/hullctl/printing/progress_bar.h"

#include <algorithm>

namespace hulld {

ProgressBar::ProgressBar(std::ostream& out, bool shown, uint64_t total_bytes)
    : out_(out), shown_(shown), total_bytes_(total_bytes) {}

void ProgressBar::Update(uint64_t bytes, uint64_t points) {
  if (shown_) Show(ProgressText(bytes, total_bytes_, points));
}

void ProgressBar::Show(const std::string& text) {
  if (!shown_) return;
  const auto now = std::chrono::steady_clock::now();
  if (now < next_) return;
  next_ = now + std::chrono::milliseconds(100);
  drawn_ = true;
  // CR, and "erase to the end of the line".
  out_ << "\r" << text << "\x1b[K" << std::flush;
}

void ProgressBar::Clear() {
  if (!drawn_) return;
  drawn_ = false;
  out_ << "\r\x1b[K" << std::flush;
}

std::string BarText(double share) {
  constexpr size_t kWidth = 30;
  const auto filled = static_cast<size_t>(share * kWidth);
  const std::string percent = std::to_string(static_cast<int>(share * 100));
  std::string text = "[";
  text.append(filled, '#').append(kWidth - filled, '-').append("] ");
  return text.append(3 - percent.size(), ' ').append(percent).append(" %  ");
}

std::string ProgressText(uint64_t bytes, uint64_t total_bytes, uint64_t points) {
  std::string text;
  if (total_bytes > 0) {
    text = BarText(std::min(1.0, static_cast<double>(bytes) / static_cast<double>(total_bytes)));
  }
  return text + std::to_string(points) + " points";
}

}  // namespace hulld
