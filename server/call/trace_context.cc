#include "server/call/trace_context.h"

#include <algorithm>

namespace hulld::server {
namespace {

constexpr size_t kLength = 55;

bool IsHexadecimal(std::string_view text) {
  return std::all_of(text.begin(), text.end(),
                     [](char c) { return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'f'); });
}

bool IsId(std::string_view text) {
  return IsHexadecimal(text) && text.find_first_not_of('0') != std::string_view::npos;
}

}  // namespace

std::optional<TraceContext> TraceContext::Parse(std::string_view text) {
  if (text.size() < kLength) return std::nullopt;
  const std::string_view version = text.substr(0, 2);
  const std::string_view flags = text.substr(kLength - 2, 2);
  if (!IsHexadecimal(version) || version == "ff" || !IsHexadecimal(flags)) return std::nullopt;
  // Later versions may be longer.
  if (text.size() > kLength && (version == "00" || text[kLength] != '-')) return std::nullopt;
  if (text[2] != '-' || text[kParentId - 1] != '-' || text[kLength - 3] != '-') return std::nullopt;
  if (!IsId(text.substr(kTraceId, 32)) || !IsId(text.substr(kParentId, 16))) return std::nullopt;
  return TraceContext("00" + std::string(text.substr(2, kLength - 2)));
}

}  // namespace hulld::server
