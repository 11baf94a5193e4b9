#ifndef HULLD_SERVER_PROCESS_THREAD_PRIORITY_H_
#define HULLD_SERVER_PROCESS_THREAD_PRIORITY_H_

namespace hulld::server {

// What the system is asked to do when more threads want to run than there are cores. Linux keeps
// both for a thread, not for the process, whatever POSIX says of niceness, and the threads that it
// starts inherit them. Where the system refuses, latency under load is all that suffers.

// Lets this thread take a core soon after it has something to do, for a short while: called by the
// first thread of the process, as gRPC starts threads of its own.
void PreferShortTurns();

// Lets other threads have the core of this one sooner and longer. niceness: added to that of the
// process.
void LowerPriority(int niceness);

}  // namespace hulld::server

#endif  // HULLD_SERVER_PROCESS_THREAD_PRIORITY_H_
