// hullctl watch against the real server.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <unistd.h>

#include <atomic>
#include <mutex>
#include <sstream>
#include <string>
#include <thread>

#include "tests/client/formats/point_reading.h"
#include "tests/client/hullctl/hullctl_on_server.h"

namespace hulld {
namespace watch_test {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::MatchesRegex;

class HullctlWatch : public HullctlOnServer {};

TEST_F(HullctlWatch, ReportsExistingHulls) {
  Put("a/cube", server::Cube());
  Create("a/empty");
  Create("b");
  Ran ran = Run({"watch", "a/", "--until-synced"});
  EXPECT_EQ(ran.code, 0) << ran.err;
  EXPECT_EQ(ran.out,
            "PRESENT\ta/cube\t2\t8 of 8 points\t0 0 0 to 1 1 1\n"
            "PRESENT\ta/empty\t3\t0 of 0 points\n"
            "# synced at revision 4\n");
  ran = Run({"watch", "a/empt", "--exact", "--until-synced"});
  EXPECT_EQ(ran.out, "# synced at revision 4\n");
  ran = Run({"watch", "b", "--exact", "--until-synced", "--output", "name"});
  EXPECT_THAT(ran.out, HasSubstr("b\n"));
  ran = Run({"watch", "b", "--until-synced", "--output", "json"});
  EXPECT_THAT(ran.out, MatchesRegex("\\{.*\"kind\":\"HULL_EVENT_KIND_PRESENT\".*\\}\n"
                                    "\\{.*\"synced\":true.*\\}\n"));
}

TEST_F(HullctlWatch, ReportsBodies) {
  Put("a/cube", server::Cube());
  ASSERT_EQ(Run({"body", "put", "a/body", "a/cube", "a/cube@3,0,0"}).code, 0);
  Ran ran = Run({"watch", "a/", "--until-synced"});
  EXPECT_EQ(ran.code, 0) << ran.err;
  EXPECT_EQ(ran.out,
            "PRESENT\ta/body\t3\tbody of 2 pieces\n"
            "PRESENT\ta/cube\t2\t8 of 8 points\t0 0 0 to 1 1 1\n"
            "# synced at revision 3\n");
  ran = Run({"watch", "a/body", "--exact", "--until-synced", "--output", "name"});
  EXPECT_THAT(ran.out, HasSubstr("a/body\n"));
}

// Adds points that change the hull until the command has ended.
class Growth {
 public:
  explicit Growth(v1::HullService::Stub& stub) {
    thread_ = std::thread([this, &stub] {
      server::Appender appender(stub, "hull", "w", true);
      for (uint64_t i = 1; !ended_; ++i) {
        ASSERT_TRUE(appender.Append(i, {static_cast<double>(i), 0, 0}).has_value());
        appended_ = i;
      }
      appender.Finish();
    });
    while (appended_ == 0) std::this_thread::yield();
  }
  ~Growth() {
    ended_ = true;
    thread_.join();
  }

 private:
  std::atomic<bool> ended_ = false;
  std::atomic<uint64_t> appended_ = 0;
  std::thread thread_;
};

TEST_F(HullctlWatch, ReportsChanges) {
  const Growth growth(*hulls_);
  const Ran ran = Run({"watch", "hull", "--events", "5"});
  EXPECT_EQ(ran.code, 0) << ran.err;
  EXPECT_THAT(ran.out, AllOf(HasSubstr("PRESENT\thull\t"), HasSubstr("CHANGED\thull\t")));
}

// A string that the test reads while the command writes it.
class SharedText : public std::stringbuf {
 public:
  bool Contains(const std::string& part) {
    const std::lock_guard lock(mutex_);
    return str().find(part) != std::string::npos;
  }

 private:
  std::streamsize xsputn(const char* text, std::streamsize size) override {
    const std::lock_guard lock(mutex_);
    return std::stringbuf::xsputn(text, size);
  }
  int overflow(int c) override {
    const std::lock_guard lock(mutex_);
    return std::stringbuf::overflow(c);
  }

  // A write may call another.
  std::recursive_mutex mutex_;
};

// Like a full disk.
class FullDisk : public std::streambuf {};

TEST_F(HullctlWatch, EndsIfItsOutputFails) {
  Create("hull");
  FullDisk disk;
  std::ostream out(&disk);
  std::ostringstream err;
  UseNoContexts();
  EXPECT_EQ(RunHullctl({"watch", "--server", server_->address()}, out, err), 2);
  EXPECT_THAT(err.str(), HasSubstr("cannot write the answer"));
}

TEST_F(HullctlWatch, EndsAtCtrlC) {
  Create("hull");
  SharedText written;
  std::ostream out(&written);
  std::ostringstream err;
  std::thread interrupter([&] {
    while (!written.Contains("# synced")) std::this_thread::yield();
    kill(getpid(), SIGINT);
  });
  UseNoContexts();
  EXPECT_EQ(RunHullctl({"watch", "--server", server_->address()}, out, err), 0) << err.str();
  interrupter.join();
  EXPECT_EQ(err.str(), "");
}

TEST_F(HullctlWatch, ReportsCollisionsOfAScene) {
  Put("cube", server::Cube());
  const TempFile text("scene.yaml",
                      "place:\n  left: {id: cube}\n  right: {id: cube, at: [1, 0, 0]}\n"
                      "  lost: {id: none}\nask: {pairs: [[left, right], [left, lost]]}\n");
  Ran ran = Run({"watch", "--scene", text.path(), "--until-synced"});
  EXPECT_EQ(ran.code, 0) << ran.err;
  EXPECT_EQ(ran.out, "TOUCH\tleft\tright\t2\t2\n# synced at revision 2\n");
  EXPECT_THAT(ran.err, HasSubstr("placement lost: hull \"none\" not found"));
  const TempFile json("scene.json",
                      "{\"placements\":[{\"hullId\":\"cube\"},{\"hullId\":\"cube\"}],"
                      "\"wanted\":{\"clearance\":1}}");
  ran = Run({"watch", "--scene", json.path(), "--until-synced"});
  EXPECT_EQ(ran.out, "ENTER\t0:cube\t1:cube\t2\t2\n# synced at revision 2\n");
  ran = Run({"watch", "--scene", json.path(), "--until-synced", "--output", "json"});
  EXPECT_THAT(ran.out, HasSubstr("\"kind\":\"COLLISION_EVENT_KIND_ENTER\""));
}

TEST_F(HullctlWatch, ErrorsAreClear) {
  Ran ran = Run({"watch", "a//b", "--exact"});
  EXPECT_EQ(ran.code, 1);
  EXPECT_THAT(ran.err, HasSubstr("empty segment"));
  ran = Run({"watch", "a", "--scene", "scene.json"});
  EXPECT_EQ(ran.code, 2);
  EXPECT_THAT(ran.err, HasSubstr("cannot be combined with PREFIX"));
  ran = Run({"watch", "--scene", "/no/such/file"});
  EXPECT_EQ(ran.code, 2);
}

}  // namespace watch_test
}  // namespace hulld
