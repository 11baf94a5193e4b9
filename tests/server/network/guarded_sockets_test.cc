#include "server/network/guarded_sockets.h"

#include <gtest/gtest.h>
#include <sys/socket.h>
#include <unistd.h>

namespace hulld::server {
namespace guarded_sockets_test {

// Two connected sockets; the first is guarded by the test.
class GuardedSockets : public testing::Test {
 protected:
  void SetUp() override { ASSERT_EQ(socketpair(AF_UNIX, SOCK_STREAM, 0, sockets_), 0); }
  void TearDown() override {
    for (const int socket : sockets_) {
      if (socket >= 0) close(socket);
    }
  }

  void Guard(uint64_t connection) {
    GuardSocket(sockets_[0], connection, nullptr, [this] { ++closed_; });
  }
  bool PeerReadsEnd() {
    char byte;
    return recv(sockets_[1], &byte, 1, MSG_DONTWAIT) == 0;
  }

  int sockets_[2] = {-1, -1};
  int closed_ = 0;
};

TEST_F(GuardedSockets, ACloseIsReportedOnce) {
  Guard(1);
  EXPECT_EQ(closed_, 0);
  close(sockets_[0]);
  EXPECT_EQ(closed_, 1);
  // The next socket has the same number.
  int next[2];
  ASSERT_EQ(socketpair(AF_UNIX, SOCK_STREAM, 0, next), 0);
  ASSERT_EQ(next[0], sockets_[0]);
  close(next[1]);
  ShutDown(sockets_[0], 1);
  EXPECT_EQ(closed_, 1);
}

TEST_F(GuardedSockets, AShutdownEndsBothDirectionsOfOnlyItsConnection) {
  Guard(2);
  ShutDown(sockets_[0], 1);
  EXPECT_FALSE(PeerReadsEnd());
  ShutDown(sockets_[0], 2);
  EXPECT_TRUE(PeerReadsEnd());
  EXPECT_EQ(closed_, 0);
}

TEST_F(GuardedSockets, TheCloseOfAnUnguardedSocketIsNotReported) {
  Guard(3);
  Unguard(sockets_[0], 4);
  Unguard(sockets_[0], 3);
  ShutDown(sockets_[0], 3);
  EXPECT_FALSE(PeerReadsEnd());
  close(sockets_[0]);
  sockets_[0] = -1;
  EXPECT_EQ(closed_, 0);
}

}  // namespace guarded_sockets_test
}  // namespace hulld::server
