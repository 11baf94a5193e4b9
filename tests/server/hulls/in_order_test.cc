#include "server/hulls/in_order.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <string>
#include <vector>

namespace hulld::server {
namespace in_order_test {

using testing::ElementsAre;

TEST(InOrder, ResultsPassInTheOrderOfTheirRequests) {
  InOrder<std::string> results;
  std::array<uint64_t, 4> numbers{};
  for (uint64_t& number : numbers) number = results.Number();
  std::vector<std::string> passed;
  const auto pass = [&passed](const std::string& result) { passed.push_back(result); };

  results.Take(numbers[0], "first", pass);
  EXPECT_THAT(passed, ElementsAre("first"));
  results.Take(numbers[3], "fourth", pass);
  results.Take(numbers[2], "third", pass);
  EXPECT_THAT(passed, ElementsAre("first"));
  results.Take(numbers[1], "second", pass);
  EXPECT_THAT(passed, ElementsAre("first", "second", "third", "fourth"));
  results.Take(results.Number(), "fifth", pass);
  EXPECT_THAT(passed, ElementsAre("first", "second", "third", "fourth", "fifth"));
}

}  // namespace in_order_test
}  // namespace hulld::server
