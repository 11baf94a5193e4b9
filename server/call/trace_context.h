#ifndef HULLD_SERVER_CALL_TRACE_CONTEXT_H_
#define HULLD_SERVER_CALL_TRACE_CONTEXT_H_

#include <optional>
#include <string>
#include <string_view>

namespace hulld::server {

// The trace that a call is part of, as its client names it in the metadata "traceparent". Source:
// W3C Recommendation Trace Context, level 1 (2021), section 3.2.
class TraceContext {
 public:
  // None when `text` is not a traceparent: 00, the trace's ID of 32 digits, its parent's of 16 and
  // flags of 2, all hexadecimal in lower case, with "-" between them; neither ID is zero. A later
  // version than 00 is read as far as 00 knows it.
  static std::optional<TraceContext> Parse(std::string_view text);

  std::string trace_id() const { return text_.substr(kTraceId, 32); }
  // The ID of the client's span.
  std::string parent_id() const { return text_.substr(kParentId, 16); }
  // As a traceparent of version 00.
  const std::string& text() const { return text_; }

 private:
  static constexpr size_t kTraceId = 3;
  static constexpr size_t kParentId = 36;

  explicit TraceContext(std::string text) : text_(std::move(text)) {}

  std::string text_;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_CALL_TRACE_CONTEXT_H_
