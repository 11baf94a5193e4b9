#ifndef HULLD_SERVER_REGISTRY_LOCKED_H_
#define HULLD_SERVER_REGISTRY_LOCKED_H_

#include <functional>
#include <memory>
#include <mutex>
#include <utility>
#include <vector>

#include "core/base/check.h"

namespace hulld::server {

// A mutex that is held, and the work that is due once it is not: callbacks, which may call back,
// and the end of large objects. A function that takes a Locked requires the mutex; its type is the
// check. Not thread-safe.
class Locked {
 public:
  explicit Locked(std::mutex& mutex) : lock_(mutex) {}
  Locked(const Locked&) = delete;
  Locked& operator=(const Locked&) = delete;
  ~Locked() {
    if (lock_.owns_lock()) Unlock();
  }

  // Whether it is this mutex that is held.
  bool Holds(const std::mutex& mutex) const { return lock_.owns_lock() && lock_.mutex() == &mutex; }

  // Lets go of the mutex, and does what is due, in the order in which it was given.
  void Unlock() {
    HULLD_CHECK(lock_.owns_lock());
    const std::vector<std::function<void()>> due = std::exchange(afterwards_, {});
    lock_.unlock();
    for (const std::function<void()>& task : due) task();
  }
  void Lock() {
    HULLD_CHECK(!lock_.owns_lock());
    lock_.lock();
  }
  // For condition variables, which let go of the mutex while they wait.
  std::unique_lock<std::mutex>& lock() { return lock_; }

  void Afterwards(std::function<void()> task) { afterwards_.push_back(std::move(task)); }
  template <typename T>
  void Discard(std::unique_ptr<T> object) {
    if (object != nullptr) Discard(std::shared_ptr<T>(std::move(object)));
  }
  template <typename T>
  void Discard(std::shared_ptr<T> object) {
    if (object != nullptr) afterwards_.push_back([kept = std::move(object)] {});
  }

 private:
  std::unique_lock<std::mutex> lock_;
  std::vector<std::function<void()>> afterwards_;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_REGISTRY_LOCKED_H_
