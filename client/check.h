#ifndef HULLD_CLIENT_CHECK_H_
#define HULLD_CLIENT_CHECK_H_

#include <cstdio>
#include <cstdlib>

namespace hulld {

// Writes "FILE:LINE: check failed: CONDITION" to the standard error and aborts. Called by the macro
// below.
[[noreturn]] inline void ClientCheckFailed(const char* file, int line,
                                           const char* condition) noexcept {
  std::fprintf(stderr, "%s:%d: check failed: %s\n", file, line, condition);
  std::abort();
}

}  // namespace hulld

// Ends the process unless `condition` holds: a broken invariant is a defect of the client or of the
// program that uses it, never bad input or a bad reply (that is a Status). Always on, so keep the
// condition cheap. The client has its own check because it includes nothing of core.
#define HULLD_CLIENT_CHECK(condition) \
  ((condition) ? (void)0 : ::hulld::ClientCheckFailed(__FILE__, __LINE__, #condition))

#endif  // HULLD_CLIENT_CHECK_H_
