#include "client/backup_file.h"

#include <absl/strings/str_cat.h>
#include <fcntl.h>
#include <unistd.h>
#include <zlib.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <system_error>
#include <utility>
#include <vector>

namespace hulld {
namespace {

namespace fs = std::filesystem;

constexpr char kFirstLine[] = "hulld backup 1\n";
constexpr size_t kFirstLineBytes = sizeof kFirstLine - 1;
// Exceeds the size of every valid part; a larger size means damage.
constexpr uint32_t kMaxPartBytes = 64 << 20;

uint32_t Checksum(const std::string& bytes) {
  return static_cast<uint32_t>(
      crc32_z(0, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size()));
}

absl::Status Damaged(const std::string& what) {
  return absl::InvalidArgumentError(absl::StrCat("the backup is damaged: ", what));
}

// Returns true if the path is relative and has no ".." component.
bool IsInside(const std::string& path) {
  const fs::path parts(path);
  if (path.empty() || parts.is_absolute()) return false;
  for (const fs::path& part : parts) {
    if (part == ".." || part == "." || part.empty()) return false;
  }
  return true;
}

bool SyncPath(const std::string& path) {
  const int fd = open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (fd < 0) return false;
  const bool synced = fsync(fd) == 0;
  return close(fd) == 0 && synced;
}

void AppendNumber(uint32_t number, std::string* bytes) {
  for (int i = 0; i < 4; ++i) bytes->push_back(static_cast<char>(number >> (8 * i)));
}

bool ReadNumber(std::istream& file, uint32_t* number) {
  unsigned char bytes[4];
  if (!file.read(reinterpret_cast<char*>(bytes), sizeof bytes)) return false;
  *number = 0;
  for (int i = 3; i >= 0; --i) *number = *number << 8 | bytes[i];
  return true;
}

absl::StatusOr<v1::SaveBackupResponse> ReadPart(std::istream& file) {
  uint32_t size = 0;
  uint32_t checksum = 0;
  if (!ReadNumber(file, &size) || !ReadNumber(file, &checksum)) {
    return Damaged("it is truncated");
  }
  if (size > kMaxPartBytes) return Damaged("a part has an impossible size");
  std::string bytes(size, '\0');
  if (!file.read(bytes.data(), size)) return Damaged("it is truncated");
  v1::SaveBackupResponse part;
  if (Checksum(bytes) != checksum || !part.ParseFromString(bytes)) {
    return Damaged("the checksum of a part does not match");
  }
  return part;
}

absl::Status CannotWrite(const fs::path& path) {
  return absl::UnavailableError(
      absl::StrCat("cannot write ", path.string(), ": ", strerror(errno)));
}

// Writes the files below `directory`.
absl::Status WritePieces(std::istream& file, const std::string& directory, BackupCheck* check) {
  while (!check->complete()) {
    const absl::StatusOr<v1::SaveBackupResponse> part = ReadPart(file);
    if (!part.ok()) return part.status();
    if (absl::Status s = check->Take(*part); !s.ok()) return s;
    if (!part->has_piece()) continue;
    const v1::BackupPiece& piece = part->piece();
    const fs::path path = fs::path(directory) / piece.path();
    std::error_code error;
    fs::create_directories(path.parent_path(), error);
    std::ofstream out(path, piece.offset() == 0 ? std::ios::binary | std::ios::trunc
                                                : std::ios::binary | std::ios::app);
    out << piece.data();
    out.close();
    if (error || !out || !SyncPath(path.string())) return CannotWrite(path);
    if (!SyncPath(path.parent_path().string())) return CannotWrite(path.parent_path());
  }
  return absl::OkStatus();
}

// Staging directory of a restore. It lies within the target: the parent may not be writable, and a
// mount point cannot be replaced.
constexpr char kStagingName[] = "restoring";
// The subdirectory by which hulld recognizes a store.
constexpr char kDatabaseName[] = "rocksdb";

// Returns true if the directory contains only the remains of a killed restore and the standard
// entries of a file system root.
bool IsFree(const fs::path& directory) {
  std::error_code error;
  bool restoring = false;
  bool marked = false;
  for (const auto& entry : fs::directory_iterator(directory, error)) {
    const std::string name = entry.path().filename().string();
    if (name == kStagingName) {
      restoring = true;
    } else if (name == kRestoredMark) {
      marked = true;
    } else if (name != "lost+found") {
      return false;
    }
  }
  return !error && (!marked || restoring);
}

// Creates a directory and its missing parents. Returns the created ones, deepest first.
absl::StatusOr<std::vector<fs::path>> MakeDirectories(const fs::path& directory) {
  std::error_code error;
  std::vector<fs::path> made;
  for (fs::path path = directory; !fs::exists(path, error); path = path.parent_path()) {
    made.push_back(path);
  }
  fs::create_directories(directory, error);
  if (!error) return made;
  return absl::UnavailableError(
      absl::StrCat("cannot create ", directory.string(), ": ", error.message()));
}

// Moves the unpacked files into place, the mark first and the database last, in a single step. The
// directory therefore contains either no store, or the complete backup with the mark.
absl::Status MoveIntoPlace(const fs::path& staging, const fs::path& directory) {
  const fs::path mark = directory / kRestoredMark;
  std::ofstream(mark).close();
  if (!SyncPath(mark.string()) || !SyncPath(directory.string())) return CannotWrite(mark);
  std::error_code error;
  std::vector<fs::path> parts;
  for (const auto& entry : fs::directory_iterator(staging, error)) {
    parts.push_back(entry.path().filename());
  }
  if (error) return CannotWrite(staging);
  std::partition(parts.begin(), parts.end(),
                 [](const fs::path& part) { return part != kDatabaseName; });
  for (const fs::path& part : parts) {
    if (part == kDatabaseName && !SyncPath(directory.string())) return CannotWrite(directory);
    fs::rename(staging / part, directory / part, error);
    if (error) {
      absl::Status status = absl::UnavailableError(
          absl::StrCat("cannot create ", (directory / part).string(), ": ", error.message()));
      for (const fs::path& moved : parts) {
        if (moved == part) break;
        fs::remove_all(directory / moved, error);
      }
      return status;
    }
  }
  return absl::OkStatus();
}

// Restores from a file whose first line has been read.
absl::Status Restore(std::ifstream& file, const fs::path& target, BackupCheck* check) {
  const fs::path staging = target / kStagingName;
  std::error_code error;
  fs::remove_all(staging, error);
  fs::create_directory(staging, error);
  if (error) {
    return absl::UnavailableError(
        absl::StrCat("cannot create ", staging.string(), ": ", error.message()));
  }
  if (absl::Status s = WritePieces(file, staging.string(), check); !s.ok()) return s;
  if (file.peek() != std::ifstream::traits_type::eof()) {
    return Damaged("data follows its end");
  }
  if (absl::Status s = MoveIntoPlace(staging, target); !s.ok()) return s;
  fs::remove(staging, error);
  return SyncPath(target.string()) ? absl::OkStatus() : CannotWrite(target);
}

}  // namespace

absl::Status BackupCheck::Take(const v1::SaveBackupResponse& part) {
  if (complete_) return Damaged("data follows its end");
  if (!begun_ && !part.has_begin()) return Damaged("its header is missing");
  switch (part.part_case()) {
    case v1::SaveBackupResponse::kBegin:
      if (std::exchange(begun_, true)) return Damaged("it has two headers");
      begin_ = part.begin();
      return absl::OkStatus();
    case v1::SaveBackupResponse::kPiece:
      return TakePiece(part.piece());
    case v1::SaveBackupResponse::kEnd: {
      const v1::BackupEnd& end = part.end();
      if (end.file_count() != totals_.file_count() || end.piece_count() != totals_.piece_count() ||
          end.byte_count() != totals_.byte_count()) {
        return Damaged("pieces are missing");
      }
      complete_ = true;
      return absl::OkStatus();
    }
    case v1::SaveBackupResponse::PART_NOT_SET:
      break;
  }
  return Damaged("it contains a part of an unknown kind");
}

absl::Status BackupCheck::TakePiece(const v1::BackupPiece& piece) {
  if (piece.offset() == 0) {
    if (!IsInside(piece.path())) return Damaged("a file path points outside of the directory");
    path_ = piece.path();
    file_bytes_ = 0;
    totals_.set_file_count(totals_.file_count() + 1);
  }
  if (piece.path() != path_ || piece.offset() != file_bytes_) {
    return Damaged(absl::StrCat("a piece of ", piece.path(), " is missing"));
  }
  if (Checksum(piece.data()) != piece.crc32()) {
    return Damaged(absl::StrCat("the checksum of a piece of ", piece.path(), " does not match"));
  }
  file_bytes_ += piece.data().size();
  totals_.set_piece_count(totals_.piece_count() + 1);
  totals_.set_byte_count(totals_.byte_count() + piece.data().size());
  return absl::OkStatus();
}

BackupWriter::BackupWriter(std::string path)
    : path_(std::move(path)), partial_path_(path_ + ".partial") {}

BackupWriter::~BackupWriter() {
  std::error_code error;
  if (opened_) fs::remove(partial_path_, error);
}

absl::Status BackupWriter::Open() {
  std::error_code error;
  if (fs::exists(path_, error)) {
    return absl::InvalidArgumentError(absl::StrCat(path_, " exists; choose another file name"));
  }
  file_.open(partial_path_, std::ios::binary | std::ios::trunc);
  file_ << kFirstLine;
  if (!file_) {
    return absl::InvalidArgumentError(
        absl::StrCat("cannot write ", partial_path_, ": ", strerror(errno)));
  }
  opened_ = true;
  return absl::OkStatus();
}

absl::Status BackupWriter::Write(const v1::SaveBackupResponse& part) {
  if (absl::Status s = check_.Take(part); !s.ok()) return s;
  const std::string bytes = part.SerializeAsString();
  std::string head;
  AppendNumber(static_cast<uint32_t>(bytes.size()), &head);
  AppendNumber(Checksum(bytes), &head);
  file_ << head << bytes;
  if (file_) return absl::OkStatus();
  return absl::InvalidArgumentError(
      absl::StrCat("cannot write ", partial_path_, ": ", strerror(errno)));
}

absl::Status BackupWriter::Finish() {
  if (!check_.complete()) return Damaged("it is truncated");
  file_.close();
  std::error_code error;
  if (!file_ || !SyncPath(partial_path_)) {
    return absl::InvalidArgumentError(
        absl::StrCat("cannot write ", partial_path_, ": ", strerror(errno)));
  }
  fs::rename(partial_path_, path_, error);
  if (error) return absl::InvalidArgumentError(absl::StrCat(path_, ": ", error.message()));
  SyncPath(fs::absolute(path_, error).parent_path().string());
  opened_ = false;
  return absl::OkStatus();
}

absl::StatusOr<BackupCheck> RestoreBackup(const std::string& path, const std::string& directory) {
  std::ifstream file(path, std::ios::binary);
  if (!file) {
    return absl::InvalidArgumentError(absl::StrCat("cannot open ", path, ": ", strerror(errno)));
  }
  std::string line(kFirstLineBytes, '\0');
  file.read(line.data(), static_cast<std::streamsize>(line.size()));
  if (line != kFirstLine) {
    return absl::InvalidArgumentError(absl::StrCat(path, " is not a hulld backup"));
  }
  std::error_code error;
  const fs::path target =
      fs::absolute(fs::path(directory) / ".", error).lexically_normal().parent_path();
  if (error) {
    return absl::InvalidArgumentError(
        absl::StrCat("cannot find ", directory, ": the current directory does not exist"));
  }
  if (fs::exists(target, error) && !IsFree(target)) {
    return absl::FailedPreconditionError(
        absl::StrCat(directory, " exists and is not empty; choose a new directory"));
  }
  const absl::StatusOr<std::vector<fs::path>> made = MakeDirectories(target);
  if (!made.ok()) return made.status();
  BackupCheck check;
  const absl::Status status = Restore(file, target, &check);
  if (!status.ok()) {
    // A store without its mark must never remain.
    if (!fs::exists(target / kDatabaseName, error)) fs::remove(target / kRestoredMark, error);
    fs::remove_all(target / kStagingName, error);
    if (!made->empty()) fs::remove(target, error);
    return status;
  }
  for (const fs::path& entry : *made) {
    if (!SyncPath(entry.parent_path().string())) return CannotWrite(entry.parent_path());
  }
  return check;
}

}  // namespace hulld
