#ifndef HULLD_CLIENT_FORMATS_TEXT_NUMBER_H_
#define HULLD_CLIENT_FORMATS_TEXT_NUMBER_H_

#include <absl/status/statusor.h>

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace hulld {

enum class NumberText {
  // A number, or nan, inf, or infinity spelled out.
  kNumber,
  // A finite number beyond the largest double.
  kTooLarge,
  kNoNumber,
};

// Parses the nearest double (ties to even) of a decimal number with an optional sign, '+' included.
// The whole text must be the number. A number nearer to 0 than to any other double becomes 0 with
// its sign. 1.#INF, 1.#QNAN, 1.#SNAN, and 1.#IND, as old C libraries of Windows write them, are
// infinity and NaN. Independent of the locale.
NumberText ParseDouble(std::string_view text, double* value);

// Parses a coordinate in a file. Like ParseDouble, but the letter of the exponent may also be D, as
// in Fortran.
NumberText ParseCoordinate(std::string_view text, double* value);

// Parses an unsigned decimal number that fits in 64 bits.
bool ParseUnsigned(std::string_view text, uint64_t* value);

// Returns 0, 1, or 2 for a name that is x, y, or z, in either letter case.
std::optional<size_t> AxisNamed(std::string_view name);

// Returns the shortest decimal text that ParseDouble reads back as the same bits.
std::string ShortestText(double value);

// Removes and returns the next token of `rest`: characters other than white space. Empty at the
// end.
std::string_view NextToken(std::string_view* rest);

// Returns the text without leading and trailing spaces.
std::string_view Trim(std::string_view text);

// Returns the line without the comment that starts at its first '#'. The # in 1.#QNAN is part of a
// number.
std::string_view WithoutComment(std::string_view line);

// Returns the text in double quotes, shortened and with unprintable characters replaced, for an
// error message.
std::string Quoted(std::string_view text);

// Returns the length of the UTF-8 character at the start of the text, which is not empty; 0 if it
// is malformed.
size_t Utf8Length(std::string_view text);

// Returns true if the text is well-formed UTF-8.
bool IsUtf8(std::string_view text);

// Returns the text with "?" in place of control characters and of bytes that are not UTF-8.
std::string Printable(std::string_view text);

// Returns the text with each %XX replaced by its byte, as in URIs.
std::string PercentDecoded(std::string_view text);

// Returns "1 facet" or "2 facets". plural: by default, the noun with an "s".
std::string Counted(uint64_t count, const std::string& noun, const std::string& plural = "");

// Returns a message of protobuf's JSON parser in one line. The parser appends an excerpt of the
// input, and a mark below the place of the error.
std::string JsonProblem(std::string_view message);

// Parses a finite number. INVALID_ARGUMENT: the defect, as in `"abc" is not a number`.
absl::StatusOr<double> ParseFinite(std::string_view text);

// Returns the defect in the text of a coordinate, such as `"abc" is not a number`.
std::string NumberProblem(NumberText kind, std::string_view text);

}  // namespace hulld

#endif  // HULLD_CLIENT_FORMATS_TEXT_NUMBER_H_
