// A page's edits while the server is slow.
#include "client/hullctl/view/edit_feed.h"

#include <absl/strings/str_cat.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <condition_variable>
#include <mutex>
#include <string>
#include <vector>

#include "tests/client/fake_hulld.h"

namespace hulld {
namespace edit_feed_test {

using ::testing::HasSubstr;

// A page that records messages.
class Page : public PageChannel {
 public:
  bool SendText(std::string json) override {
    const std::lock_guard lock(mutex_);
    messages_.push_back(std::move(json));
    changed_.notify_all();
    return true;
  }
  bool SendBinary(std::string /*frame*/) override { return true; }

  std::string WaitForMessage(size_t index) {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return messages_.size() > index; });
    return messages_[index];
  }
  size_t message_count() {
    const std::lock_guard lock(mutex_);
    return messages_.size();
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<std::string> messages_;
};

ViewEdit AppendOf(const std::string& hull_id, double x) {
  return {ViewEdit::Action::kAppend, hull_id, {x, 0, 0}};
}

class EditFeedTest : public ::testing::Test {
 protected:
  EditFeedTest() {
    hulld_.PutHull("h", {});
    hulld_.PutHull("other", {});
    // The first change blocks until Release, and so do all later changes.
    StreamScript hold;
    hold.hold_acks = true;
    hulld_.ScriptStreams({hold});
    ClientOptions options;
    options.server = hulld_.address();
    client_ = std::make_unique<Client>(options);
  }

  FakeHulld hulld_;
  std::unique_ptr<Client> client_;
  const std::shared_ptr<Page> page_ = std::make_shared<Page>();
};

TEST_F(EditFeedTest, AppliesAllChangesInOrder) {
  constexpr int kEdits = 500;
  {
    EditFeed feed(*client_, page_);
    for (int i = 0; i < kEdits; ++i) {
      feed.Ask(AppendOf("h", i));
      feed.Ask(AppendOf("other", -i));
    }
    feed.Ask({ViewEdit::Action::kDelete, "other", {}});
    hulld_.Release();
  }
  const std::vector<double> xyz = hulld_.hull("h").xyz;
  ASSERT_EQ(xyz.size(), 3 * kEdits);
  for (int i = 0; i < kEdits; ++i) EXPECT_EQ(xyz[3 * i], i);
  EXPECT_EQ(hulld_.calls("DeleteHull"), 1);
  // One message per server reply: a thousand changes take a few calls.
  EXPECT_LE(page_->message_count(), 5);
  EXPECT_THAT(page_->WaitForMessage(page_->message_count() - 1), HasSubstr("other was deleted"));
}

TEST_F(EditFeedTest, ReportsDroppedEdits) {
  EditFeed feed(*client_, page_);
  const std::vector<double> many(size_t{3} << 20);
  feed.Ask(AppendOf("h", 0));
  for (int i = 0; i < 4; ++i) feed.Ask({ViewEdit::Action::kAppend, "other", many});
  EXPECT_THAT(page_->WaitForMessage(0), HasSubstr("too many edits are pending"));
  EXPECT_THAT(page_->WaitForMessage(0), HasSubstr("\"done\":false"));
  hulld_.Release();
  EXPECT_THAT(page_->WaitForMessage(1), HasSubstr("h: 1 appended"));
  EXPECT_THAT(page_->WaitForMessage(2),
              HasSubstr(absl::StrCat("other: ", 3 * (many.size() / 3), " appended")));
}

}  // namespace edit_feed_test
}  // namespace hulld
