#ifndef HULLD_CORE_BASE_CHECK_H_
#define HULLD_CORE_BASE_CHECK_H_

namespace hulld {

// Writes "FILE:LINE: check failed: CONDITION" to the standard error and aborts. Called by the
// macros below.
[[noreturn]] void CheckFailed(const char* file, int line, const char* condition) noexcept;

}  // namespace hulld

// Aborts the process unless `condition` holds. A broken invariant is a defect of the program, never
// bad input (which yields a Status). Always enabled, so keep the condition cheap: a comparison or
// two.
#define HULLD_CHECK(condition) \
  ((condition) ? (void)0 : ::hulld::CheckFailed(__FILE__, __LINE__, #condition))

// HULLD_CHECK for expensive conditions, enabled only in builds without NDEBUG (the presets dev,
// asan-ubsan, tsan, and fuzz). In other builds, the condition is compiled but never evaluated.
#ifdef NDEBUG
#define HULLD_DCHECK(condition) (true ? (void)0 : (void)(condition))
#else
#define HULLD_DCHECK(condition) HULLD_CHECK(condition)
#endif

// Marks code that no path of a correct program reaches, for example after a switch over all values
// of an enum.
#define HULLD_UNREACHABLE() ::hulld::CheckFailed(__FILE__, __LINE__, "unreachable")

#endif  // HULLD_CORE_BASE_CHECK_H_
