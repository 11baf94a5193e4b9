#include "tests/server/schedules/scheduler.h"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <map>
#include <string_view>
#include <utility>

#include "core/base/check.h"

namespace hulld::server {
namespace {

Scheduler* current = nullptr;

// Idle fibers. Creating one costs a system call or two, so they are pooled.
std::vector<Fiber*>& IdleFibers() {
  static auto* const idle = new std::vector<Fiber*>;
  return *idle;
}

Fiber* TakeFiber() {
  std::vector<Fiber*>& idle = IdleFibers();
  if (idle.empty()) return new Fiber;
  Fiber* const fiber = idle.back();
  idle.pop_back();
  return fiber;
}

constexpr size_t kNobody = SIZE_MAX;
// Approximate number of steps of a schedule: the range of the priority changes.
constexpr uint32_t kUsualSteps = 800;
constexpr uint32_t kMaxChangePoints = 5;

std::string LineOf(const std::source_location& where) {
  const std::string_view file = where.file_name();
  return absl::StrCat(std::string(file.substr(file.rfind('/') + 1)), ":", where.line());
}

}  // namespace

std::vector<Scheduler::Step> Scheduler::spare_steps_;

Scheduler& Scheduler::Current() {
  HULLD_CHECK(current != nullptr);
  return *current;
}

Scheduler::Scheduler(uint64_t seed) : choices_(seed), random_(choices_.Next()) {
  by_priority_ = choices_.OneIn(2);
  if (by_priority_) {
    const uint32_t count = choices_.Below(kMaxChangePoints + 1);
    for (uint32_t i = 0; i < count; ++i) change_points_.push_back(choices_.Below(kUsualSteps));
    std::ranges::sort(change_points_, std::greater<>());
  } else {
    constexpr uint32_t kStickiness[] = {0, 8, 12, 15};
    stickiness_ = kStickiness[choices_.Below(4)];
  }
  constexpr uint32_t kRarities[] = {0, 0, 0, 200, 20};
  timeouts_ = kRarities[choices_.Below(5)];
  spurious_ = kRarities[choices_.Below(5)];
  steps_.swap(spare_steps_);
  steps_.reserve(1024);
  threads_.reserve(32);
}

Scheduler::~Scheduler() {
  for (const ThreadState& thread : threads_) {
    if (thread.status != Status::kDone) thread.fiber->Abandon();
  }
  if (current == this) current = nullptr;
  steps_.clear();
  spare_steps_.swap(steps_);
}

std::optional<ScheduleFault> Scheduler::Run(std::function<void()> body) {
  HULLD_CHECK(current == nullptr && threads_.empty());
  current = this;
  threads_.push_back({.fiber = TakeFiber(), .name = "test"});
  ready_.push_back(0);
  threads_.front().fiber->Start(std::move(body));
  next_ = 0;
  while (next_ != kNobody) {
    running_ = next_;
    if (threads_[running_].fiber->Resume()) {
      Fiber* const fiber = threads_[running_].fiber;
      SetStatus(running_, Status::kDone);
      Record("ends", nullptr, {});
      Unblock(fiber);
      IdleFibers().push_back(fiber);
      next_ = Choose();
    }
    if (fault_.has_value()) return fault_;
  }
  const bool all_ended = std::ranges::all_of(
      threads_, [](const ThreadState& thread) { return thread.status == Status::kDone; });
  current = nullptr;
  if (all_ended) return std::nullopt;
  return Stuck();
}

void Scheduler::Record(const char* what, const void* object, const Location& where) {
  steps_.push_back({static_cast<uint16_t>(running_), what, object, {}, where, false});
}

void Scheduler::Yield(const char* what, const void* object, const Location& where) {
  Record(what, object, where);
  GoOn();
}

void Scheduler::Note(const char* what, uint64_t first, uint64_t second, uint64_t third) {
  steps_.push_back(
      {static_cast<uint16_t>(running_), what, nullptr, {first, second, third}, {}, false});
  GoOn();
}

void Scheduler::Fail(std::string what) {
  fault_ = {ScheduleFault::Kind::kWrongAnswer, std::move(what)};
  while (true) Suspend();
}

void Scheduler::Suspend() { threads_[running_].fiber->Suspend(); }

// Switches to the thread whose turn is next, and returns when it is the turn of this thread.
void Scheduler::GoOn() {
  if (steps_.size() > kMaxSteps) {
    fault_ = {ScheduleFault::Kind::kLivelock,
              absl::StrCat("the schedule did not end within ", kMaxSteps, " steps")};
    while (true) Suspend();
  }
  ++now_;
  const size_t self = running_;
  next_ = Choose();
  if (next_ != self) Suspend();
}

// Returns kNobody if no thread can run.
size_t Scheduler::Choose() {
  if (timeouts_ > 0 || spurious_ > 0) MayWakeOne();
  if (ready_.empty()) return kNobody;
  if (by_priority_) {
    for (; !change_points_.empty() && steps_.size() > change_points_.back();
         change_points_.pop_back()) {
      threads_[running_].priority = --lowest_priority_;
    }
    return *std::ranges::max_element(ready_, {},
                                     [this](uint16_t i) { return threads_[i].priority; });
  }
  const bool stays = stickiness_ > 0 && threads_[running_].status == Status::kReady &&
                     choices_.Below(16) < stickiness_;
  return stays ? running_ : ready_[choices_.Below(static_cast<uint32_t>(ready_.size()))];
}

void Scheduler::SetStatus(size_t thread, Status status) {
  threads_[thread].status = status;
  const auto number = static_cast<uint16_t>(thread);
  const auto place = std::ranges::lower_bound(ready_, number);
  const bool is_listed = place != ready_.end() && *place == number;
  if (status == Status::kReady) {
    if (!is_listed) ready_.insert(place, number);
  } else if (is_listed) {
    ready_.erase(place);
  }
}

// Wakes a waiting thread by its time limit or spuriously. Only if other threads can run: a thread
// that depends on this lost a wakeup.
void Scheduler::MayWakeOne() {
  const bool by_time = choices_.OneIn(timeouts_);
  if (!by_time && !choices_.OneIn(spurious_)) return;
  if (ready_.empty()) return;
  waiting_.clear();
  for (size_t i = 0; i < threads_.size(); ++i) {
    const ThreadState& thread = threads_[i];
    if (thread.status != Status::kWaiting) continue;
    if (!by_time || thread.deadline != kNoDeadline) waiting_.push_back(static_cast<uint16_t>(i));
  }
  if (waiting_.empty()) return;
  const uint16_t woken = waiting_[choices_.Below(static_cast<uint32_t>(waiting_.size()))];
  ThreadState& thread = threads_[woken];
  SetStatus(woken, Status::kReady);
  thread.was_notified = !by_time;
  if (by_time) now_ = std::max(now_, thread.deadline);
  steps_.push_back({woken,
                    by_time ? "is woken by its time limit" : "is woken spuriously",
                    thread.object,
                    {},
                    thread.where,
                    true});
}

size_t Scheduler::StartThread(std::function<void()> task, const char* name, const Location& where) {
  const size_t thread = threads_.size();
  threads_.push_back({.fiber = TakeFiber(), .name = name, .started = where});
  ready_.push_back(static_cast<uint16_t>(thread));
  if (by_priority_) threads_.back().priority = 1 + choices_.Below(1U << 30);
  threads_.back().fiber->Start(std::move(task));
  Yield("starts a thread", nullptr, where);
  return thread;
}

void Scheduler::JoinThread(size_t thread) {
  while (threads_[thread].status != Status::kDone) {
    Block("waits for the end of a thread", threads_[thread].fiber, threads_[thread].started);
  }
}

void Scheduler::Block(const char* what, const void* object, const Location& where) {
  ThreadState& self = threads_[running_];
  SetStatus(running_, Status::kBlocked);
  self.what = what;
  self.object = object;
  self.where = where;
  Record(what, object, where);
  GoOn();
}

void Scheduler::Unblock(const void* object) {
  for (size_t i = 0; i < threads_.size(); ++i) {
    const ThreadState& thread = threads_[i];
    if (thread.status == Status::kBlocked && thread.object == object) SetStatus(i, Status::kReady);
  }
}

bool Scheduler::Wait(const void* object, int64_t deadline, const Condition& condition,
                     const Location& where) {
  const size_t self = running_;
  ThreadState& thread = threads_[self];
  SetStatus(self, Status::kWaiting);
  thread.what = "waits on a condition";
  thread.object = object;
  thread.deadline = deadline;
  thread.condition = condition;
  thread.where = where;
  thread.was_notified = false;
  Record(thread.what, object, where);
  GoOn();
  return threads_[self].was_notified;
}

void Scheduler::WaitUntil(const void* object, const Condition& condition, const Location& where) {
  while (!condition.holds(condition.context)) Wait(object, kNoDeadline, condition, where);
}

void Scheduler::Notify(const void* object, bool all, const Location& where) {
  Yield(all ? "notifies all" : "notifies one", object, where);
  waiting_.clear();
  for (size_t i = 0; i < threads_.size(); ++i) {
    const ThreadState& thread = threads_[i];
    if (thread.status == Status::kWaiting && thread.object == object) {
      waiting_.push_back(static_cast<uint16_t>(i));
    }
  }
  if (waiting_.empty()) return;
  const uint32_t chosen = choices_.Below(static_cast<uint32_t>(waiting_.size()));
  for (uint32_t i = 0; i < waiting_.size(); ++i) {
    if (!all && i != chosen) continue;
    ThreadState& thread = threads_[waiting_[i]];
    SetStatus(waiting_[i], Status::kReady);
    thread.was_notified = true;
    steps_.push_back({waiting_[i], "is woken", object, {}, thread.where, true});
  }
}

std::string Scheduler::NameOf(size_t thread) const {
  const ThreadState& state = threads_[thread];
  const std::string number = absl::StrCat("thread ", thread);
  if (state.name != nullptr) return absl::StrCat(number, " (", state.name, ")");
  return absl::StrCat(number, " (", LineOf(state.started), ")");
}

ScheduleFault Scheduler::Stuck() const {
  ScheduleFault fault{ScheduleFault::Kind::kDeadlock, "no thread can proceed:"};
  for (size_t i = 0; i < threads_.size(); ++i) {
    const ThreadState& thread = threads_[i];
    if (thread.status == Status::kDone) continue;
    absl::StrAppend(&fault.what, "\n  ", NameOf(i), " ", thread.what);
    if (thread.where.line() > 0) absl::StrAppend(&fault.what, ", ", LineOf(thread.where));
    if (thread.status != Status::kWaiting) continue;
    if (thread.condition.holds != nullptr && thread.condition.holds(thread.condition.context)) {
      absl::StrAppend(&fault.what, ": the condition is true, but no notification woke the thread");
      fault.kind = ScheduleFault::Kind::kLostWakeup;
    } else if (thread.deadline != kNoDeadline) {
      absl::StrAppend(&fault.what, ", for a limited time");
    }
  }
  return fault;
}

std::string Scheduler::Steps() const {
  std::string text;
  std::map<const void*, size_t> numbers;
  for (size_t i = 0; i < steps_.size(); ++i) {
    const Step& step = steps_[i];
    absl::StrAppend(&text, i, "  ", step.is_given ? "-- " : "", NameOf(step.thread), " ",
                    step.what);
    if (step.object != nullptr) {
      absl::StrAppend(&text, " #", numbers.emplace(step.object, numbers.size()).first->second);
    } else if (step.where.line() == 0 && step.numbers[0] + step.numbers[1] + step.numbers[2] > 0) {
      absl::StrAppend(&text, " ", step.numbers[0], " ", step.numbers[1], " ", step.numbers[2]);
    }
    if (step.where.line() > 0) absl::StrAppend(&text, ", ", LineOf(step.where));
    text += '\n';
  }
  return text;
}

// Excludes objects: freed addresses may or may not be reused.
uint64_t Scheduler::Digest() const {
  uint64_t digest = 0;
  const auto add = [&digest](uint64_t value) { digest = (digest ^ value) * 0x100000001B3; };
  for (const Step& step : steps_) {
    add(step.thread);
    add(std::hash<std::string_view>()(step.what));
    add(step.where.line());
    for (const uint64_t number : step.numbers) add(number);
  }
  return digest;
}

}  // namespace hulld::server
