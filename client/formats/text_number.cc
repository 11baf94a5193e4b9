#include "client/formats/text_number.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>
#include <system_error>

namespace hulld {
namespace {

bool IsSpace(char c) { return c == ' ' || (c >= '\t' && c <= '\r'); }

bool IsDigit(char c) { return c >= '0' && c <= '9'; }

// Distinguishes 1e999 from 1e-999, because std::from_chars returns "out of range" for both: by the
// decimal exponent of the first nonzero digit, which is above 300 or below -300 for a valid number
// outside the range of double.
bool IsHuge(std::string_view text) {
  long long exponent = -1;
  bool in_fraction = false;
  bool leading = true;
  size_t i = 0;
  for (; i < text.size() && (IsDigit(text[i]) || text[i] == '.'); ++i) {
    if (text[i] == '.') {
      in_fraction = true;
      continue;
    }
    if (leading && text[i] == '0') {
      if (in_fraction) --exponent;
      continue;
    }
    leading = false;
    if (!in_fraction) ++exponent;
  }
  if (i + 1 >= text.size()) return exponent > 0;
  const bool negative = text[i + 1] == '-';
  const char* begin = text.data() + i + 1 + (text[i + 1] == '-' || text[i + 1] == '+');
  long long written = 0;
  const auto [end, error] = std::from_chars(begin, text.data() + text.size(), written);
  if (error == std::errc::result_out_of_range) return !negative;
  constexpr long long kBeyondAnyText = std::numeric_limits<long long>::max() / 2;
  if (written > kBeyondAnyText) return !negative;
  return exponent + (negative ? -written : written) > 0;
}

// Parses 1.#INF and its variants without a sign. Printing with a precision adds zeros.
bool ParseNonFinite(std::string_view text, double* value) {
  while (!text.empty() && text.back() == '0') text.remove_suffix(1);
  const bool is_infinite = text == "1.#INF";
  if (!is_infinite && text != "1.#QNAN" && text != "1.#SNAN" && text != "1.#IND") return false;
  *value = is_infinite ? std::numeric_limits<double>::infinity()
                       : std::numeric_limits<double>::quiet_NaN();
  return true;
}

}  // namespace

NumberText ParseDouble(std::string_view text, double* value) {
  const bool negative = !text.empty() && text[0] == '-';
  if (negative || (!text.empty() && text[0] == '+')) text.remove_prefix(1);
  // from_chars would accept a second '-'.
  if (text.empty() || text[0] == '-') return NumberText::kNoNumber;
  const char* const end = text.data() + text.size();
  double magnitude = 0;
  const auto [stop, error] = std::from_chars(text.data(), end, magnitude);
  if (stop != end || error == std::errc::invalid_argument) {
    if (!ParseNonFinite(text, &magnitude)) return NumberText::kNoNumber;
    *value = negative ? -magnitude : magnitude;
    return NumberText::kNumber;
  }
  if (error == std::errc::result_out_of_range) {
    if (IsHuge(text)) return NumberText::kTooLarge;
    magnitude = 0;
  } else if (std::isinf(magnitude) && (IsDigit(text[0]) || text[0] == '.')) {
    return NumberText::kTooLarge;
  }
  *value = negative ? -magnitude : magnitude;
  return NumberText::kNumber;
}

NumberText ParseCoordinate(std::string_view text, double* value) {
  const NumberText kind = ParseDouble(text, value);
  const size_t letter = text.find_first_of("dD");
  if (kind != NumberText::kNoNumber || letter == std::string_view::npos || letter == 0) return kind;
  if (!IsDigit(text[letter - 1]) && text[letter - 1] != '.') return kind;
  std::string number(text);
  number[letter] = 'E';
  return ParseDouble(number, value);
}

std::optional<size_t> AxisNamed(std::string_view name) {
  const size_t axis = std::string_view("xyzXYZ").find(name);
  if (name.size() != 1 || axis == std::string_view::npos) return std::nullopt;
  return axis % 3;
}

bool ParseUnsigned(std::string_view text, uint64_t* value) {
  const char* const end = text.data() + text.size();
  const auto [stop, error] = std::from_chars(text.data(), end, *value);
  return !text.empty() && stop == end && error == std::errc();
}

std::string ShortestText(double value) {
  char buffer[32];
  return std::string(buffer, std::to_chars(buffer, buffer + sizeof(buffer), value).ptr);
}

std::string_view NextToken(std::string_view* rest) {
  size_t begin = 0;
  while (begin < rest->size() && IsSpace((*rest)[begin])) ++begin;
  size_t end = begin;
  while (end < rest->size() && !IsSpace((*rest)[end])) ++end;
  const std::string_view token = rest->substr(begin, end - begin);
  rest->remove_prefix(end);
  return token;
}

std::string_view Trim(std::string_view text) {
  while (!text.empty() && IsSpace(text.front())) text.remove_prefix(1);
  while (!text.empty() && IsSpace(text.back())) text.remove_suffix(1);
  return text;
}

std::string_view WithoutComment(std::string_view line) {
  size_t mark = line.find('#');
  while (mark != std::string_view::npos && mark > 0 && line[mark - 1] == '.') {
    mark = line.find('#', mark + 1);
  }
  return line.substr(0, mark);
}

std::string PercentDecoded(std::string_view text) {
  const auto digit = [](char c) {
    const size_t found = std::string_view("0123456789abcdefABCDEF").find(c);
    return found == std::string_view::npos ? -1 : static_cast<int>(found < 16 ? found : found - 6);
  };
  std::string decoded;
  for (size_t i = 0; i < text.size(); ++i) {
    const bool escaped =
        text[i] == '%' && i + 2 < text.size() && digit(text[i + 1]) >= 0 && digit(text[i + 2]) >= 0;
    decoded += escaped ? static_cast<char>(16 * digit(text[i + 1]) + digit(text[i + 2])) : text[i];
    if (escaped) i += 2;
  }
  return decoded;
}

std::string Counted(uint64_t count, const std::string& noun, const std::string& plural) {
  const std::string& text = count == 1 ? noun : plural;
  return std::to_string(count) + " " + (text.empty() ? noun + "s" : text);
}

std::string Quoted(std::string_view text) {
  constexpr size_t kLongest = 40;
  size_t end = text.size();
  if (end > kLongest) {
    // Cuts only between whole characters.
    for (end = kLongest; end > 0 && (static_cast<unsigned char>(text[end]) & 0xC0) == 0x80;) --end;
  }
  std::string quoted = "\"";
  quoted += Printable(text.substr(0, end));
  quoted += end < text.size() ? "...\"" : "\"";
  return quoted;
}

// Source: the table of well-formed sequences of the Unicode Standard, section 3.9.
size_t Utf8Length(std::string_view text) {
  const auto byte = [text](size_t i) { return static_cast<unsigned char>(text[i]); };
  const unsigned lead = byte(0);
  if (lead < 0x80) return 1;
  if (lead < 0xC2 || lead > 0xF4) return 0;
  const size_t length = lead < 0xE0 ? 2 : lead < 0xF0 ? 3 : 4;
  if (text.size() < length) return 0;
  for (size_t i = 1; i < length; ++i) {
    if ((byte(i) & 0xC0) != 0x80) return 0;
  }
  const bool overlong = (lead == 0xE0 && byte(1) < 0xA0) || (lead == 0xF0 && byte(1) < 0x90);
  const bool surrogate = lead == 0xED && byte(1) >= 0xA0;
  const bool too_large = lead == 0xF4 && byte(1) >= 0x90;
  return overlong || surrogate || too_large ? 0 : length;
}

bool IsUtf8(std::string_view text) {
  while (!text.empty()) {
    const size_t length = Utf8Length(text);
    if (length == 0) return false;
    text.remove_prefix(length);
  }
  return true;
}

std::string Printable(std::string_view text) {
  std::string printable;
  while (!text.empty()) {
    const size_t length = Utf8Length(text);
    const bool is_control = length == 1 && (text[0] < ' ' || text[0] == '\x7F');
    if (length == 0 || is_control) {
      printable += '?';
    } else {
      printable += text.substr(0, length);
    }
    text.remove_prefix(length == 0 ? 1 : length);
  }
  return printable;
}

std::string JsonProblem(std::string_view message) {
  if (message.substr(0, 2) == ": ") message.remove_prefix(2);
  constexpr std::string_view kUnknown = ": Cannot find field.";
  const size_t unknown = message.find(kUnknown);
  if (unknown != std::string_view::npos && unknown + kUnknown.size() == message.size()) {
    const std::string_view path = message.substr(0, unknown);
    const size_t end = path.rfind(") ");
    const size_t name = end == std::string_view::npos ? 0 : end + 2;
    return (name > 0 ? std::string(path.substr(1, name - 3)) : "the message") + " has no field " +
           Quoted(path.substr(name));
  }
  if (message == "JSON transcoder produced invalid protobuf output.") {
    return "objects or arrays are nested too deeply";
  }
  const size_t first = message.find('\n');
  const size_t last = message.rfind('\n');
  if (first == last) return std::string(message);
  const std::string_view excerpt = message.substr(first + 1, last - first - 1);
  const size_t column = std::min(message.size() - last - 2, excerpt.size());
  return std::string(message.substr(0, message.find_last_not_of('.', first - 1) + 1)) +
         (column < excerpt.size() ? " at " + Quoted(excerpt.substr(column)) : " at the end");
}

std::string NumberProblem(NumberText kind, std::string_view text) {
  if (kind == NumberText::kTooLarge) {
    return Quoted(text) + " exceeds the largest double, about 1.8e308; rescale the points";
  }
  std::string problem = Quoted(text) + " is not a number";
  if (text.find(',') != std::string_view::npos) problem += " (use a point as the decimal mark)";
  return problem;
}

absl::StatusOr<double> ParseFinite(std::string_view text) {
  double number = 0;
  const NumberText kind = ParseDouble(text, &number);
  if (kind != NumberText::kNumber) return absl::InvalidArgumentError(NumberProblem(kind, text));
  if (std::isfinite(number)) return number;
  return absl::InvalidArgumentError(Quoted(text) + " is not a finite number");
}

}  // namespace hulld
