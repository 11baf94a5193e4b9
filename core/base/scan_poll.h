#ifndef HULLD_CORE_BASE_SCAN_POLL_H_
#define HULLD_CORE_BASE_SCAN_POLL_H_

#include <atomic>
#include <cstddef>
#include <functional>

namespace hulld {

// Polls a caller's should_stop within scans of many items. Short scans do not poll, so they have no
// overhead. Thread-safe if should_stop is.
class ScanPoll {
 public:
  static constexpr size_t kItemsPerPoll = 1024;

  // should_stop may be empty; it must outlive this object.
  explicit ScanPoll(const std::function<bool()>& should_stop)
      : should_stop_(should_stop ? &should_stop : nullptr) {}
  explicit ScanPoll(std::function<bool()>&&) = delete;
  ScanPoll(const ScanPoll&) = delete;
  ScanPoll& operator=(const ScanPoll&) = delete;

  // Returns true if the scan should end after this many items. Must be called for each item.
  bool StopsAfter(size_t items) {
    if (items % kItemsPerPoll != 0 || should_stop_ == nullptr) return false;
    if (!stopped() && (*should_stop_)()) stopped_.store(true, std::memory_order_relaxed);
    return stopped();
  }
  // True if a scan ended early; its result is then meaningless.
  bool stopped() const { return stopped_.load(std::memory_order_relaxed); }

 private:
  const std::function<bool()>* should_stop_;
  std::atomic<bool> stopped_ = false;
};

}  // namespace hulld

#endif  // HULLD_CORE_BASE_SCAN_POLL_H_
