#include "server/process/log.h"

#include <absl/time/time.h>
#include <google/protobuf/stubs/logging.h>
#include <grpc/support/log.h>
#include <spdlog/formatter.h>
#include <spdlog/sinks/stdout_sinks.h>
#include <spdlog/spdlog.h>

#include <chrono>
#include <cstdio>
#include <memory>
#include <utility>

namespace hulld::server {
namespace {

// Fields of the event that this thread is logging: spdlog's messages contain only text, and its
// sinks run on the thread of LogEvent.
thread_local const LogFields* current_fields = nullptr;
bool is_json = false;

std::string FormatJson(const LogFields& fields) {
  std::string text;
  for (const LogField& field : fields) {
    const char* const quote = field.is_number ? "" : "\"";
    text += std::string(",\"") + field.name + "\":" + quote + JsonEscape(field.value) + quote;
  }
  return text;
}

// Quotes a value unless it is one word.
std::string FormatText(const LogFields& fields) {
  std::string text;
  for (const LogField& field : fields) {
    const bool word =
        !field.value.empty() && field.value.find_first_of(" \"\\=\n\r\t") == std::string::npos;
    const std::string escaped = JsonEscape(field.value);
    text += std::string(" ") + field.name + "=" + (word ? escaped : "\"" + escaped + "\"");
  }
  return text;
}

class JsonFormatter : public spdlog::formatter {
 public:
  void format(const spdlog::details::log_msg& message, spdlog::memory_buf_t& out) override {
    const std::string time = absl::FormatTime("%Y-%m-%dT%H:%M:%E3SZ",
                                              absl::FromChrono(message.time), absl::UTCTimeZone());
    const auto level = spdlog::level::to_string_view(message.level);
    const std::string line =
        "{\"time\":\"" + time + "\",\"level\":\"" + std::string(level.data(), level.size()) +
        "\",\"message\":\"" +
        JsonEscape(std::string(message.payload.data(), message.payload.size())) + "\"" +
        (current_fields == nullptr ? "" : FormatJson(*current_fields)) + "}\n";
    out.append(line.data(), line.data() + line.size());
  }

  std::unique_ptr<spdlog::formatter> clone() const override {
    return std::make_unique<JsonFormatter>();
  }
};

// Both budgets live as long as the process because libraries also log during exit.
LineBudget& BudgetOf(const char* library) {
  static auto* const kGrpc = new LineBudget(kLibraryLines, std::chrono::minutes(1));
  static auto* const kProtobuf = new LineBudget(kLibraryLines, std::chrono::minutes(1));
  return library[0] == 'g' ? *kGrpc : *kProtobuf;
}

void LogForLibrary(const char* library, spdlog::level::level_enum level, const std::string& text) {
  if (!spdlog::should_log(level)) return;
  const std::optional<uint64_t> left_out = BudgetOf(library).Spend(LineBudget::Clock::now());
  if (!left_out.has_value()) return;
  if (*left_out == 0) return spdlog::log(level, "{}: {}", library, text);
  spdlog::log(level, "{}: {} ({} earlier lines omitted)", library, text, *left_out);
}

void LogForGrpc(gpr_log_func_args* arguments) {
  LogForLibrary(
      "grpc",
      arguments->severity == GPR_LOG_SEVERITY_ERROR ? spdlog::level::warn : spdlog::level::debug,
      arguments->message);
}

// Protobuf's errors are mostly caused by clients. After a fatal one it aborts the process itself.
void LogForProtobuf(google::protobuf::LogLevel level, const char* file, int line,
                    const std::string& message) {
  if (level == google::protobuf::LOGLEVEL_FATAL) {
    spdlog::critical("protobuf: {} ({}:{})", message, file, line);
    return;
  }
  LogForLibrary(
      "protobuf",
      level == google::protobuf::LOGLEVEL_INFO ? spdlog::level::debug : spdlog::level::warn,
      message);
}

// Returns the length of the UTF-8 character at text[at]; 0 if it is invalid.
size_t CharacterLength(const std::string& text, size_t at) {
  const auto byte = [&](size_t i) { return static_cast<unsigned char>(text[i]); };
  const unsigned char lead = byte(at);
  if (lead < 0x80) return 1;
  const size_t length = lead >= 0xF0 ? 4 : lead >= 0xE0 ? 3 : 2;
  if (lead < 0xC2 || lead > 0xF4 || at + length > text.size()) return 0;
  for (size_t i = 1; i < length; ++i) {
    if ((byte(at + i) & 0xC0) != 0x80) return 0;
  }
  const unsigned char second = byte(at + 1);
  const bool overlong = (lead == 0xE0 && second < 0xA0) || (lead == 0xF0 && second < 0x90);
  const bool surrogate = lead == 0xED && second >= 0xA0;
  const bool too_big = lead == 0xF4 && second >= 0x90;
  return overlong || surrogate || too_big ? 0 : length;
}

}  // namespace

std::string JsonEscape(const std::string& text) {
  std::string out;
  out.reserve(text.size());
  for (size_t i = 0; i < text.size();) {
    const size_t length = CharacterLength(text, i);
    const char c = text[i];
    if (length == 0) {
      out += "\\ufffd";
    } else if (c == '"' || c == '\\') {
      out += {'\\', c};
    } else if (static_cast<unsigned char>(c) < 0x20 || c == 0x7F) {
      char escape[8];
      std::snprintf(escape, sizeof escape, "\\u%04x", static_cast<unsigned>(c));
      out += escape;
    } else {
      out.append(text, i, length);
    }
    i += length == 0 ? 1 : length;
  }
  return out;
}

LogField::LogField(const char* field, double number) : name(field), is_number(true) {
  char text[32];
  std::snprintf(text, sizeof text, "%.3f", number);
  value = text;
}

std::optional<uint64_t> LineBudget::Spend(Clock::time_point now) {
  const std::lock_guard lock(mutex_);
  if (!begin_.has_value() || now - *begin_ >= stretch_) {
    begin_ = now;
    spent_ = 0;
  }
  if (spent_ == lines_) {
    ++left_out_;
    return std::nullopt;
  }
  ++spent_;
  return std::exchange(left_out_, 0);
}

void RouteLibraryLogs() {
  gpr_set_log_function(LogForGrpc);
  google::protobuf::SetLogHandler(LogForProtobuf);
}

void LogEvent(LogLevel level, const std::string& message, const LogFields& fields) {
  if (!is_json) return spdlog::log(level, "{}{}", message, FormatText(fields));
  current_fields = &fields;
  spdlog::log(level, "{}", message);
  current_fields = nullptr;
}

void SetUpLog(const std::string& level, const std::string& format) {
  auto logger =
      std::make_shared<spdlog::logger>("hulld", std::make_shared<spdlog::sinks::stderr_sink_mt>());
  is_json = format == "json";
  if (is_json) {
    logger->set_formatter(std::make_unique<JsonFormatter>());
  } else {
    logger->set_pattern("%Y-%m-%dT%H:%M:%S.%e%z %l %v");
  }
  logger->set_level(spdlog::level::from_str(level));
  logger->flush_on(spdlog::level::debug);
  spdlog::set_default_logger(std::move(logger));
  RouteLibraryLogs();
}

}  // namespace hulld::server
