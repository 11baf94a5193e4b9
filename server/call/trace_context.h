#ifndef HULLD_SERVER_CALL_TRACE_CONTEXT_H_
#define HULLD_SERVER_CALL_TRACE_CONTEXT_H_

#include <optional>
#include <string>
#include <string_view>

namespace hulld::server {

// Trace of a call, from its metadata "traceparent". Source: W3C Recommendation Trace Context, level
// 1 (2021), section 3.2.
class TraceContext {
 public:
  // Returns nullopt if `text` is not a traceparent: 00, a trace ID of 32 digits, a parent ID of 16
  // and flags of 2, all in lower-case hexadecimal, separated by "-"; neither ID is zero. For a
  // version later than 00, only the fields that version 00 defines are parsed.
  static std::optional<TraceContext> Parse(std::string_view text);

  std::string trace_id() const { return text_.substr(kTraceId, 32); }
  // ID of the client's span.
  std::string parent_id() const { return text_.substr(kParentId, 16); }
  // The trace, as a traceparent of version 00.
  const std::string& text() const { return text_; }

 private:
  static constexpr size_t kTraceId = 3;
  static constexpr size_t kParentId = 36;

  explicit TraceContext(std::string text) : text_(std::move(text)) {}

  std::string text_;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_CALL_TRACE_CONTEXT_H_
