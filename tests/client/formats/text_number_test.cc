#include "client/formats/text_number.h"

#include <absl/strings/str_cat.h>
#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <random>

namespace hulld {
namespace text_number_test {

double Parsed(std::string_view text) {
  double value = -12345;
  EXPECT_EQ(ParseDouble(text, &value), NumberText::kNumber) << text;
  return value;
}

NumberText KindOf(std::string_view text) {
  double ignored;
  return ParseDouble(text, &ignored);
}

TEST(TextNumber, IsTheNearestDouble) {
  EXPECT_EQ(Parsed("0.1"), 0.1);
  EXPECT_EQ(Parsed("-1e-310"), -1e-310);
  EXPECT_EQ(Parsed("4.9406564584124654e-324"), 0x1p-1074);
  EXPECT_EQ(Parsed("1.7976931348623157e308"), 0x1.fffffffffffffp1023);
  EXPECT_EQ(Parsed("2.2250738585072011e-308"), 0x0.fffffffffffffp-1022);
  // Halfway between two doubles: ties go to even, and a digit far behind decides otherwise.
  EXPECT_EQ(Parsed("9007199254740993"), 9007199254740992.0);
  EXPECT_EQ(Parsed("9007199254740993.0000000000000000000000000000000000000001"),
            9007199254740994.0);
  EXPECT_EQ(Parsed("0." + std::string(400, '0') + "1e401"), 1.0);
}

TEST(TextNumber, AcceptsAPlusSignAndBareFractions) {
  EXPECT_EQ(Parsed("+1.5"), 1.5);
  EXPECT_EQ(Parsed("+.5"), 0.5);
  EXPECT_EQ(Parsed("-2."), -2.0);
  EXPECT_EQ(Parsed("1e+2"), 100.0);
}

TEST(TextNumber, KeepsTheSignOfZero) {
  EXPECT_TRUE(std::signbit(Parsed("-0")));
  EXPECT_FALSE(std::signbit(Parsed("+0")));
}

TEST(TextNumber, TooSmallForADoubleIsZero) {
  EXPECT_EQ(Parsed("1e-400"), 0.0);
  EXPECT_TRUE(std::signbit(Parsed("-1e-400")));
  EXPECT_EQ(Parsed(absl::StrCat("0.", std::string(500, '0'), "1")), 0.0);
  EXPECT_EQ(Parsed("1e-99999999999999999999999999"), 0.0);
  EXPECT_EQ(Parsed("12345e-9223372036854775807"), 0.0);
  // Half of the smallest denormal rounds to even, which is 0; anything above it rounds up.
  EXPECT_EQ(Parsed("2.4703282292062327e-324"), 0.0);
  EXPECT_EQ(Parsed("2.4703282292062328e-324"), 0x1p-1074);
}

TEST(TextNumber, TooLargeNumbersAreReported) {
  for (const char* text : {"1e999", "-1e999", "+1e309", "1.8e308", "1e99999999999999999999999",
                           "0.00001e9223372036854775807"}) {
    EXPECT_EQ(KindOf(text), NumberText::kTooLarge) << text;
  }
  EXPECT_EQ(KindOf(std::string(400, '9')), NumberText::kTooLarge);
  EXPECT_EQ(KindOf(std::string(400, '9') + ".5"), NumberText::kTooLarge);
  EXPECT_EQ(NumberProblem(NumberText::kTooLarge, "1e999"),
            "\"1e999\" exceeds the largest double, about 1.8e308; rescale the points");
}

TEST(TextNumber, ReadsNanAndInfinity) {
  EXPECT_TRUE(std::isnan(Parsed("nan")));
  EXPECT_TRUE(std::isnan(Parsed("-NaN")));
  EXPECT_EQ(Parsed("inf"), HUGE_VAL);
  EXPECT_EQ(Parsed("-Infinity"), -HUGE_VAL);
}

TEST(TextNumber, ReadsTheSpellingsOfOldWindowsLibraries) {
  for (const char* text : {"1.#QNAN", "-1.#IND", "1.#SNAN", "-1.#IND00", "1.#QNAN0"}) {
    EXPECT_TRUE(std::isnan(Parsed(text))) << text;
  }
  EXPECT_EQ(Parsed("1.#INF"), HUGE_VAL);
  EXPECT_EQ(Parsed("-1.#INF00"), -HUGE_VAL);
  for (const char* text : {"1.#", "1.#X", "2.#INF", "#INF", "1.#INF1"}) {
    EXPECT_EQ(KindOf(text), NumberText::kNoNumber) << text;
  }
}

TEST(TextNumber, OnlyCoordinatesHaveExponentsOfFortran) {
  double value = 0;
  EXPECT_EQ(ParseCoordinate("-1.25D-02", &value), NumberText::kNumber);
  EXPECT_EQ(value, -0.0125);
  EXPECT_EQ(KindOf("-1.25D-02"), NumberText::kNoNumber);
}

TEST(TextNumber, CommentsDoNotStartWithinNumbers) {
  EXPECT_EQ(WithoutComment("1 2 3#c"), "1 2 3");
  EXPECT_EQ(WithoutComment("1 2 1.#INF # 4"), "1 2 1.#INF ");
  EXPECT_EQ(WithoutComment("# a.# b"), "");
}

TEST(TextNumber, RefusesOtherText) {
  for (const char* text :
       {"",   "-",    "+",   ".",  "abc", "1x",     "+-1",   "--1",  "-+1",   "++1",
        "1e", "0x10", "1,5", "1 ", " 1",  "3.1+e2", "1e5.5", "nanx", "infin", "e5"}) {
    EXPECT_EQ(KindOf(text), NumberText::kNoNumber) << text;
  }
}

TEST(TextNumber, AgreesWithTheCLibraryOnRandomBits) {
  std::mt19937_64 random(20240601);
  int denormal = 0;
  for (int i = 0; i < 100000; ++i) {
    const double value = std::bit_cast<double>(i % 10 == 0 ? random() >> 12 : random());
    if (!std::isfinite(value)) continue;
    if (std::abs(value) < 0x1p-1022) ++denormal;
    char text[64];
    std::snprintf(text, sizeof(text), "%.*g", 1 + i % 25, value);
    const double expected = std::strtod(text, nullptr);
    if (!std::isfinite(expected)) continue;
    ASSERT_EQ(std::bit_cast<uint64_t>(Parsed(text)), std::bit_cast<uint64_t>(expected)) << text;
    ASSERT_EQ(std::bit_cast<uint64_t>(Parsed(ShortestText(value))), std::bit_cast<uint64_t>(value));
  }
  EXPECT_GT(denormal, 5000);
}

TEST(TextNumber, QuotesForeignTextSafely) {
  EXPECT_EQ(Quoted("a\x1b[31m\xff"), "\"a?[31m?\"");
  EXPECT_EQ(Quoted(std::string(1000, 'a')), absl::StrCat("\"", std::string(40, 'a'), "...\""));
  EXPECT_EQ(Quoted("W\xC3\xBCrfel"), "\"W\xC3\xBCrfel\"");
  // Truncated before a whole character.
  EXPECT_EQ(Quoted(absl::StrCat(std::string(39, 'a'), "\xC3\xBC")),
            absl::StrCat("\"", std::string(39, 'a'), "...\""));
  // A stray continuation, an overlong form, a surrogate, and a value beyond U+10FFFF.
  for (const char* text : {"\x80", "\xC0\x80", "\xED\xA0\x80", "\xF4\x90\x80\x80"}) {
    EXPECT_EQ(Quoted(text), absl::StrCat("\"", std::string(std::strlen(text), '?'), "\""));
  }
}

TEST(JsonProblem, IsOneLine) {
  EXPECT_EQ(JsonProblem("Unexpected token.\na,b,c\nd\n^"), "Unexpected token at \"a,b,c?d\"");
  EXPECT_EQ(JsonProblem("Expected : between key:value pair.\n{\"a\" 1}\n     ^"),
            "Expected : between key:value pair at \"1}\"");
  EXPECT_EQ(JsonProblem("Unexpected end of string. Expected a value.\n{\n ^"),
            "Unexpected end of string. Expected a value at the end");
  EXPECT_EQ(JsonProblem("JSON transcoder produced invalid protobuf output."),
            "objects or arrays are nested too deeply");
  EXPECT_EQ(JsonProblem("pair: Cannot find field."), "the message has no field \"pair\"");
  EXPECT_EQ(JsonProblem("(placements[0]) hullID: Cannot find field."),
            "placements[0] has no field \"hullID\"");
  EXPECT_EQ(JsonProblem(": Root element must be a message."), "Root element must be a message.");
  EXPECT_EQ(JsonProblem("(a): invalid value"), "(a): invalid value");
}

}  // namespace text_number_test
}  // namespace hulld
