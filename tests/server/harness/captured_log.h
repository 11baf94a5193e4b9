#ifndef HULLD_TESTS_SERVER_HARNESS_CAPTURED_LOG_H_
#define HULLD_TESTS_SERVER_HARNESS_CAPTURED_LOG_H_

#include <spdlog/sinks/ostream_sink.h>
#include <spdlog/spdlog.h>

#include <memory>
#include <sstream>
#include <string>

namespace hulld::server {

// Captures the output of spdlog's default logger, formatted as the server does, until destruction.
class CapturedLog {
 public:
  CapturedLog() {
    auto logger = std::make_shared<spdlog::logger>(
        "captured", std::make_shared<spdlog::sinks::ostream_sink_mt>(text_));
    logger->set_pattern("%l %v");
    logger->set_level(spdlog::level::debug);
    spdlog::set_default_logger(std::move(logger));
  }
  ~CapturedLog() { spdlog::set_default_logger(before_); }
  // Requires: no thread still logs.
  std::string text() const { return text_.str(); }

 private:
  const std::shared_ptr<spdlog::logger> before_ = spdlog::default_logger();
  std::ostringstream text_;
};

}  // namespace hulld::server

#endif  // HULLD_TESTS_SERVER_HARNESS_CAPTURED_LOG_H_
