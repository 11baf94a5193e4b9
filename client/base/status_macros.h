#ifndef HULLD_CLIENT_BASE_STATUS_MACROS_H_
#define HULLD_CLIENT_BASE_STATUS_MACROS_H_

#include <absl/status/status.h>

#include <utility>

// The macros of core/base/status_macros.h, which the client does not include.

// Returns from the function with the error of an expression of type absl::Status; continues if it
// is OK.
#define HULLD_RETURN_IF_ERROR(...) \
  if (absl::Status status_of_call = (__VA_ARGS__); !status_of_call.ok()) return status_of_call

// Returns from the function with the error of an expression of type absl::StatusOr; otherwise
// initializes `declaration`, or assigns to it, with the value.
#define HULLD_ASSIGN_OR_RETURN(declaration, ...) \
  HULLD_ASSIGN_OR_RETURN_VIA(HULLD_LINE_NAME(__LINE__), declaration, (__VA_ARGS__))
// NOLINTBEGIN(bugprone-macro-parentheses): parentheses around a declared name change its meaning.
#define HULLD_ASSIGN_OR_RETURN_VIA(result, declaration, expression) \
  auto result = expression;                                         \
  if (!result.ok()) return std::move(result).status();              \
  declaration = *std::move(result)
// NOLINTEND(bugprone-macro-parentheses)
#define HULLD_LINE_NAME(line) HULLD_LINE_NAME_OF(line)
#define HULLD_LINE_NAME_OF(line) result_of_line_##line

#endif  // HULLD_CLIENT_BASE_STATUS_MACROS_H_
