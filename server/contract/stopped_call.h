#ifndef HULLD_SERVER_CONTRACT_STOPPED_CALL_H_
#define HULLD_SERVER_CONTRACT_STOPPED_CALL_H_

#include <absl/status/status.h>

#include <chrono>
#include <functional>

// Status of work that stopped early because should_stop reported that no caller is waiting for the
// answer.
namespace hulld::server {

// should_stop: may be empty.
inline bool Stopped(const std::function<bool()>& should_stop) {
  return should_stop && should_stop();
}

inline absl::Status Cancelled() { return absl::CancelledError("the call was cancelled"); }

// Interval at which a waiting thread polls should_stop. Not tuned.
constexpr std::chrono::milliseconds kStopPoll(20);

}  // namespace hulld::server

#endif  // HULLD_SERVER_CONTRACT_STOPPED_CALL_H_
