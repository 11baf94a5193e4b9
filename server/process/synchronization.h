#ifndef HULLD_SERVER_PROCESS_SYNCHRONIZATION_H_
#define HULLD_SERVER_PROCESS_SYNCHRONIZATION_H_

#include <chrono>
#include <condition_variable>
#include <mutex>
#include <thread>

// Synchronization primitives and clock of the registry, and of all other code with explored
// interleavings. tests/server/schedules/ compiles the same sources against a header of the same
// name, in which a seeded scheduler decides which thread runs. Explored code must use these names
// instead of the standard library's.
namespace hulld::server {

using Mutex = std::mutex;
using ConditionVariable = std::condition_variable;
using Thread = std::thread;
using SteadyClock = std::chrono::steady_clock;

}  // namespace hulld::server

#endif  // HULLD_SERVER_PROCESS_SYNCHRONIZATION_H_
