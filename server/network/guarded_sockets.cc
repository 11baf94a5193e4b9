#include "server/network/guarded_sockets.h"

#include <dlfcn.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <memory>
#include <mutex>
#include <optional>
#include <string_view>
#include <utility>

#include "core/base/check.h"

namespace hulld::server {
namespace {

// Guard of the connection at one descriptor. Slots are never freed, because a read may be in flight
// when its connection ends.
struct Slot {
  // 0 if no connection is guarded; checked first, without the mutex.
  std::atomic<uint64_t> connection = 0;
  std::mutex mutex;
  // The mutex guards the members below.
  std::optional<FrameGuard> guard;
  std::function<void()> on_closed;

  // Requires the mutex.
  void Clear() {
    connection = 0;
    guard.reset();
    on_closed = nullptr;
  }
};

std::array<std::atomic<Slot*>, kMaxGuardedDescriptors> slots;
HalfOpenTotals half_open;
std::array<std::atomic<uint64_t>, FrameGuard::kVerdictCount> closed;

Slot* SlotOf(int descriptor) {
  if (descriptor < 0 || descriptor >= kMaxGuardedDescriptors) return nullptr;
  return slots[static_cast<size_t>(descriptor)].load(std::memory_order_acquire);
}

// Calls `take` with each part of the first `bytes` bytes of the message, until it returns false.
template <typename Take>
void ForEachPart(const msghdr& message, size_t bytes, const Take& take) {
  for (size_t i = 0; i < message.msg_iovlen && bytes > 0; ++i) {
    const iovec& part = message.msg_iov[i];
    const size_t size = std::min(bytes, part.iov_len);
    if (!take(std::string_view(static_cast<const char*>(part.iov_base), size))) return;
    bytes -= size;
  }
}

// Returns false if the connection must be closed.
bool Inspect(Slot& slot, const msghdr& message, size_t bytes) {
  const std::lock_guard lock(slot.mutex);
  if (!slot.guard.has_value()) return true;
  const auto now = FrameGuard::Clock::now();
  auto verdict = FrameGuard::Verdict::kAllowed;
  ForEachPart(message, bytes, [&](std::string_view part) {
    verdict = slot.guard->Take(part, now);
    return verdict == FrameGuard::Verdict::kAllowed;
  });
  if (verdict == FrameGuard::Verdict::kAllowed) return true;
  ++closed[static_cast<size_t>(verdict)];
  slot.guard.reset();
  return false;
}

void InspectSent(Slot& slot, const msghdr& message, size_t bytes) {
  const std::lock_guard lock(slot.mutex);
  if (!slot.guard.has_value()) return;
  ForEachPart(message, bytes, [&](std::string_view part) {
    slot.guard->TakeSent(part);
    return true;
  });
}

}  // namespace

void GuardSocket(int descriptor, uint64_t connection, const FrameLimits* limits,
                 std::function<void()> on_closed) {
  HULLD_CHECK(descriptor >= 0 && descriptor < kMaxGuardedDescriptors && connection != 0);
  std::atomic<Slot*>& place = slots[static_cast<size_t>(descriptor)];
  Slot* slot = place.load(std::memory_order_acquire);
  if (slot == nullptr) {
    auto made = std::make_unique<Slot>();
    if (place.compare_exchange_strong(slot, made.get())) slot = made.release();
  }
  const std::lock_guard lock(slot->mutex);
  slot->Clear();
  if (limits != nullptr) slot->guard.emplace(*limits, half_open, FrameGuard::Clock::now());
  slot->on_closed = std::move(on_closed);
  slot->connection = connection;
}

void ShutDown(int descriptor, uint64_t connection) {
  Slot* const slot = SlotOf(descriptor);
  if (slot == nullptr) return;
  const std::lock_guard lock(slot->mutex);
  if (slot->connection == connection) shutdown(descriptor, SHUT_RDWR);
}

void Unguard(int descriptor, uint64_t connection) {
  Slot* const slot = SlotOf(descriptor);
  if (slot == nullptr) return;
  const std::lock_guard lock(slot->mutex);
  if (slot->connection == connection) slot->Clear();
}

std::array<uint64_t, FrameGuard::kVerdictCount> ClosedByGuard() {
  std::array<uint64_t, FrameGuard::kVerdictCount> counts{};
  std::copy(closed.begin(), closed.end(), counts.begin());
  return counts;
}

size_t HalfOpenStreams() { return half_open.streams; }

}  // namespace hulld::server

// The functions below replace the C library's; guarded_sockets.h explains the reason. The C library
// names their parameters with reserved identifiers.
// NOLINTBEGIN(readability-inconsistent-declaration-parameter-name)

extern "C" ssize_t recvmsg(int descriptor, msghdr* message, int flags) {
  using Function = ssize_t (*)(int, msghdr*, int);
  static const auto kNext = reinterpret_cast<Function>(dlsym(RTLD_NEXT, "recvmsg"));
  const ssize_t bytes = kNext(descriptor, message, flags);
  if (bytes <= 0) return bytes;
  hulld::server::Slot* const slot = hulld::server::SlotOf(descriptor);
  if (slot == nullptr || slot->connection == 0) return bytes;
  if (hulld::server::Inspect(*slot, *message, static_cast<size_t>(bytes))) return bytes;
  shutdown(descriptor, SHUT_RDWR);
  errno = ECONNRESET;
  return -1;
}

extern "C" ssize_t sendmsg(int descriptor, const msghdr* message, int flags) {
  using Function = ssize_t (*)(int, const msghdr*, int);
  static const auto kNext = reinterpret_cast<Function>(dlsym(RTLD_NEXT, "sendmsg"));
  const ssize_t bytes = kNext(descriptor, message, flags);
  if (bytes <= 0) return bytes;
  const int error = errno;
  hulld::server::Slot* const slot = hulld::server::SlotOf(descriptor);
  if (slot != nullptr && slot->connection != 0) {
    hulld::server::InspectSent(*slot, *message, static_cast<size_t>(bytes));
  }
  errno = error;
  return bytes;
}

extern "C" int close(int descriptor) {
  using Function = int (*)(int);
  static const auto kNext = reinterpret_cast<Function>(dlsym(RTLD_NEXT, "close"));
  hulld::server::Slot* const slot = hulld::server::SlotOf(descriptor);
  if (slot == nullptr || slot->connection == 0) return kNext(descriptor);
  // Holds the mutex during the close, so that ShutDown never affects another socket that reuses the
  // number.
  const std::lock_guard lock(slot->mutex);
  const int result = kNext(descriptor);
  const int error = errno;
  const std::function<void()> on_closed = std::move(slot->on_closed);
  slot->Clear();
  if (on_closed) on_closed();
  errno = error;
  return result;
}

// NOLINTEND(readability-inconsistent-declaration-parameter-name)
