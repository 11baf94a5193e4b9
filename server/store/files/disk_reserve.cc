#include "server/store/files/disk_reserve.h"

#include <algorithm>
#include <memory>

namespace hulld::server {
namespace {

using rocksdb::IOOptions;
using rocksdb::IOStatus;

IOStatus TakeRoom(rocksdb::FSWritableFile& file, uint64_t bytes) {
  IOStatus status = file.Allocate(0, bytes, IOOptions(), nullptr);
  if (status.ok() || status.IsNoSpace()) return status;
  const std::string zeros(size_t{1} << 20, '\0');
  status = IOStatus::OK();
  for (uint64_t left = bytes; left > 0 && status.ok();) {
    const size_t piece = std::min<uint64_t>(left, zeros.size());
    status = file.Append({zeros.data(), piece}, IOOptions(), nullptr);
    left -= piece;
  }
  return status;
}

}  // namespace

IOStatus DiskReserve::Ensure() {
  if (is_made_) return IOStatus::OK();
  is_made_ = files_.FileExists(path_, IOOptions(), nullptr).ok();
  if (is_made_) return IOStatus::OK();
  // Renamed only after all of its space is allocated.
  const std::string unfinished = path_ + ".new";
  std::unique_ptr<rocksdb::FSWritableFile> file;
  IOStatus status = files_.NewWritableFile(unfinished, rocksdb::FileOptions(), &file, nullptr);
  if (status.ok()) status = TakeRoom(*file, bytes_);
  if (status.ok()) status = file->Close(IOOptions(), nullptr);
  if (status.ok()) status = files_.RenameFile(unfinished, path_, IOOptions(), nullptr);
  is_made_ = status.ok();
  file = nullptr;
  if (!is_made_) files_.DeleteFile(unfinished, IOOptions(), nullptr).PermitUncheckedError();
  return status;
}

bool DiskReserve::Release() {
  is_made_ = false;
  return files_.DeleteFile(path_, IOOptions(), nullptr).ok();
}

}  // namespace hulld::server
