// Processor quotas of control groups, read from a tree of files made for each test.

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <string>

#include "server/settings/resource_limits.h"

namespace hulld::server {
namespace cpu_limit_test {

class CpuLimitTest : public ::testing::Test {
 protected:
  CpuLimitTest() {
    std::string name = ::testing::TempDir() + "hulld_groups_XXXXXX";
    root_ = mkdtemp(name.data());
  }
  ~CpuLimitTest() override { std::filesystem::remove_all(root_); }

  void Write(const std::string& path, const std::string& content) {
    std::filesystem::create_directories((root_ / path).parent_path());
    std::ofstream(root_ / path) << content << "\n";
  }
  double Quota() const { return ReadCpuLimit(root_).quota; }

  std::filesystem::path root_;
};

TEST_F(CpuLimitTest, WithoutControlGroupsThereIsNoLimit) {
  EXPECT_TRUE(std::isinf(Quota()));
  EXPECT_GE(ReadCpuLimit(root_).processors, 1);
}

TEST_F(CpuLimitTest, AContainerSeesItsOwnGroupAsTheRoot) {
  Write("proc/self/cgroup", "0::/");
  Write("sys/fs/cgroup/cpu.max", "200000 100000");
  EXPECT_EQ(Quota(), 2);
}

TEST_F(CpuLimitTest, TheLowestLimitOfAllAncestorsApplies) {
  Write("proc/self/cgroup", "0::/a/b/c");
  Write("sys/fs/cgroup/a/cpu.max", "300000 100000");
  Write("sys/fs/cgroup/a/b/cpu.max", "75000 50000");
  Write("sys/fs/cgroup/a/b/c/cpu.max", "max 100000");
  Write("sys/fs/cgroup/other/cpu.max", "1000 100000");
  EXPECT_EQ(Quota(), 1.5);
}

TEST_F(CpuLimitTest, MaxIsNoLimit) {
  Write("proc/self/cgroup", "0::/a");
  Write("sys/fs/cgroup/a/cpu.max", "max 100000");
  EXPECT_TRUE(std::isinf(Quota()));
}

TEST_F(CpuLimitTest, TheQuotaOfVersionOneCounts) {
  Write("proc/self/cgroup", "4:cpu,cpuacct:/docker/x\n3:memory:/docker/x\n0::/");
  Write("sys/fs/cgroup/cpu/docker/x/cpu.cfs_quota_us", "250000");
  Write("sys/fs/cgroup/cpu/docker/x/cpu.cfs_period_us", "100000");
  EXPECT_EQ(Quota(), 2.5);
}

TEST_F(CpuLimitTest, MinusOneIsNoQuotaInVersionOne) {
  Write("proc/self/cgroup", "4:cpu,cpuacct:/docker/x");
  Write("sys/fs/cgroup/cpu/cpu.cfs_quota_us", "-1");
  Write("sys/fs/cgroup/cpu/cpu.cfs_period_us", "100000");
  EXPECT_TRUE(std::isinf(Quota()));
}

TEST_F(CpuLimitTest, FilesWithoutAQuotaMeanNoLimit) {
  Write("proc/self/cgroup", "no colons\n0::/a");
  for (const char* content : {"", "max", "100000", "100000 0", "-5 100000", "much 100000"}) {
    Write("sys/fs/cgroup/a/cpu.max", content);
    EXPECT_TRUE(std::isinf(Quota())) << content;
  }
}

TEST(CpuLimit, ThreadsAreRoundedUpAndNeverMoreThanProcessors) {
  EXPECT_EQ((CpuLimit{64, 2}).threads(), 2);
  EXPECT_EQ((CpuLimit{64, 1.5}).threads(), 2);
  EXPECT_EQ((CpuLimit{64, 0.001}).threads(), 1);
  EXPECT_EQ((CpuLimit{4, 16}).threads(), 4);
  EXPECT_EQ((CpuLimit{8}).threads(), 8);
}

TEST(CpuLimit, TheLogStatesTheReason) {
  EXPECT_EQ((CpuLimit{64, 1.5}).Describe(), "2; the control group grants 1.5 of 64 processors");
  EXPECT_EQ((CpuLimit{8}).Describe(), "8; the process may use 8 processors");
  EXPECT_EQ((CpuLimit{1, 3}).Describe(), "1; the process may use 1 processor");
}

}  // namespace cpu_limit_test
}  // namespace hulld::server
