#include "tests/server/schedules/fiber.h"

#include <boost/context/protected_fixedsize_stack.hpp>
#include <memory>
#include <utility>

#include "core/base/check.h"

#ifdef __SANITIZE_ADDRESS__
#include <sanitizer/common_interface_defs.h>
#include <sanitizer/lsan_interface.h>
#endif

namespace hulld::server {
namespace {

#ifdef __SANITIZE_ADDRESS__
// Sanitized frames are several times larger.
constexpr size_t kStackBytes = size_t{1} << 20;

void BeginSwitch(void** own, const void* bottom, size_t size) {
  __sanitizer_start_switch_fiber(own, bottom, size);
}
void EndSwitch(void* own, const void** from_bottom, size_t* from_size) {
  __sanitizer_finish_switch_fiber(own, from_bottom, from_size);
}
// LeakSanitizer does not scan mapped memory unless registered.
void KeepReferences(const void* bottom, size_t size) { __lsan_register_root_region(bottom, size); }
#else
constexpr size_t kStackBytes = size_t{1} << 18;

void BeginSwitch(void**, const void*, size_t) {}
void EndSwitch(void*, const void**, size_t*) {}
void KeepReferences(const void*, size_t) {}
#endif

}  // namespace

Fiber::Fiber() {
  boost::context::protected_fixedsize_stack allocator(kStackBytes);
  boost::context::stack_context stack = allocator.allocate();
  size_ = stack.size;
  bottom_ = static_cast<const char*>(stack.sp) - stack.size;
  inside_ = boost::context::fiber(std::allocator_arg,
                                  boost::context::preallocated(stack.sp, stack.size, stack),
                                  allocator, [this](boost::context::fiber&& outside) {
                                    outside_ = std::move(outside);
                                    EndSwitch(nullptr, &outside_bottom_, &outside_size_);
                                    Run();
                                    return std::move(outside_);
                                  });
}

void Fiber::Start(std::function<void()> task) {
  HULLD_CHECK(has_ended_);
  task_ = std::move(task);
  has_ended_ = false;
}

bool Fiber::Resume() {
  void* own = nullptr;
  BeginSwitch(&own, bottom_, size_);
  inside_ = std::move(inside_).resume();
  EndSwitch(own, nullptr, nullptr);
  return has_ended_;
}

void Fiber::Suspend() {
  void* own = nullptr;
  BeginSwitch(&own, outside_bottom_, outside_size_);
  outside_ = std::move(outside_).resume();
  EndSwitch(own, &outside_bottom_, &outside_size_);
}

void Fiber::Abandon() {
  HULLD_CHECK(!has_ended_);
  KeepReferences(bottom_, size_);
  KeepReferences(this, sizeof(*this));
}

// Never returns: the stack is reused.
void Fiber::Run() {
  while (true) {
    task_();
    task_ = nullptr;
    has_ended_ = true;
    Suspend();
  }
}

}  // namespace hulld::server
