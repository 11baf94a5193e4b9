#include "server/admin/backup_stream.h"

#include <absl/strings/str_cat.h>
#include <spdlog/spdlog.h>
#include <zlib.h>

#include <algorithm>
#include <filesystem>
#include <utility>

#include "server/contract/error_info.h"
#include "server/settings/config.h"
#include "server/store/store_keys.h"
#include "server/wire/encode.h"

namespace hulld::server {
namespace {

// A backup contains the hulls of all callers.
absl::Status CheckSeesAll(const Caller& caller) {
  if (caller.sees_all()) return absl::OkStatus();
  return WithReason(absl::PermissionDeniedError(absl::StrCat(
                        "token \"", caller.name, "\" is limited to the prefix \"", caller.prefix,
                        "\", but a backup contains the whole store; use a token without a prefix")),
                    v1::ERROR_REASON_OUTSIDE_PREFIX, {{"prefix", caller.prefix}});
}

}  // namespace

BackupStream::~BackupStream() {
  std::error_code error;
  if (!directory_.empty()) std::filesystem::remove_all(directory_, error);
}

void BackupStream::Open() {
  if (absl::Status s = CheckSeesAll(call().caller()); !s.ok()) return FinishCall(s);
  RunOn(readers_, [this] {
    if (absl::Status s = Begin(); !s.ok()) return FinishCall(s);
    Send();
  });
}

absl::Status BackupStream::Begin() {
  absl::StatusOr<std::string> directory = store_.MakeCopy();
  if (!directory.ok()) return directory.status();
  directory_ = *std::move(directory);
  std::error_code error;
  for (auto entry = std::filesystem::recursive_directory_iterator(directory_, error);
       !error && entry != std::filesystem::recursive_directory_iterator(); entry.increment(error)) {
    if (entry->is_regular_file()) {
      files_.push_back(std::filesystem::relative(entry->path(), directory_).generic_string());
    }
  }
  if (error) {
    return absl::UnavailableError(absl::StrCat("cannot list the copy: ", error.message()));
  }
  std::sort(files_.rbegin(), files_.rend());
  spdlog::info("sending a backup of the store");
  v1::BackupBegin* begin = reply().mutable_begin();
  EncodeHeader(registry_.store(), registry_.Sizes().store_revision, begin->mutable_header());
  begin->set_version(HULLD_VERSION);
  begin->set_store_format(kStoreFormat);
  return absl::OkStatus();
}

// Runs on a reader thread because it reads files.
void BackupStream::OnSent() {
  RunOn(readers_, [this] {
    const absl::StatusOr<bool> more = NextMessage();
    if (!more.ok()) return FinishCall(more.status());
    if (!*more) {
      call().metrics().BackupSaved().SetToCurrentTime();
      return FinishCall(absl::OkStatus());
    }
    Send();
  });
}

absl::StatusOr<bool> BackupStream::NextMessage() {
  reply().Clear();
  if (!files_.empty()) return NextPiece();
  if (std::exchange(ended_, true)) return false;
  *reply().mutable_end() = totals_;
  return true;
}

absl::StatusOr<bool> BackupStream::NextPiece() {
  const std::string& path = files_.back();
  const auto failure = [&] {
    return absl::UnavailableError(absl::StrCat("cannot read ", path, " of the copy"));
  };
  if (offset_ == 0) {
    file_ = std::ifstream(directory_ + "/" + path, std::ios::binary);
    if (!file_) return failure();
  }
  v1::BackupPiece* piece = reply().mutable_piece();
  std::string& data = *piece->mutable_data();
  data.resize(Config::kReplyMessageBytes);
  file_.read(data.data(), static_cast<std::streamsize>(data.size()));
  if (file_.bad()) return failure();
  data.resize(static_cast<size_t>(file_.gcount()));
  piece->set_path(path);
  piece->set_offset(offset_);
  piece->set_crc32(
      static_cast<uint32_t>(crc32_z(0, reinterpret_cast<const Bytef*>(data.data()), data.size())));
  offset_ += data.size();
  totals_.set_piece_count(totals_.piece_count() + 1);
  totals_.set_byte_count(totals_.byte_count() + data.size());
  if (file_.eof() || file_.peek() == std::ifstream::traits_type::eof()) {
    totals_.set_file_count(totals_.file_count() + 1);
    files_.pop_back();
    offset_ = 0;
  }
  return true;
}

}  // namespace hulld::server
