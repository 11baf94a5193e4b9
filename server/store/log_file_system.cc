#include "server/store/log_file_system.h"

#include <utility>

namespace hulld::server {

using rocksdb::IODebugContext;
using rocksdb::IOOptions;
using rocksdb::IOStatus;

// Any file that is written; its syncs are watched.
class LogFileSystem::File : public rocksdb::FSWritableFileOwnerWrapper {
 public:
  File(LogFileSystem& system, std::unique_ptr<rocksdb::FSWritableFile> file)
      : FSWritableFileOwnerWrapper(std::move(file)), system_(system) {}

  IOStatus Sync(const IOOptions& options, IODebugContext* debug) override {
    return system_.NoteSync(FSWritableFileOwnerWrapper::Sync(options, debug));
  }
  IOStatus Fsync(const IOOptions& options, IODebugContext* debug) override {
    return system_.NoteSync(FSWritableFileOwnerWrapper::Fsync(options, debug));
  }

 protected:
  LogFileSystem& system_;
};

class LogFileSystem::Directory : public rocksdb::FSDirectoryWrapper {
 public:
  Directory(LogFileSystem& system, std::unique_ptr<rocksdb::FSDirectory> directory)
      : FSDirectoryWrapper(std::move(directory)), system_(system) {}

  IOStatus Fsync(const IOOptions& options, IODebugContext* debug) override {
    return system_.NoteSync(FSDirectoryWrapper::Fsync(options, debug));
  }
  IOStatus FsyncWithDirOptions(const IOOptions& options, IODebugContext* debug,
                               const rocksdb::DirFsyncOptions& directory) override {
    return system_.NoteSync(FSDirectoryWrapper::FsyncWithDirOptions(options, debug, directory));
  }

 private:
  LogFileSystem& system_;
};

class LogFileSystem::Log : public File {
 public:
  Log(LogFileSystem& system, std::string name, std::unique_ptr<rocksdb::FSWritableFile> file)
      : File(system, std::move(file)), name_(std::move(name)) {
    const std::lock_guard lock(system_.mutex_);
    system_.logs_[name_] = {0, 0, this};
  }
  ~Log() override {
    const std::lock_guard lock(system_.mutex_);
    const auto log = system_.logs_.find(name_);
    if (log != system_.logs_.end() && log->second.open == this) log->second.open = nullptr;
  }

  IOStatus Append(const rocksdb::Slice& data, const IOOptions& options,
                  IODebugContext* debug) override {
    if (is_cut_) return AlreadyCut();
    const IOStatus status = FSWritableFileOwnerWrapper::Append(data, options, debug);
    return Note(data, status);
  }
  IOStatus Append(const rocksdb::Slice& data, const IOOptions& options,
                  const rocksdb::DataVerificationInfo& info, IODebugContext* debug) override {
    if (is_cut_) return AlreadyCut();
    const IOStatus status = FSWritableFileOwnerWrapper::Append(data, options, info, debug);
    return Note(data, status);
  }

  // Through the file that is open: when RocksDB closes it, it sets the size that it believes in.
  IOStatus CutTo(uint64_t size) {
    is_cut_ = true;
    IOStatus cut = FSWritableFileOwnerWrapper::Truncate(size, IOOptions(), nullptr);
    // Not that of this class, which refuses: the file is cut.
    // NOLINTNEXTLINE(bugprone-parent-virtual-call)
    if (cut.ok()) cut = FSWritableFileOwnerWrapper::Sync(IOOptions(), nullptr);
    return cut;
  }

 private:
  static IOStatus AlreadyCut() { return IOStatus::IOError("the log was cut after an error"); }

  // What a failed call wrote is not committed, however much it is.
  IOStatus Note(const rocksdb::Slice& data, const IOStatus& status) {
    const std::lock_guard lock(system_.mutex_);
    system_.logs_[name_].written += data.size();
    return status;
  }

  const std::string name_;
  std::atomic<bool> is_cut_ = false;
};

IOStatus LogFileSystem::NoteSync(const IOStatus& status) {
  if (!status.ok()) ++failed_syncs_;
  return status;
}

void LogFileSystem::Commit() {
  const std::lock_guard lock(mutex_);
  for (auto& [name, log] : logs_) log.committed = log.written;
}

IOStatus LogFileSystem::CutUncommitted() {
  const std::lock_guard lock(mutex_);
  for (auto& [name, log] : logs_) {
    if (log.committed == log.written) continue;
    const IOStatus cut = log.open != nullptr ? log.open->CutTo(log.committed) : Cut(name, log);
    if (!cut.ok()) return cut;
    log.written = log.committed;
  }
  return IOStatus::OK();
}

// One that is closed.
IOStatus LogFileSystem::Cut(const std::string& name, const LogState& log) {
  std::unique_ptr<rocksdb::FSWritableFile> file;
  IOStatus cut = ReopenWritableFile(name, rocksdb::FileOptions(), &file, nullptr);
  if (cut.ok()) cut = file->Truncate(log.committed, IOOptions(), nullptr);
  if (cut.ok()) cut = file->Sync(IOOptions(), nullptr);
  if (cut.ok()) cut = file->Close(IOOptions(), nullptr);
  return cut;
}

IOStatus LogFileSystem::NewWritableFile(const std::string& name,
                                        const rocksdb::FileOptions& options,
                                        std::unique_ptr<rocksdb::FSWritableFile>* result,
                                        IODebugContext* debug) {
  const IOStatus opened = FileSystemWrapper::NewWritableFile(name, options, result, debug);
  if (!opened.ok()) return opened;
  if (!name.starts_with(directory_ + "/") || !name.ends_with(".log")) {
    *result = std::make_unique<File>(*this, std::move(*result));
    return opened;
  }
  *result = std::make_unique<Log>(*this, name, std::move(*result));
  return opened;
}

IOStatus LogFileSystem::NewDirectory(const std::string& name, const IOOptions& options,
                                     std::unique_ptr<rocksdb::FSDirectory>* result,
                                     IODebugContext* debug) {
  const IOStatus opened = FileSystemWrapper::NewDirectory(name, options, result, debug);
  if (opened.ok()) *result = std::make_unique<Directory>(*this, std::move(*result));
  return opened;
}

IOStatus LogFileSystem::DeleteFile(const std::string& name, const IOOptions& options,
                                   IODebugContext* debug) {
  const IOStatus deleted = FileSystemWrapper::DeleteFile(name, options, debug);
  const std::lock_guard lock(mutex_);
  if (deleted.ok()) logs_.erase(name);
  return deleted;
}

IOStatus LogFileSystem::GetFreeSpace(const std::string&, const IOOptions&, uint64_t*,
                                     IODebugContext*) {
  return IOStatus::NotSupported("not to be known");
}

}  // namespace hulld::server
