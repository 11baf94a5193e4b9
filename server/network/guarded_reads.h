#ifndef HULLD_SERVER_NETWORK_GUARDED_READS_H_
#define HULLD_SERVER_NETWORK_GUARDED_READS_H_

#include <array>
#include <cstddef>
#include <cstdint>

#include "server/network/frame_guard.h"

namespace hulld::server {

// Passes the bytes that gRPC reads from a socket to a FrameGuard before gRPC sees them. gRPC has no
// hook between a socket and its HTTP/2 parser, and an intermediate process or socket costs two
// copies and two wake-ups per message. Therefore guarded_reads.cc defines recvmsg, which the
// dynamic linker prefers to the C library's, as for a preloaded library. Only gRPC reads with
// recvmsg in this process. A connection that exceeds the limits reads as reset by its peer.
//
// All functions are thread-safe.

// Descriptors from this number on cannot be guarded.
inline constexpr int kMostGuardedDescriptors = 1 << 20;

// Guards the socket `descriptor` from its first byte until Unguard. Requires: no thread reads from
// it yet, and 0 <= descriptor < kMostGuardedDescriptors. connection: unique, not 0.
void GuardReads(int descriptor, uint64_t connection, const FrameLimits& limits);

// Removes the guard of the connection, if the descriptor still belongs to it.
void Unguard(int descriptor, uint64_t connection);

// Returns the number of closed connections by verdict.
std::array<uint64_t, FrameGuard::kVerdictCount> ClosedByGuard();

// Returns the number of half-open streams of all guarded connections.
size_t HalfOpenStreams();

}  // namespace hulld::server

#endif  // HULLD_SERVER_NETWORK_GUARDED_READS_H_
