#include "server/call/trace_context.h"

#include <gtest/gtest.h>

#include <string>

namespace hulld::server {
namespace trace_context_test {

const std::string kTrace = "0af7651916cd43dd8448eb211c80319c";
const std::string kParent = "b7ad6b7169203331";

TEST(TraceContext, ReadsValidText) {
  const std::string text = "00-" + kTrace + "-" + kParent + "-01";
  const std::optional<TraceContext> trace = TraceContext::Parse(text);
  ASSERT_TRUE(trace.has_value());
  EXPECT_EQ(trace->trace_id(), kTrace);
  EXPECT_EQ(trace->parent_id(), kParent);
  EXPECT_EQ(trace->text(), text);
  EXPECT_TRUE(TraceContext::Parse("00-" + kTrace + "-" + kParent + "-ff").has_value());
}

// Later versions may have more fields, which are ignored.
TEST(TraceContext, ReadsKnownFieldsOfLaterVersions) {
  const std::string text = "00-" + kTrace + "-" + kParent + "-01";
  for (const std::string& later : {"01" + text.substr(2), "cc" + text.substr(2) + "-more"}) {
    const std::optional<TraceContext> trace = TraceContext::Parse(later);
    ASSERT_TRUE(trace.has_value()) << later;
    EXPECT_EQ(trace->text(), text);
  }
}

TEST(TraceContext, RefusesAnythingElse) {
  const std::string text = "00-" + kTrace + "-" + kParent + "-01";
  for (std::string wrong :
       {std::string(), text.substr(1), text.substr(0, 54), text + "-", text + "0",
        "ff" + text.substr(2), "0g" + text.substr(2), "01" + text.substr(2) + "more",
        "00-" + std::string(32, '0') + "-" + kParent + "-01",
        "00-" + kTrace + "-" + std::string(16, '0') + "-01",
        "00-" + kTrace + "-" + kParent + "-0G"}) {
    EXPECT_FALSE(TraceContext::Parse(wrong).has_value()) << wrong;
  }
  // Any other byte at any position.
  for (size_t i = 0; i < text.size(); ++i) {
    for (const char c : {'A', 'g', ' ', '\0', '\x80'}) {
      std::string wrong = text;
      wrong[i] = c;
      EXPECT_FALSE(TraceContext::Parse(wrong).has_value()) << wrong;
    }
  }
}

}  // namespace trace_context_test
}  // namespace hulld::server
