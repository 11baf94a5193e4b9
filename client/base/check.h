#ifndef HULLD_CLIENT_BASE_CHECK_H_
#define HULLD_CLIENT_BASE_CHECK_H_

#include <cstdio>
#include <cstdlib>

namespace hulld {

// Writes "FILE:LINE: check failed: CONDITION" to the standard error and aborts.
[[noreturn]] inline void ClientCheckFailed(const char* file, int line,
                                           const char* condition) noexcept {
  std::fprintf(stderr, "%s:%d: check failed: %s\n", file, line, condition);
  std::abort();
}

}  // namespace hulld

// Aborts the process unless `condition` holds. A broken invariant is a defect of the client or of
// its caller, never bad input or a bad reply (these return a Status). Always enabled, so keep the
// condition cheap. Separate from core's check because the client includes nothing from core.
#define HULLD_CLIENT_CHECK(condition) \
  ((condition) ? (void)0 : ::hulld::ClientCheckFailed(__FILE__, __LINE__, #condition))

#endif  // HULLD_CLIENT_BASE_CHECK_H_
