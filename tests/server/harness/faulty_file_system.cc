#include "tests/server/harness/faulty_file_system.h"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <mutex>
#include <sstream>
#include <utility>

#include "core/base/check.h"

namespace hulld::server {
namespace {

using rocksdb::IODebugContext;
using rocksdb::IOOptions;
using rocksdb::IOStatus;

// RocksDB adds extra slashes when it joins paths.
std::string Normal(const std::string& path) {
  std::string normal = std::filesystem::path(path).lexically_normal().string();
  if (normal.size() > 1 && normal.ends_with('/')) normal.pop_back();
  return normal;
}

std::string ReadAll(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  // Not by iterators, which are slow in the harness: it is not optimized.
  return (std::ostringstream() << file.rdbuf()).str();
}

}  // namespace

class FaultyFileSystem::File : public rocksdb::FSWritableFileOwnerWrapper {
 public:
  File(FaultyFileSystem& system, std::string name, std::unique_ptr<rocksdb::FSWritableFile> file)
      : FSWritableFileOwnerWrapper(std::move(file)), system_(system), name_(std::move(name)) {}

  IOStatus Append(const rocksdb::Slice& data, const IOOptions& options,
                  IODebugContext* debug) override {
    const std::shared_lock writing(system_.mutex_);
    IOStatus error;
    {
      const std::lock_guard lock(system_.state_mutex_);
      error = system_.Error(false);
    }
    rocksdb::Slice written = data;
    if (error.IsNoSpace()) written = rocksdb::Slice(data.data(), data.size() / 2);
    if (error.ok()) {
      const std::lock_guard lock(system_.state_mutex_);
      const uint64_t fitting = system_.Fitting(data.size());
      if (fitting < data.size()) error = IOStatus::NoSpace("No space left on device");
      written = rocksdb::Slice(data.data(), fitting);
    }
    if (error.ok() || error.IsNoSpace()) {
      const IOStatus appended = FSWritableFileOwnerWrapper::Append(written, options, debug);
      if (!appended.ok()) return appended;
      const std::lock_guard lock(system_.state_mutex_);
      system_.files_[name_].size += written.size();
    }
    return error;
  }
  IOStatus Append(const rocksdb::Slice& data, const IOOptions& options,
                  const rocksdb::DataVerificationInfo&, IODebugContext* debug) override {
    return Append(data, options, debug);
  }
  IOStatus Truncate(uint64_t size, const IOOptions& options, IODebugContext* debug) override {
    const std::shared_lock writing(system_.mutex_);
    const std::lock_guard lock(system_.state_mutex_);
    if (IOStatus error = system_.Error(false); !error.ok() && !error.IsNoSpace()) return error;
    const IOStatus truncated = FSWritableFileOwnerWrapper::Truncate(size, options, debug);
    Written& file = system_.files_[name_];
    file.size = std::min(file.size, size);
    file.synced = std::min(file.synced, size);
    return truncated;
  }
  IOStatus Allocate(uint64_t offset, uint64_t size, const IOOptions& options,
                    IODebugContext* debug) override {
    const std::shared_lock writing(system_.mutex_);
    const std::lock_guard lock(system_.state_mutex_);
    if (IOStatus error = system_.Error(false); !error.ok()) return error;
    if (system_.Fitting(size) < size) return IOStatus::NoSpace("No space left on device");
    const IOStatus allocated = FSWritableFileOwnerWrapper::Allocate(offset, size, options, debug);
    if (allocated.ok()) system_.files_[name_].reserved = size;
    return allocated;
  }
  IOStatus Sync(const IOOptions&, IODebugContext*) override { return SyncWritten(); }
  IOStatus Fsync(const IOOptions&, IODebugContext*) override { return SyncWritten(); }
  IOStatus RangeSync(uint64_t, uint64_t, const IOOptions&, IODebugContext*) override {
    return IOStatus::OK();
  }

 private:
  // Does not sync the real disk, because its power is never cut.
  IOStatus SyncWritten() {
    const std::shared_lock writing(system_.mutex_);
    const std::lock_guard lock(system_.state_mutex_);
    if (IOStatus error = system_.Error(true); !error.ok()) return error;
    Written& file = system_.files_[name_];
    file.synced = file.size;
    ++system_.syncs_;
    return IOStatus::OK();
  }

  FaultyFileSystem& system_;
  const std::string name_;
};

// A file with writes at random offsets.
class FaultyFileSystem::Overwritten : public rocksdb::FSRandomRWFileOwnerWrapper {
 public:
  Overwritten(FaultyFileSystem& system, std::string name,
              std::unique_ptr<rocksdb::FSRandomRWFile> file)
      : FSRandomRWFileOwnerWrapper(std::move(file)), system_(system), name_(std::move(name)) {}

  IOStatus Write(uint64_t offset, const rocksdb::Slice& data, const IOOptions& options,
                 IODebugContext* debug) override {
    const std::shared_lock writing(system_.mutex_);
    const std::lock_guard lock(system_.state_mutex_);
    // Overwriting takes no space, so it succeeds on a full disk.
    if (IOStatus error = system_.InjectedError(false); !error.ok() && !error.IsNoSpace())
      return error;
    std::string former(data.size(), '\0');
    rocksdb::Slice read;
    IOStatus status = Read(offset, data.size(), options, &read, former.data(), debug);
    if (!status.ok()) return status;
    system_.files_[name_].overwritten.emplace(offset, former);
    return FSRandomRWFileOwnerWrapper::Write(offset, data, options, debug);
  }
  // Does not count as a failure because it runs at its own intervals.
  IOStatus Sync(const IOOptions&, IODebugContext*) override {
    const std::shared_lock writing(system_.mutex_);
    const std::lock_guard lock(system_.state_mutex_);
    if (IOStatus error = system_.InjectedError(true); !error.ok()) return error;
    system_.files_[name_].overwritten.clear();
    return IOStatus::OK();
  }

 private:
  FaultyFileSystem& system_;
  const std::string name_;
};

class FaultyFileSystem::Table : public rocksdb::FSRandomAccessFileOwnerWrapper {
 public:
  Table(FaultyFileSystem& system, std::unique_ptr<rocksdb::FSRandomAccessFile> file)
      : FSRandomAccessFileOwnerWrapper(std::move(file)), system_(system) {}

  IOStatus Read(uint64_t offset, size_t n, const IOOptions& options, rocksdb::Slice* result,
                char* scratch, IODebugContext* debug) const override {
    {
      const std::lock_guard lock(system_.state_mutex_);
      if (system_.fault_ == Fault::kReadError) return IOStatus::IOError("Input/output error");
    }
    return FSRandomAccessFileOwnerWrapper::Read(offset, n, options, result, scratch, debug);
  }

 private:
  FaultyFileSystem& system_;
};

class FaultyFileSystem::Directory : public rocksdb::FSDirectory {
 public:
  Directory(FaultyFileSystem& system, std::string name) : system_(system), name_(std::move(name)) {}

  IOStatus Fsync(const IOOptions&, IODebugContext*) override {
    const std::shared_lock writing(system_.mutex_);
    const std::lock_guard lock(system_.state_mutex_);
    if (IOStatus error = system_.Error(true); !error.ok()) return error;
    for (auto& [path, file] : system_.files_) {
      if (std::filesystem::path(path).parent_path() != name_) continue;
      file.entry_synced = true;
      file.former.reset();
    }
    for (auto& [path, synced] : system_.directories_) {
      if (std::filesystem::path(path).parent_path() == name_) synced = true;
    }
    return IOStatus::OK();
  }
  IOStatus Close(const IOOptions&, IODebugContext*) override { return IOStatus::OK(); }

 private:
  FaultyFileSystem& system_;
  const std::filesystem::path name_;
};

void FaultyFileSystem::SetFault(Fault fault, int64_t failures) {
  const std::lock_guard lock(state_mutex_);
  fault_ = fault;
  failures_left_ = failures;
}

void FaultyFileSystem::SetRoom(uint64_t bytes) {
  const std::lock_guard lock(state_mutex_);
  room_ = bytes;
}

uint64_t FaultyFileSystem::used() const {
  const std::lock_guard lock(state_mutex_);
  uint64_t bytes = 0;
  for (const auto& [name, file] : files_) bytes += file.size + file.reserved;
  return bytes;
}

uint64_t FaultyFileSystem::Fitting(uint64_t size) const {
  uint64_t used = 0;
  for (const auto& [name, file] : files_) used += file.size + file.reserved;
  return used >= room_ ? 0 : std::min(size, room_ - used);
}

int64_t FaultyFileSystem::syncs() const {
  const std::lock_guard lock(state_mutex_);
  return syncs_;
}

IOStatus FaultyFileSystem::NewRandomAccessFile(const std::string& name,
                                               const rocksdb::FileOptions& options,
                                               std::unique_ptr<rocksdb::FSRandomAccessFile>* result,
                                               IODebugContext* debug) {
  const IOStatus opened = FileSystemWrapper::NewRandomAccessFile(name, options, result, debug);
  if (opened.ok() && name.ends_with(".sst")) {
    *result = std::make_unique<Table>(*this, std::move(*result));
  }
  return opened;
}

std::vector<std::string> FaultyFileSystem::directories() const {
  const std::lock_guard lock(state_mutex_);
  std::vector<std::string> names;
  for (const auto& [name, synced] : directories_) names.push_back(name);
  return names;
}

std::vector<std::string> FaultyFileSystem::unsynced_directories() const {
  const std::lock_guard lock(state_mutex_);
  std::vector<std::string> names;
  for (const auto& [name, synced] : directories_) {
    if (!synced) names.push_back(name);
  }
  return names;
}

IOStatus FaultyFileSystem::Error(bool is_sync) {
  const IOStatus error = InjectedError(is_sync);
  if (!error.ok() && --failures_left_ == 0) fault_ = Fault::kNone;
  return error;
}

IOStatus FaultyFileSystem::InjectedError(bool is_sync) const {
  switch (fault_) {
    case Fault::kNone:
      return IOStatus::OK();
    case Fault::kNoSpace:
      return is_sync ? IOStatus::OK() : IOStatus::NoSpace("No space left on device");
    case Fault::kIoError:
      return IOStatus::IOError("Input/output error");
    case Fault::kReadOnly:
      return IOStatus::IOError("Read-only file system");
    case Fault::kSyncError:
      return is_sync ? IOStatus::IOError("Input/output error while syncing") : IOStatus::OK();
    case Fault::kNoSpaceAtSync:
      return is_sync ? IOStatus::NoSpace("No space left on device") : IOStatus::OK();
    case Fault::kReadError:
      return IOStatus::OK();
  }
  HULLD_UNREACHABLE();
}

void FaultyFileSystem::CopySurvivors(const std::string& source, const std::string& target,
                                     std::mt19937_64& random) {
  const std::unique_lock nobody_writes(mutex_);
  const std::lock_guard lock(state_mutex_);
  std::filesystem::create_directories(target);
  for (const auto& [path, file] : files_) {
    if (!path.starts_with(source + "/")) continue;
    const bool directory_lost =
        std::ranges::any_of(directories_, [&path = path](const auto& directory) {
          return !directory.second && path.starts_with(directory.first + "/");
        });
    if (directory_lost) continue;
    const std::string copy = target + path.substr(source.size());
    if (!file.entry_synced && !file.former.has_value()) continue;
    std::filesystem::create_directories(std::filesystem::path(copy).parent_path());
    std::string content = file.entry_synced ? ReadAll(path) : *file.former;
    if (file.entry_synced) {
      const uint64_t torn = random() % (file.size - file.synced + 1);
      content.resize(std::min<uint64_t>(content.size(), file.synced + torn));
      for (const auto& [offset, former] : file.overwritten) {
        if (random() % 2 == 0) content.replace(offset, former.size(), former);
      }
    }
    std::ofstream(copy, std::ios::binary) << content;
  }
}

IOStatus FaultyFileSystem::NewWritableFile(const std::string& name,
                                           const rocksdb::FileOptions& options,
                                           std::unique_ptr<rocksdb::FSWritableFile>* result,
                                           IODebugContext* debug) {
  const std::shared_lock writing(mutex_);
  const std::lock_guard lock(state_mutex_);
  if (IOStatus error = Error(false); !error.ok()) return error;
  std::unique_ptr<rocksdb::FSWritableFile> file;
  const IOStatus opened = FileSystemWrapper::NewWritableFile(name, options, &file, debug);
  if (!opened.ok()) return opened;
  files_[Normal(name)] = {};
  *result = std::make_unique<File>(*this, Normal(name), std::move(file));
  return opened;
}

IOStatus FaultyFileSystem::NewRandomRWFile(const std::string& name,
                                           const rocksdb::FileOptions& options,
                                           std::unique_ptr<rocksdb::FSRandomRWFile>* result,
                                           IODebugContext* debug) {
  std::unique_ptr<rocksdb::FSRandomRWFile> file;
  const IOStatus opened = FileSystemWrapper::NewRandomRWFile(name, options, &file, debug);
  if (!opened.ok()) return opened;
  *result = std::make_unique<Overwritten>(*this, Normal(name), std::move(file));
  return opened;
}

IOStatus FaultyFileSystem::NewDirectory(const std::string& name, const IOOptions&,
                                        std::unique_ptr<rocksdb::FSDirectory>* result,
                                        IODebugContext*) {
  *result = std::make_unique<Directory>(*this, Normal(name));
  return IOStatus::OK();
}

IOStatus FaultyFileSystem::CreateDir(const std::string& name, const IOOptions& options,
                                     IODebugContext* debug) {
  const std::shared_lock writing(mutex_);
  const std::lock_guard lock(state_mutex_);
  if (IOStatus error = Error(false); !error.ok()) return error;
  const IOStatus made = FileSystemWrapper::CreateDir(name, options, debug);
  if (made.ok()) directories_[Normal(name)] = false;
  return made;
}

IOStatus FaultyFileSystem::CreateDirIfMissing(const std::string& name, const IOOptions& options,
                                              IODebugContext* debug) {
  if (std::filesystem::is_directory(name)) return IOStatus::OK();
  return CreateDir(name, options, debug);
}

IOStatus FaultyFileSystem::RenameFile(const std::string& source, const std::string& target,
                                      const IOOptions& options, IODebugContext* debug) {
  const std::shared_lock writing(mutex_);
  const std::lock_guard lock(state_mutex_);
  if (IOStatus error = Error(false); !error.ok()) return error;
  const auto replaced = files_.find(Normal(target));
  std::optional<std::string> former;
  if (replaced != files_.end()) {
    former = replaced->second.entry_synced ? ReadAll(target) : replaced->second.former;
    if (replaced->second.entry_synced) former->resize(replaced->second.synced);
  }
  const IOStatus renamed = FileSystemWrapper::RenameFile(source, target, options, debug);
  if (!renamed.ok()) return renamed;
  const auto moved = files_.extract(Normal(source));
  if (moved.empty()) return renamed;
  Written file = moved.mapped();
  file.entry_synced = false;
  file.former = std::move(former);
  files_[Normal(target)] = std::move(file);
  return renamed;
}

IOStatus FaultyFileSystem::DeleteFile(const std::string& name, const IOOptions& options,
                                      IODebugContext* debug) {
  const std::shared_lock writing(mutex_);
  const std::lock_guard lock(state_mutex_);
  if (IOStatus error = Error(false); !error.ok() && !error.IsNoSpace()) return error;
  const IOStatus deleted = FileSystemWrapper::DeleteFile(name, options, debug);
  if (deleted.ok()) files_.erase(Normal(name));
  return deleted;
}

}  // namespace hulld::server
