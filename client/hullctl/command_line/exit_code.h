#ifndef HULLD_CLIENT_HULLCTL_COMMAND_LINE_EXIT_CODE_H_
#define HULLD_CLIENT_HULLCTL_COMMAND_LINE_EXIT_CODE_H_

namespace hulld {

// Exit codes. A collision is an answer, not an error.
enum class ExitCode {
  kDone = 0,
  // The server refused the request or failed; or an audit, a comparison, or a judgement found a
  // fault or a difference.
  kRequestFailed = 1,
  // The command line or an input file is invalid, or an output file cannot be written.
  kUsage = 2,
  // No answer: the server is unreachable, is draining, or did not answer in time.
  kUnreachable = 3,
  // Some items of a batch failed; the rest succeeded.
  kSomeFailed = 4,
  // A certificate does not prove its answer.
  kInvalidCertificate = 5,
  // A certificate could not be checked: its hulls have changed or were deleted, or the answer has
  // none.
  kCannotCheck = 6,
};

inline constexpr char kExitCodeHelp[] =
    "Exit codes:\n"
    "  0  done (a collision is an answer, not an error)\n"
    "  1  the server refused the request; or an audit, 'scene diff', or 'judge' found a fault or\n"
    "     a difference\n"
    "  2  the command line or an input file is invalid, or a file cannot be written\n"
    "  3  no answer: the server is unreachable, is draining, or exceeded --timeout\n"
    "  4  some items of a batch failed\n"
    "  5  a certificate does not prove its answer\n"
    "  6  a certificate cannot be checked: its hulls changed or were deleted, or the answer has\n"
    "     no certificate; if a file is not a record of an answer, the exit code is 2\n";

}  // namespace hulld

#endif  // HULLD_CLIENT_HULLCTL_COMMAND_LINE_EXIT_CODE_H_
