#include <absl/status/status.h>
#include <absl/status/statusor.h>
#include <absl/strings/str_cat.h>
#include <spdlog/spdlog.h>
#include <zlib.h>

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "core/base/status_macros.h"
#include "hulld/v1/maintenance.grpc.pb.h"
#include "server/admin/admin_services.h"
#include "server/call/call_stream.h"
#include "server/contract/errors.h"
#include "server/settings/config.h"
#include "server/store/store_keys.h"
#include "server/wire/encode.h"

namespace hulld::server {
namespace {

// A backup contains the hulls of all callers.
absl::Status CheckSeesAll(const Caller& caller) {
  if (caller.sees_all()) return absl::OkStatus();
  return WithReason(absl::PermissionDeniedError(absl::StrCat(
                        "token \"", caller.name, "\" is limited to \"", caller.prefix,
                        "\", and a backup contains the whole store; use a token without a prefix")),
                    v1::ERROR_REASON_OUTSIDE_PREFIX, {{"prefix", caller.prefix}});
}

// One SaveBackup call: makes a copy of the store, sends its files in pieces, and removes the copy.
// Each piece is read after the previous one was sent.
class BackupStream : public RequestStream<PulledStream<WriteReactor, v1::SaveBackupResponse>,
                                          v1::SaveBackupRequest> {
 public:
  BackupStream(CallContext& context, const ServiceParts& parts, const Bytes& request)
      : RequestStream(request, context, parts.admission, Rpc::kSaveBackup), parts_(parts) {}
  ~BackupStream() override {
    std::error_code error;
    if (!directory_.empty()) std::filesystem::remove_all(directory_, error);
  }

 private:
  void Open() override {
    if (absl::Status s = CheckSeesAll(call().caller()); !s.ok()) return FinishCall(s);
    OnSent();
  }

  // Makes the copy, and the first message.
  absl::StatusOr<bool> Begin() {
    HULLD_ASSIGN_OR_RETURN(directory_, parts_.store.MakeCopy());
    std::error_code error;
    for (auto entry = std::filesystem::recursive_directory_iterator(directory_, error);
         !error && entry != std::filesystem::recursive_directory_iterator();
         entry.increment(error)) {
      if (entry->is_regular_file()) {
        files_.push_back(std::filesystem::relative(entry->path(), directory_).generic_string());
      }
    }
    if (error) {
      return Unavailable("cannot list the copy: ", error.message());
    }
    std::sort(files_.rbegin(), files_.rend());
    spdlog::info("sending a backup of the store");
    v1::BackupBegin* begin = reply().mutable_begin();
    EncodeHeader(parts_.store, parts_.registry.Sizes().store_revision, begin->mutable_header());
    begin->set_version(HULLD_VERSION);
    begin->set_store_format(kStoreFormat);
    return true;
  }

  // Runs on a reader thread, since it reads files.
  void OnSent() override {
    RunOn(parts_.long_readers, [this] {
      const absl::StatusOr<bool> more = NextMessage();
      if (!more.ok()) return FinishCall(more.status());
      if (!*more) {
        call().metrics().BackupSaved().SetToCurrentTime();
        return FinishCall(absl::OkStatus());
      }
      Send();
    });
  }

  // Fills the reply with the next part. Returns false after the last one.
  absl::StatusOr<bool> NextMessage() {
    reply().Clear();
    if (directory_.empty()) return Begin();
    if (!files_.empty()) return NextPiece();
    if (std::exchange(ended_, true)) return false;
    *reply().mutable_end() = totals_;
    return true;
  }

  absl::StatusOr<bool> NextPiece() {
    const std::string& path = files_.back();
    const auto failure = [&] { return Unavailable("cannot read ", path, " of the copy"); };
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
    piece->set_crc32(static_cast<uint32_t>(
        crc32_z(0, reinterpret_cast<const Bytef*>(data.data()), data.size())));
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

  const ServiceParts& parts_;
  std::string directory_;
  // Paths relative to directory_. The last one is sent first.
  std::vector<std::string> files_;
  std::ifstream file_;
  uint64_t offset_ = 0;
  v1::BackupEnd totals_;
  bool ended_ = false;
};

class MaintenanceService : public v1::MaintenanceService::WithRawCallbackMethod_SaveBackup<
                               v1::MaintenanceService::Service> {
 public:
  explicit MaintenanceService(const ServiceParts& parts) : parts_(parts) {}

  WriteReactor* SaveBackup(CallContext* context, const Bytes* request) override {
    return BackupStream::Launch(std::make_shared<BackupStream>(*context, parts_, *request));
  }

 private:
  const ServiceParts& parts_;
};

}  // namespace

std::unique_ptr<grpc::Service> MakeMaintenanceService(const ServiceParts& parts) {
  return std::make_unique<MaintenanceService>(parts);
}

}  // namespace hulld::server
