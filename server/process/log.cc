#include "server/process/log.h"

#include <absl/strings/ascii.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>
#include <absl/time/time.h>
#include <google/protobuf/stubs/common.h>
#include <google/protobuf/stubs/logging.h>
#include <grpc/support/log.h>
#include <spdlog/formatter.h>
#include <spdlog/pattern_formatter.h>
#include <spdlog/sinks/stdout_sinks.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <chrono>
#include <memory>
#include <string_view>
#include <utility>

namespace hulld::server {
namespace {

// Fields of the event that this thread is logging: spdlog's messages contain only text, and its
// sinks run on the thread of LogEvent.
thread_local const LogFields* current_fields = nullptr;
bool is_json = false;

// Escapes control characters and, on request, quotes and backslashes; replaces invalid UTF-8.
std::string Escape(const std::string& text, bool quotes) {
  std::string out;
  out.reserve(text.size());
  for (std::string_view rest = text; !rest.empty();) {
    const auto valid = static_cast<size_t>(
        google::protobuf::internal::UTF8SpnStructurallyValid({rest.data(), rest.size()}));
    for (const char c : rest.substr(0, valid)) {
      if (quotes && (c == '"' || c == '\\')) {
        out += {'\\', c};
      } else if (absl::ascii_iscntrl(static_cast<unsigned char>(c))) {
        absl::StrAppend(&out, "\\u", absl::Hex(c, absl::kZeroPad4));
      } else {
        out += c;
      }
    }
    if (valid < rest.size()) out += "\\ufffd";
    rest.remove_prefix(std::min(rest.size(), valid + 1));
  }
  return out;
}

std::string FormatJson(const LogFields& fields) {
  std::string text;
  for (const LogField& field : fields) {
    const char* const quote = field.is_number ? "" : "\"";
    absl::StrAppend(&text, ",\"", field.name, "\":", quote, JsonEscape(field.value), quote);
  }
  return text;
}

// Quotes a value unless it is one word.
std::string FormatText(const LogFields& fields) {
  std::string text;
  for (const LogField& field : fields) {
    const bool word =
        !field.value.empty() && field.value.find_first_of(" \"\\=\n\r\t") == std::string::npos;
    const char* const quote = word ? "" : "\"";
    absl::StrAppend(&text, " ", field.name, "=", quote, JsonEscape(field.value), quote);
  }
  return text;
}

// A message in one line, because it may contain bytes of a client, which could forge lines.
class OneLine : public spdlog::custom_flag_formatter {
 public:
  void format(const spdlog::details::log_msg& message, const std::tm& /*time*/,
              spdlog::memory_buf_t& out) override {
    const std::string text =
        Escape(std::string(message.payload.data(), message.payload.size()), /*quotes=*/false);
    out.append(text.data(), text.data() + text.size());
  }

  std::unique_ptr<spdlog::custom_flag_formatter> clone() const override {
    return std::make_unique<OneLine>();
  }
};

class JsonFormatter : public spdlog::formatter {
 public:
  void format(const spdlog::details::log_msg& message, spdlog::memory_buf_t& out) override {
    const std::string time = absl::FormatTime("%Y-%m-%dT%H:%M:%E3SZ",
                                              absl::FromChrono(message.time), absl::UTCTimeZone());
    const auto level = spdlog::level::to_string_view(message.level);
    const std::string line =
        absl::StrCat("{\"time\":\"", time, "\",\"level\":\"",
                     std::string(level.data(), level.size()), "\",\"message\":\"",
                     JsonEscape(std::string(message.payload.data(), message.payload.size())), "\"",
                     current_fields == nullptr ? "" : FormatJson(*current_fields), "}\n");
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
  const std::optional<uint64_t> suppressed = BudgetOf(library).Spend(LineBudget::Clock::now());
  if (!suppressed.has_value()) return;
  if (*suppressed == 0) return spdlog::log(level, "{}: {}", library, text);
  spdlog::log(level, "{}: {} ({} earlier lines omitted)", library, text, *suppressed);
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

}  // namespace

std::string JsonEscape(const std::string& text) { return Escape(text, /*quotes=*/true); }

LogField::LogField(const char* field, double number)
    : name(field), value(absl::StrFormat("%.3f", number)), is_number(true) {}

std::optional<uint64_t> LineBudget::Spend(Clock::time_point now) {
  const std::lock_guard lock(mutex_);
  if (!begin_.has_value() || now - *begin_ >= period_) {
    begin_ = now;
    spent_ = 0;
  }
  if (spent_ == lines_) {
    ++suppressed_;
    return std::nullopt;
  }
  ++spent_;
  return std::exchange(suppressed_, 0);
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
    auto formatter = std::make_unique<spdlog::pattern_formatter>();
    formatter->add_flag<OneLine>('*').set_pattern("%Y-%m-%dT%H:%M:%S.%e%z %l %*");
    logger->set_formatter(std::move(formatter));
  }
  logger->set_level(spdlog::level::from_str(level));
  logger->flush_on(spdlog::level::debug);
  spdlog::set_default_logger(std::move(logger));
  RouteLibraryLogs();
}

}  // namespace hulld::server
