#ifndef HULLD_TESTS_SERVER_HARNESS_SMALL_DISK_H_
#define HULLD_TESTS_SERVER_HARNESS_SMALL_DISK_H_

#include <absl/strings/str_cat.h>
#include <fcntl.h>
#include <sys/mount.h>
#include <sys/stat.h>
#include <unistd.h>

#include <filesystem>
#include <string>
#include <vector>

namespace hulld::server {

// A separate file system that can be filled, if this process may mount one.
class SmallDisk {
 public:
  explicit SmallDisk(int mebibytes) {
    std::string name = "/tmp/hulld-disk-XXXXXX";
    path_ = mkdtemp(name.data());
    is_mounted_ = mount("none", path_.c_str(), "tmpfs", 0,
                        absl::StrCat("size=", mebibytes, "m").c_str()) == 0;
    mkdir(directory().c_str(), 0700);
    chmod(path_.c_str(), 0755);
  }
  SmallDisk(const SmallDisk&) = delete;
  SmallDisk& operator=(const SmallDisk&) = delete;
  ~SmallDisk() {
    if (is_mounted_) umount2(path_.c_str(), MNT_DETACH);
    std::filesystem::remove_all(path_);
  }

  bool is_mounted() const { return is_mounted_; }
  // Initially empty.
  std::string directory() const { return path_ + "/server"; }
  // Fills the disk completely.
  void Fill() const {
    const int file = open(filler().c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0600);
    const std::vector<char> block(4096);
    while (write(file, block.data(), block.size()) > 0) {
    }
    close(file);
  }
  void Resize(int mebibytes) const {
    mount("none", path_.c_str(), "tmpfs", MS_REMOUNT,
          absl::StrCat("size=", mebibytes, "m").c_str());
  }
  void Free() const { std::filesystem::remove(filler()); }

  static constexpr char kNoMount[] = "nothing may be mounted here";

 private:
  std::string filler() const { return path_ + "/filler"; }

  std::string path_;
  bool is_mounted_ = false;
};

}  // namespace hulld::server

#endif  // HULLD_TESTS_SERVER_HARNESS_SMALL_DISK_H_
