#include "server/process/descriptors.h"

#include <dirent.h>
#include <sys/resource.h>
#include <unistd.h>

#include <memory>

namespace hulld::server {

Descriptor::~Descriptor() {
  if (number_ >= 0) close(number_);
}

uint64_t CountDescriptors() {
  const std::unique_ptr<DIR, int (*)(DIR*)> directory(
      opendir("/proc/self/fd"), [](DIR* opened) { return opened ? closedir(opened) : 0; });
  if (directory == nullptr) return 0;
  uint64_t count = 0;
  while (const dirent* const entry = readdir(directory.get())) {
    if (entry->d_name[0] >= '0' && entry->d_name[0] <= '9') ++count;
  }
  // Excludes the descriptor of the directory.
  return count - 1;
}

uint64_t MaxDescriptors() {
  rlimit limit = {};
  getrlimit(RLIMIT_NOFILE, &limit);
  return limit.rlim_cur;
}

void RaiseDescriptorLimit() {
  rlimit limit = {};
  getrlimit(RLIMIT_NOFILE, &limit);
  limit.rlim_cur = limit.rlim_max;
  setrlimit(RLIMIT_NOFILE, &limit);
}

}  // namespace hulld::server
