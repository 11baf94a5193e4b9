#include "server/store/files/log_file_system.h"

#include <fcntl.h>
#include <spdlog/spdlog.h>
#include <sys/file.h>
#include <unistd.h>
#include <zlib.h>

#include <cerrno>
#include <cstring>
#include <utility>

namespace hulld::server {

using rocksdb::IODebugContext;
using rocksdb::IOOptions;
using rocksdb::IOStatus;

namespace {

void Extend(LogMark::Synced& written, const rocksdb::Slice& data) {
  written.size += data.size();
  written.crc32 = static_cast<uint32_t>(
      crc32_z(written.crc32, reinterpret_cast<const Bytef*>(data.data()), data.size()));
}

}  // namespace

// A file open for writing. Counts its failed syncs.
class LogFileSystem::File : public rocksdb::FSWritableFileOwnerWrapper {
 public:
  File(LogFileSystem& system, std::unique_ptr<rocksdb::FSWritableFile> file)
      : FSWritableFileOwnerWrapper(std::move(file)), system_(system) {}

  IOStatus Append(const rocksdb::Slice& data, const IOOptions& options,
                  IODebugContext* debug) override {
    if (is_cut_) return AlreadyCut();
    return NoteAppended(data, FSWritableFileOwnerWrapper::Append(data, options, debug));
  }
  IOStatus Append(const rocksdb::Slice& data, const IOOptions& options,
                  const rocksdb::DataVerificationInfo& info, IODebugContext* debug) override {
    if (is_cut_) return AlreadyCut();
    return NoteAppended(data, FSWritableFileOwnerWrapper::Append(data, options, info, debug));
  }
  IOStatus Sync(const IOOptions& options, IODebugContext* debug) override {
    return NoteSynced(FSWritableFileOwnerWrapper::Sync(options, debug));
  }
  IOStatus Fsync(const IOOptions& options, IODebugContext* debug) override {
    return NoteSynced(FSWritableFileOwnerWrapper::Fsync(options, debug));
  }

 protected:
  // Record an operation and return its result.
  virtual IOStatus NoteAppended(const rocksdb::Slice& /*data*/, const IOStatus& status) {
    return status;
  }
  virtual IOStatus NoteSynced(const IOStatus& status) { return system_.NoteSync(status); }

  LogFileSystem& system_;
  // True after Log::CutTo: appends are refused.
  std::atomic<bool> is_cut_ = false;

 private:
  static IOStatus AlreadyCut() { return IOStatus::IOError("the log was truncated after an error"); }
};

class LogFileSystem::Directory : public rocksdb::FSDirectoryWrapper {
 public:
  Directory(LogFileSystem& system, std::unique_ptr<rocksdb::FSDirectory> directory)
      : FSDirectoryWrapper(std::move(directory)), system_(system) {}

  IOStatus Fsync(const IOOptions& options, IODebugContext* debug) override {
    return NoteSynced(FSDirectoryWrapper::Fsync(options, debug));
  }
  IOStatus FsyncWithDirOptions(const IOOptions& options, IODebugContext* debug,
                               const rocksdb::DirFsyncOptions& directory) override {
    return NoteSynced(FSDirectoryWrapper::FsyncWithDirOptions(options, debug, directory));
  }

 private:
  IOStatus NoteSynced(const IOStatus& status) {
    if (status.ok()) system_.NoteCurrent();
    return system_.NoteSync(status);
  }

  LogFileSystem& system_;
};

class LogFileSystem::Log : public File {
 public:
  Log(LogFileSystem& system, std::string name, std::unique_ptr<rocksdb::FSWritableFile> file)
      : File(system, std::move(file)), name_(std::move(name)) {
    const std::lock_guard lock(system_.mutex_);
    system_.logs_[name_] = {{}, {}, this};
  }
  ~Log() override {
    const std::lock_guard lock(system_.mutex_);
    const auto log = system_.logs_.find(name_);
    if (log != system_.logs_.end() && log->second.open == this) log->second.open = nullptr;
  }

  // Truncates the open file itself, because RocksDB sets the size that it has recorded when it
  // closes the file.
  IOStatus CutTo(uint64_t size) {
    is_cut_ = true;
    IOStatus cut = FSWritableFileOwnerWrapper::Truncate(size, IOOptions(), nullptr);
    // Calls the base class: this sync does not count, as RocksDB did not request it.
    // NOLINTNEXTLINE(bugprone-parent-virtual-call)
    if (cut.ok()) cut = FSWritableFileOwnerWrapper::Sync(IOOptions(), nullptr);
    return cut;
  }

 private:
  // A failed call may have written any part of the data; none of it will be committed.
  IOStatus NoteAppended(const rocksdb::Slice& data, const IOStatus& status) override {
    const std::lock_guard lock(system_.mutex_);
    Extend(system_.logs_[name_].written, data);
    return status;
  }

  const std::string name_;
};

// RocksDB abandons a manifest after a failed write.
class LogFileSystem::Manifest : public File {
 public:
  Manifest(LogFileSystem& system, uint64_t number, std::unique_ptr<rocksdb::FSWritableFile> file)
      : File(system, std::move(file)), number_(number) {}

 private:
  IOStatus NoteAppended(const rocksdb::Slice& data, const IOStatus& status) override {
    Extend(written_, data);
    is_whole_ = is_whole_ && status.ok();
    return status;
  }
  IOStatus NoteSynced(const IOStatus& status) override {
    is_whole_ = is_whole_ && status.ok();
    if (is_whole_) system_.NoteManifest(number_, written_);
    return File::NoteSynced(status);
  }

  const uint64_t number_;
  LogMark::Synced written_;
  bool is_whole_ = true;
};

IOStatus LogFileSystem::NoteSync(const IOStatus& status) {
  if (!status.ok()) ++failed_syncs_;
  return status;
}

bool LogFileSystem::IsLog(const std::string& name) const {
  return name.starts_with(directory_ + "/") && name.ends_with(".log");
}

void LogFileSystem::NoteCommitted() {
  for (const auto& [name, log] : logs_) {
    const std::optional<uint64_t> number = LogNumber(name);
    if (number.has_value() && log.committed.size > 0) mark_.logs[*number] = log.committed;
  }
}

// If a write fails, the mark remains a lower bound. Logs only the first of successive failures.
void LogFileSystem::WriteMark() {
  mark_changed_ = true;
  ++mark_.generation;
  const IOStatus written = WriteLogMark(*mark_file_, mark_);
  if (!std::exchange(mark_fails_, !written.ok()) && !written.ok()) {
    spdlog::error("cannot update the log mark, which is now stale: {}", written.ToString());
  }
}

void LogFileSystem::Commit(uint64_t revision, bool is_synced) {
  const std::lock_guard lock(mutex_);
  for (auto& [name, log] : logs_) log.committed = log.written;
  if (!is_synced || mark_file_ == nullptr) return;
  mark_.revision = revision;
  NoteCommitted();
  WriteMark();
}

IOStatus LogFileSystem::SyncMark() {
  std::shared_ptr<rocksdb::FSRandomRWFile> file;
  {
    const std::lock_guard lock(mutex_);
    if (!std::exchange(mark_changed_, false)) return IOStatus::OK();
    file = mark_file_;
  }
  const IOStatus synced = file->Sync(IOOptions(), nullptr);
  if (!synced.ok()) {
    const std::lock_guard lock(mutex_);
    mark_changed_ = true;
  }
  return synced;
}

IOStatus LogFileSystem::ResumeMark(const std::string& path, LogMark mark) {
  std::unique_ptr<rocksdb::FSRandomRWFile> file;
  IOStatus opened = target()->NewRandomRWFile(path, rocksdb::FileOptions(), &file, nullptr);
  if (!opened.ok()) return opened;
  const std::lock_guard lock(mutex_);
  mark_ = std::move(mark);
  mark_file_ = std::move(file);
  return opened;
}

IOStatus LogFileSystem::StartMark(const std::string& path, uint64_t revision) {
  LogMark mark;
  {
    const std::lock_guard lock(mutex_);
    mark_.generation = 1;
    mark_.revision = revision;
    mark_.logs.clear();
    NoteCommitted();
    mark = mark_;
  }
  const IOStatus made = MakeLogMark(*target(), path, mark);
  return made.ok() ? ResumeMark(path, std::move(mark)) : made;
}

bool LogFileSystem::keeps_mark() const {
  const std::lock_guard lock(mutex_);
  return mark_file_ != nullptr;
}

IOStatus LogFileSystem::CutUncommitted() {
  const std::lock_guard lock(mutex_);
  for (auto& [name, log] : logs_) {
    if (log.committed == log.written) continue;
    const IOStatus cut = log.open != nullptr ? log.open->CutTo(log.committed.size) : Cut(name, log);
    if (!cut.ok()) return cut;
    log.written = log.committed;
  }
  return IOStatus::OK();
}

// Truncates a closed log.
IOStatus LogFileSystem::Cut(const std::string& name, const LogState& log) {
  std::unique_ptr<rocksdb::FSWritableFile> file;
  IOStatus cut = ReopenWritableFile(name, rocksdb::FileOptions(), &file, nullptr);
  if (cut.ok()) cut = file->Truncate(log.committed.size, IOOptions(), nullptr);
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
  const std::optional<uint64_t> manifest = ManifestNumber(name);
  if (IsLog(name)) {
    *result = std::make_unique<Log>(*this, name, std::move(*result));
  } else if (manifest.has_value() && name == ManifestPath(directory_, *manifest)) {
    *result = std::make_unique<Manifest>(*this, *manifest, std::move(*result));
  } else {
    *result = std::make_unique<File>(*this, std::move(*result));
  }
  return opened;
}

void LogFileSystem::NoteManifest(uint64_t number, const LogMark::Synced& synced) {
  const std::lock_guard lock(mutex_);
  newest_manifest_ = number;
  newest_manifest_synced_ = synced;
  if (number != mark_.manifest) return;
  mark_.manifest_synced = synced;
  if (mark_file_ != nullptr) WriteMark();
}

IOStatus LogFileSystem::RenameFile(const std::string& from, const std::string& to,
                                   const IOOptions& options, IODebugContext* debug) {
  const IOStatus renamed = FileSystemWrapper::RenameFile(from, to, options, debug);
  if (renamed.ok() && to == CurrentPath(directory_)) is_current_new_ = true;
  return renamed;
}

// RocksDB syncs a new manifest, renames a file that names it to CURRENT, and syncs the directory.
// Only then does a power failure leave the new manifest in force.
void LogFileSystem::NoteCurrent() {
  if (!is_current_new_.exchange(false)) return;
  const absl::StatusOr<std::optional<uint64_t>> current = ReadCurrent(*target(), directory_);
  const std::lock_guard lock(mutex_);
  if (!current.ok() || *current != newest_manifest_) return;
  mark_.manifest = newest_manifest_;
  mark_.manifest_synced = newest_manifest_synced_;
  if (mark_file_ != nullptr) WriteMark();
}

IOStatus LogFileSystem::NewDirectory(const std::string& name, const IOOptions& options,
                                     std::unique_ptr<rocksdb::FSDirectory>* result,
                                     IODebugContext* debug) {
  const IOStatus opened = FileSystemWrapper::NewDirectory(name, options, result, debug);
  if (opened.ok()) *result = std::make_unique<Directory>(*this, std::move(*result));
  return opened;
}

// The mark is on disk before the log is deleted.
IOStatus LogFileSystem::Forget(const std::string& name) {
  {
    const std::lock_guard lock(mutex_);
    logs_.erase(name);
    const std::optional<uint64_t> number = LogNumber(name);
    if (!number.has_value() || mark_.logs.erase(*number) == 0 || mark_file_ == nullptr) {
      return IOStatus::OK();
    }
    WriteMark();
  }
  return SyncMark();
}

IOStatus LogFileSystem::DeleteFile(const std::string& name, const IOOptions& options,
                                   IODebugContext* debug) {
  if (IsLog(name)) {
    if (IOStatus forgotten = Forget(name); !forgotten.ok()) return forgotten;
  }
  return FileSystemWrapper::DeleteFile(name, options, debug);
}

IOStatus LogFileSystem::LockFile(const std::string& name, const IOOptions& options,
                                 rocksdb::FileLock** lock, IODebugContext* debug) {
  if (IOStatus locked = LockDirectory(); !locked.ok()) return locked;
  IOStatus status = FileSystemWrapper::LockFile(name, options, lock, debug);
  if (!status.ok()) UnlockDirectory();
  if (!status.ok() || !locked_) return status;
  status = locked_();
  if (!status.ok()) {
    UnlockFile(*lock, options, debug).PermitUncheckedError();
    *lock = nullptr;
  }
  return status;
}

IOStatus LogFileSystem::UnlockFile(rocksdb::FileLock* lock, const IOOptions& options,
                                   IODebugContext* debug) {
  UnlockDirectory();
  return FileSystemWrapper::UnlockFile(lock, options, debug);
}

// A file system without such locks has only the lock file.
IOStatus LogFileSystem::LockDirectory() {
  directory_lock_ = open(directory_.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (directory_lock_ < 0 || flock(directory_lock_, LOCK_EX | LOCK_NB) == 0) return IOStatus::OK();
  const int error = errno;
  UnlockDirectory();
  if (error != EWOULDBLOCK) return IOStatus::OK();
  return IOStatus::IOError("While lock file: " + directory_, std::strerror(error));
}

void LogFileSystem::UnlockDirectory() {
  if (directory_lock_ >= 0) close(directory_lock_);
  directory_lock_ = -1;
}

IOStatus LogFileSystem::GetFreeSpace(const std::string&, const IOOptions&, uint64_t*,
                                     IODebugContext*) {
  return IOStatus::NotSupported("not to be known");
}

}  // namespace hulld::server
