#ifndef HULLD_SERVER_PROCESS_SYNCHRONIZATION_H_
#define HULLD_SERVER_PROCESS_SYNCHRONIZATION_H_

#include <chrono>
#include <condition_variable>
#include <mutex>
#include <thread>

// What threads wait with, and by what clock: for the registry and what it runs on, and for all else
// whose interleavings are explored. tests/server/schedules/ compiles the same sources against a
// header of the same name, in which a seeded scheduler decides who goes on. So code that is
// explored uses these names, not those of the standard library.
namespace hulld::server {

using Mutex = std::mutex;
using ConditionVariable = std::condition_variable;
using Thread = std::thread;
using SteadyClock = std::chrono::steady_clock;

}  // namespace hulld::server

#endif  // HULLD_SERVER_PROCESS_SYNCHRONIZATION_H_
