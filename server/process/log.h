#ifndef HULLD_SERVER_PROCESS_LOG_H_
#define HULLD_SERVER_PROCESS_LOG_H_

#include <spdlog/common.h>

#include <chrono>
#include <cstdint>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace hulld::server {

// Makes spdlog's default logger write to standard error, and gRPC and protobuf to that logger.
// level: debug, info, warn or error. format: text, or json for one JSON object per line with time
// (UTC, RFC 3339), level and message, and the fields of LogEvent.
void SetUpLog(const std::string& level, const std::string& format);

// Limits the number of log lines per period, because libraries log a line for each malformed
// message of a client. Thread-safe.
class LineBudget {
 public:
  using Clock = std::chrono::steady_clock;

  LineBudget(int lines, Clock::duration period) : lines_(lines), period_(period) {}

  // Returns nullopt if no line may be written at `now`. Otherwise returns the number of lines
  // suppressed since the last one.
  std::optional<uint64_t> Spend(Clock::time_point now);

 private:
  const int lines_;
  const Clock::duration period_;
  std::mutex mutex_;
  std::optional<Clock::time_point> begin_;
  int spent_ = 0;
  uint64_t suppressed_ = 0;
};

// Routes the logs of gRPC and protobuf to spdlog's default logger, each within a budget of
// kLibraryLines a minute. Applies to the whole process; call before any other thread logs.
inline constexpr int kLibraryLines = 20;
void RouteLibraryLogs();

using LogLevel = spdlog::level::level_enum;

// A field of a line, as in code=NOT_FOUND.
struct LogField {
  LogField(const char* field, std::string text) : name(field), value(std::move(text)) {}
  LogField(const char* field, uint64_t number)
      : name(field), value(std::to_string(number)), is_number(true) {}
  // number: milliseconds, printed to the microsecond.
  LogField(const char* field, double number);

  const char* name;
  std::string value;
  bool is_number = false;
};
using LogFields = std::vector<LogField>;

// Logs a message with fields: appended as " name=value", quoted if necessary, or as members of the
// JSON object.
void LogEvent(LogLevel level, const std::string& message, const LogFields& fields);

// Escapes `text` for a JSON string: escapes quotes, backslashes and control characters, and
// replaces invalid UTF-8 by U+FFFD.
std::string JsonEscape(const std::string& text);

}  // namespace hulld::server

#endif  // HULLD_SERVER_PROCESS_LOG_H_
