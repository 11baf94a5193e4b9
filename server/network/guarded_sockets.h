#ifndef HULLD_SERVER_NETWORK_GUARDED_SOCKETS_H_
#define HULLD_SERVER_NETWORK_GUARDED_SOCKETS_H_

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>

#include "server/network/frame_guard.h"

namespace hulld::server {

// Passes the bytes that gRPC reads from a socket to a FrameGuard before gRPC sees them, and the
// bytes that it has written, and reports when gRPC closes the socket. gRPC has no hook for any of
// these, and an intermediate process or socket costs two copies and two wake-ups per message.
// Therefore guarded_sockets.cc defines recvmsg, sendmsg, and close, which the dynamic linker
// prefers to the C library's, as for a preloaded library. Only gRPC uses recvmsg and sendmsg in
// this process. A connection that exceeds the limits reads as reset by its peer.
//
// All functions are thread-safe.

// Descriptors from this number on cannot be guarded.
inline constexpr int kMaxGuardedDescriptors = 1 << 20;

// Guards the socket `descriptor` until it is closed or Unguard. limits: null for encrypted bytes,
// which are not inspected. on_closed: called once, right after the close, on the closing thread;
// it may not call the functions below. Requires: no thread reads from the socket yet, and 0 <=
// descriptor < kMaxGuardedDescriptors. connection: unique, not 0.
void GuardSocket(int descriptor, uint64_t connection, const FrameLimits* limits,
                 std::function<void()> on_closed);

// Shuts down both directions of the connection, so that gRPC closes its socket. No effect if the
// socket is closed.
void ShutDown(int descriptor, uint64_t connection);

// Removes the guard of the connection, if its socket is still open. on_closed is not called
// afterwards.
void Unguard(int descriptor, uint64_t connection);

// Returns the number of closed connections by verdict.
std::array<uint64_t, FrameGuard::kVerdictCount> ClosedByGuard();

// Returns the number of half-open streams of all guarded connections.
size_t HalfOpenStreams();

}  // namespace hulld::server

#endif  // HULLD_SERVER_NETWORK_GUARDED_SOCKETS_H_
