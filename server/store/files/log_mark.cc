#include "server/store/files/log_mark.h"

#include <absl/strings/numbers.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <filesystem>
#include <iterator>
#include <memory>
#include <string_view>
#include <utility>
#include <vector>

#include "core/base/status_macros.h"
#include "server/contract/errors.h"

namespace hulld::server {
namespace {

using rocksdb::FileOptions;
using rocksdb::IOOptions;
using rocksdb::IOStatus;

// A slot: generation, revision, number of logs; number, size and CRC-32 of each; zeros; number,
// size, and CRC-32 of the manifest; and the CRC-32 of all of these. It fills one sector, which
// disks write as a whole.
constexpr size_t kSlotWords = 64;
using Slot = std::array<uint64_t, kSlotWords>;
static_assert(sizeof(Slot) == 512);
// The slots are in different pages, so that the kernel writes one without the other.
constexpr uint64_t kSlotDistance = 4096;
constexpr size_t kHeadWords = 3;
constexpr size_t kLogWords = 3;
constexpr size_t kManifestWord = kSlotWords - 1 - kLogWords;
constexpr size_t kMaxLogs = (kManifestWord - kHeadWords) / kLogWords;

uint32_t Crc32(uint32_t crc, std::string_view bytes) {
  return static_cast<uint32_t>(
      crc32_z(crc, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size()));
}

std::string_view Bytes(const Slot& slot) {
  return {reinterpret_cast<const char*>(slot.data()), sizeof(Slot)};
}

uint64_t ChecksumOf(const Slot& slot) {
  return Crc32(0, Bytes(slot).substr(0, sizeof(Slot) - sizeof(uint64_t)));
}

// Encodes only the newest logs if the slot cannot hold all of them. RocksDB keeps one to three.
Slot Encode(const LogMark& mark) {
  const size_t count = std::min(mark.logs.size(), kMaxLogs);
  Slot slot = {mark.generation, mark.revision, count};
  auto log = std::prev(mark.logs.end(), static_cast<std::ptrdiff_t>(count));
  for (size_t word = kHeadWords; log != mark.logs.end(); ++log, word += kLogWords) {
    slot[word] = log->first;
    slot[word + 1] = log->second.size;
    slot[word + 2] = log->second.crc32;
  }
  slot[kManifestWord] = mark.manifest;
  slot[kManifestWord + 1] = mark.manifest_synced.size;
  slot[kManifestWord + 2] = mark.manifest_synced.crc32;
  slot.back() = ChecksumOf(slot);
  return slot;
}

// None if the slot was never written, or is damaged.
std::optional<LogMark> Decode(const Slot& slot) {
  if (slot.back() != ChecksumOf(slot) || slot[0] == 0 || slot[2] > kMaxLogs) return std::nullopt;
  LogMark mark;
  mark.generation = slot[0];
  mark.revision = slot[1];
  mark.manifest = slot[kManifestWord];
  mark.manifest_synced = {slot[kManifestWord + 1], static_cast<uint32_t>(slot[kManifestWord + 2])};
  for (size_t i = 0; i < slot[2]; ++i) {
    const uint64_t* const log = &slot[kHeadWords + i * kLogWords];
    mark.logs[log[0]] = {log[1], static_cast<uint32_t>(log[2])};
  }
  return mark;
}

absl::Status CannotRead(const std::string& path, const IOStatus& status) {
  return Unavailable("cannot read ", path, ": ", status.ToString());
}

// Returns a description of the difference; empty if the file starts with these bytes.
absl::StatusOr<std::string> Compare(rocksdb::FileSystem& files, const std::string& path,
                                    const LogMark::Synced& synced) {
  const std::string name = absl::StrCat(LogNumber(path).has_value() ? "the log " : "the file ",
                                        std::filesystem::path(path).filename().string());
  const auto failure = [&](const IOStatus& status) { return CannotRead(path, status); };
  if (files.FileExists(path, IOOptions(), nullptr).IsNotFound()) {
    return absl::StrCat(name, " is missing");
  }
  std::unique_ptr<rocksdb::FSSequentialFile> file;
  IOStatus status = files.NewSequentialFile(path, FileOptions(), &file, nullptr);
  if (!status.ok()) return failure(status);
  uint64_t size = 0;
  uint32_t crc32 = 0;
  std::string scratch(size_t{1} << 20, '\0');
  while (size < synced.size) {
    const size_t wanted = std::min<uint64_t>(scratch.size(), synced.size - size);
    rocksdb::Slice read;
    status = file->Read(wanted, IOOptions(), &read, scratch.data(), nullptr);
    if (!status.ok()) return failure(status);
    if (read.empty()) {
      return absl::StrCat(name, " has ", size, " bytes of ", synced.size);
    }
    size += read.size();
    crc32 = Crc32(crc32, {read.data(), read.size()});
  }
  if (crc32 == synced.crc32) return std::string();
  return absl::StrCat("the contents of ", name, " differ from what was written");
}

}  // namespace

IOStatus SyncDirectory(rocksdb::FileSystem& files, const std::string& directory) {
  std::unique_ptr<rocksdb::FSDirectory> opened;
  const IOStatus status = files.NewDirectory(directory, IOOptions(), &opened, nullptr);
  return status.ok() ? opened->Fsync(IOOptions(), nullptr) : status;
}

std::string LogPath(const std::string& directory, uint64_t number) {
  return absl::StrFormat("%s/%06u.log", directory, number);
}

std::optional<uint64_t> LogNumber(const std::string& path) {
  const std::filesystem::path file(path);
  uint64_t number = 0;
  const bool is_log = file.extension() == ".log" && absl::SimpleAtoi(file.stem().string(), &number);
  return is_log ? std::optional(number) : std::nullopt;
}

std::string ManifestPath(const std::string& directory, uint64_t number) {
  return absl::StrFormat("%s/MANIFEST-%06u", directory, number);
}

std::optional<uint64_t> ManifestNumber(const std::string& path) {
  constexpr std::string_view kPrefix = "MANIFEST-";
  const std::string name = std::filesystem::path(path).filename();
  uint64_t number = 0;
  const bool is_manifest =
      name.starts_with(kPrefix) && absl::SimpleAtoi(name.substr(kPrefix.size()), &number);
  return is_manifest ? std::optional(number) : std::nullopt;
}

std::string CurrentPath(const std::string& directory) { return directory + "/CURRENT"; }

absl::StatusOr<std::optional<uint64_t>> ReadCurrent(rocksdb::FileSystem& files,
                                                    const std::string& directory) {
  const std::string path = CurrentPath(directory);
  const IOStatus exists = files.FileExists(path, IOOptions(), nullptr);
  if (exists.IsNotFound()) return absl::NotFoundError(path);
  std::string content;
  const IOStatus read = rocksdb::ReadFileToString(&files, path, &content);
  if (!read.ok()) return CannotRead(path, read);
  if (!content.ends_with('\n')) return std::nullopt;
  content.pop_back();
  return ManifestNumber(content);
}

absl::StatusOr<std::string> FindLostManifest(rocksdb::FileSystem& files,
                                             const std::string& directory,
                                             const std::optional<LogMark>& mark) {
  const absl::StatusOr<std::optional<uint64_t>> current = ReadCurrent(files, directory);
  if (absl::IsNotFound(current.status())) {
    // The first start writes CURRENT before any table, log, or mark.
    std::vector<std::string> names;
    files.GetChildren(directory, IOOptions(), &names, nullptr).PermitUncheckedError();
    const bool has_data = std::ranges::any_of(names, [](const std::string& name) {
      return LogNumber(name).has_value() || name.ends_with(".sst");
    });
    return has_data || mark.has_value() ? "the file CURRENT is missing" : std::string();
  }
  if (!current.ok()) return current.status();
  if (!current->has_value()) return "the file CURRENT is damaged";
  const uint64_t number = **current;
  const uint64_t marked = mark.has_value() ? mark->manifest : 0;
  if (number < marked) {
    return absl::StrFormat("the file CURRENT names MANIFEST-%06u instead of MANIFEST-%06u", number,
                           marked);
  }
  // The mark of a new manifest may not have been written.
  return Compare(files, ManifestPath(directory, number),
                 number == marked ? mark->manifest_synced : LogMark::Synced());
}

absl::StatusOr<std::optional<LostLog>> FindLostLog(rocksdb::FileSystem& files,
                                                   const std::string& directory,
                                                   const LogMark& mark) {
  for (const auto& [number, synced] : mark.logs) {
    HULLD_ASSIGN_OR_RETURN(std::string finding, Compare(files, LogPath(directory, number), synced));
    if (!finding.empty()) return LostLog{number, std::move(finding)};
  }
  return std::nullopt;
}

absl::StatusOr<std::optional<LogMark>> ReadLogMark(rocksdb::FileSystem& files,
                                                   const std::string& path) {
  const IOStatus exists = files.FileExists(path, IOOptions(), nullptr);
  if (exists.IsNotFound()) return std::nullopt;
  std::string content;
  const IOStatus read = rocksdb::ReadFileToString(&files, path, &content);
  if (!read.ok()) return CannotRead(path, read);
  std::optional<LogMark> newest;
  for (const uint64_t offset : {uint64_t{0}, kSlotDistance}) {
    if (content.size() < offset + sizeof(Slot)) continue;
    Slot slot;
    std::memcpy(slot.data(), content.data() + offset, sizeof(Slot));
    std::optional<LogMark> mark = Decode(slot);
    if (!mark.has_value()) continue;
    if (!newest.has_value() || mark->generation > newest->generation) newest = std::move(mark);
  }
  if (!newest.has_value()) return absl::DataLossError(absl::StrCat(path, " is damaged"));
  return newest;
}

// Renamed only after it is complete and on disk.
IOStatus MakeLogMark(rocksdb::FileSystem& files, const std::string& path, const LogMark& mark) {
  const std::string unfinished = path + ".new";
  std::string content(2 * kSlotDistance, '\0');
  content.replace(0, sizeof(Slot), Bytes(Encode(mark)));
  IOStatus status = rocksdb::WriteStringToFile(&files, content, unfinished, /*should_sync=*/true);
  if (status.ok()) status = files.RenameFile(unfinished, path, IOOptions(), nullptr);
  return status.ok() ? SyncDirectory(files, std::filesystem::path(path).parent_path()) : status;
}

IOStatus WriteLogMark(rocksdb::FSRandomRWFile& file, const LogMark& mark) {
  const Slot slot = Encode(mark);
  return file.Write(mark.generation % 2 * kSlotDistance, {Bytes(slot).data(), sizeof(Slot)},
                    IOOptions(), nullptr);
}

}  // namespace hulld::server
