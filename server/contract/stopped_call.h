#ifndef HULLD_SERVER_CONTRACT_STOPPED_CALL_H_
#define HULLD_SERVER_CONTRACT_STOPPED_CALL_H_

#include <absl/status/status.h>

#include <chrono>
#include <functional>

// Work that ends early once should_stop says that nobody waits for its answer any more.
namespace hulld::server {

// should_stop: may be empty.
inline bool Stopped(const std::function<bool()>& should_stop) {
  return should_stop && should_stop();
}

inline absl::Status Cancelled() { return absl::CancelledError("the call was cancelled"); }

// How soon a thread that waits for others notices that it is to stop; a choice.
constexpr std::chrono::milliseconds kStopPoll(20);

}  // namespace hulld::server

#endif  // HULLD_SERVER_CONTRACT_STOPPED_CALL_H_
