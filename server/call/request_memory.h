#ifndef HULLD_SERVER_CALL_REQUEST_MEMORY_H_
#define HULLD_SERVER_CALL_REQUEST_MEMORY_H_

#include <absl/status/status.h>

#include <atomic>
#include <cstdint>
#include <utility>

namespace hulld::server {

// The memory of all requests that were parsed and are not answered yet, held to one limit
// (--request-memory): what many callers send at once cannot fill the machine. Thread-safe.
class RequestMemory {
 public:
  // What one request takes; given back when it goes. The RequestMemory must outlive it. Not
  // thread-safe.
  class Share {
   public:
    Share() = default;
    Share(Share&& other) noexcept
        : memory_(std::exchange(other.memory_, nullptr)), bytes_(std::exchange(other.bytes_, 0)) {}
    Share& operator=(Share&& other) noexcept {
      std::swap(memory_, other.memory_);
      std::swap(bytes_, other.bytes_);
      return *this;
    }
    ~Share() { GiveBack(); }

    void GiveBack() {
      if (memory_ != nullptr) memory_->taken_.fetch_sub(bytes_, std::memory_order_relaxed);
      memory_ = nullptr;
      bytes_ = 0;
    }
    uint64_t bytes() const { return bytes_; }

   private:
    friend class RequestMemory;
    RequestMemory* memory_ = nullptr;
    uint64_t bytes_ = 0;
  };

  explicit RequestMemory(uint64_t limit_bytes) : limit_bytes_(limit_bytes) {}
  RequestMemory(const RequestMemory&) = delete;
  RequestMemory& operator=(const RequestMemory&) = delete;

  // Takes this many bytes into `share`, in place of what it held. RESOURCE_EXHAUSTED: a single
  // request of this size is beyond the limit; with a time to retry: the others leave no room.
  absl::Status Take(uint64_t bytes, Share& share);

  uint64_t limit_bytes() const { return limit_bytes_; }
  uint64_t taken_bytes() const { return taken_.load(std::memory_order_relaxed); }

 private:
  const uint64_t limit_bytes_;
  std::atomic<uint64_t> taken_ = 0;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_CALL_REQUEST_MEMORY_H_
