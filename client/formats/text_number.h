#ifndef HULLD_CLIENT_FORMATS_TEXT_NUMBER_H_
#define HULLD_CLIENT_FORMATS_TEXT_NUMBER_H_

#include <absl/status/status.h>

#include <cstdint>
#include <string>
#include <string_view>

namespace hulld {

enum class NumberText {
  // A number, or nan, inf or infinity spelled out.
  kNumber,
  // A finite number beyond the largest double.
  kTooLarge,
  kNoNumber,
};

// The nearest double (ties to even) of a decimal number, with an optional sign, '+' included; the
// whole text must be the number. A number nearer to 0 than to any other double is 0 with its sign.
// Locale plays no part.
NumberText ParseDouble(std::string_view text, double* value);

// A decimal number without sign that fits.
bool ParseUnsigned(std::string_view text, uint64_t* value);

// The shortest decimal text that ParseDouble reads back as the same bits.
std::string ShortestText(double value);

// Takes the next token off the front of `rest`: characters that are not white space. Empty at the
// end.
std::string_view NextToken(std::string_view* rest);

// Without spaces at both ends.
std::string_view Trim(std::string_view text);

// In double quotes, shortened and with unprintable characters replaced, fit for an error message.
std::string Quoted(std::string_view text);

// What is wrong with the text of a coordinate, as in `"abc" is not a number`.
std::string NumberProblem(NumberText kind, std::string_view text);

}  // namespace hulld

#endif  // HULLD_CLIENT_FORMATS_TEXT_NUMBER_H_
