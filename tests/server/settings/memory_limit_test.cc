// Memory limits of control groups, read from a tree of files made for each test.

#include <gtest/gtest.h>

#include <fstream>
#include <limits>
#include <string>

#include "server/settings/resource_limits.h"

namespace hulld::server {
namespace memory_limit_test {

constexpr uint64_t kNone = std::numeric_limits<uint64_t>::max();

class MemoryLimit : public ::testing::Test {
 protected:
  MemoryLimit() {
    std::string name = ::testing::TempDir() + "hulld_groups_XXXXXX";
    root_ = mkdtemp(name.data());
  }
  ~MemoryLimit() override { std::filesystem::remove_all(root_); }

  void Write(const std::string& path, const std::string& content) {
    std::filesystem::create_directories((root_ / path).parent_path());
    std::ofstream(root_ / path) << content << "\n";
  }

  std::filesystem::path root_;
};

TEST_F(MemoryLimit, WithoutControlGroupsThereIsNoLimit) {
  EXPECT_EQ(ControlGroupMemory(root_), kNone);
}

TEST_F(MemoryLimit, TheGroupOfTheProcessLimitsIt) {
  Write("proc/self/cgroup", "0::/system.slice/hulld.service");
  Write("sys/fs/cgroup/system.slice/memory.max", "max");
  Write("sys/fs/cgroup/system.slice/hulld.service/memory.max", "1000000");
  Write("sys/fs/cgroup/system.slice/other.service/memory.max", "10");
  EXPECT_EQ(ControlGroupMemory(root_), 1000000);
}

TEST_F(MemoryLimit, TheLowestLimitOfAllAncestorsApplies) {
  Write("proc/self/cgroup", "0::/a/b/c");
  Write("sys/fs/cgroup/a/memory.max", "3000");
  Write("sys/fs/cgroup/a/b/memory.max", "2000");
  Write("sys/fs/cgroup/a/b/c/memory.max", "5000");
  EXPECT_EQ(ControlGroupMemory(root_), 2000);
}

TEST_F(MemoryLimit, MaxIsNoLimit) {
  Write("proc/self/cgroup", "0::/a");
  Write("sys/fs/cgroup/a/memory.max", "max");
  EXPECT_EQ(ControlGroupMemory(root_), kNone);
}

TEST_F(MemoryLimit, InItsOwnNamespaceTheGroupIsTheRoot) {
  Write("proc/self/cgroup", "0::/");
  Write("sys/fs/cgroup/memory.max", "4096");
  EXPECT_EQ(ControlGroupMemory(root_), 4096);
}

TEST_F(MemoryLimit, AGroupOutsideTheNamespaceDoesNotLeadOutOfTheTree) {
  Write("proc/self/cgroup", "0::/../../a");
  Write("memory.max", "1");
  Write("sys/memory.max", "1");
  Write("sys/fs/cgroup/memory.max", "4096");
  EXPECT_EQ(ControlGroupMemory(root_), 4096);
}

TEST_F(MemoryLimit, VersionOneHasASeparateHierarchy) {
  Write("proc/self/cgroup",
        "12:cpu,cpuacct:/x\n5:hugetlb,memory:/docker/box\n1:name=systemd:/y\n0::/z");
  Write("sys/fs/cgroup/memory/memory.limit_in_bytes", "9223372036854771712");
  Write("sys/fs/cgroup/memory/docker/memory.limit_in_bytes", "9000");
  Write("sys/fs/cgroup/memory/docker/box/memory.limit_in_bytes", "7000");
  Write("sys/fs/cgroup/memory/x/memory.limit_in_bytes", "1");
  EXPECT_EQ(ControlGroupMemory(root_), 7000);
}

// The path is the host's, but the mounted tree is the container's own group.
TEST_F(MemoryLimit, InAContainerOfVersionOneTheRootApplies) {
  Write("proc/self/cgroup", "5:memory:/docker/0123");
  Write("sys/fs/cgroup/memory/memory.limit_in_bytes", "7000");
  EXPECT_EQ(ControlGroupMemory(root_), 7000);
}

TEST_F(MemoryLimit, UnknownLinesAreIgnored) {
  Write("proc/self/cgroup", "nonsense\n\n0:\n0::/a");
  Write("sys/fs/cgroup/a/memory.max", "2000");
  EXPECT_EQ(ControlGroupMemory(root_), 2000);
}

}  // namespace memory_limit_test
}  // namespace hulld::server
