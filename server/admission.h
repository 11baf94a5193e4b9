#ifndef HULLD_SERVER_ADMISSION_H_
#define HULLD_SERVER_ADMISSION_H_

#include <absl/status/statusor.h>

#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <memory>
#include <mutex>

namespace hulld::server {

class Authenticator;

// Lets calls in, until the server drains, and counts those that run.
class Admission {
 public:
  // Who tells who calls; set before the first call, and outlives this. Without one everyone may do
  // everything.
  void SetAuthenticator(const Authenticator& authenticator) { authenticator_ = &authenticator; }
  const Authenticator* authenticator() const { return authenticator_; }

  // One running call; it ends with its ticket.
  using Ticket = std::unique_ptr<Admission, void (*)(Admission*)>;

  // UNAVAILABLE once the server drains.
  absl::StatusOr<Ticket> Admit();

  void BeginDrain();

  // Waits until no call runs; false when some still run at `deadline`.
  bool WaitIdle(std::chrono::steady_clock::time_point deadline);

 private:
  void Leave();

  const Authenticator* authenticator_ = nullptr;

  std::mutex mutex_;
  std::condition_variable idle_;
  bool draining_ = false;
  size_t running_ = 0;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_ADMISSION_H_
