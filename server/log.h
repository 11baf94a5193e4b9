#ifndef HULLD_SERVER_LOG_H_
#define HULLD_SERVER_LOG_H_

#include <string>

namespace hulld::server {

// Makes spdlog's default logger write to standard error, and sends gRPC's own messages there too.
// level: debug, info, warn or error. format: text, or json for one JSON object per line with time
// (UTC, RFC 3339), level and message.
void SetUpLog(const std::string& level, const std::string& format);

// `text` as the inside of a JSON string: quotes, backslashes and control characters escaped, bytes
// that are not UTF-8 replaced by U+FFFD.
std::string JsonEscape(const std::string& text);

}  // namespace hulld::server

#endif  // HULLD_SERVER_LOG_H_
