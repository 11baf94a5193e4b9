#include "server/admin/doctor.h"

#include <absl/status/status.h>
#include <absl/strings/str_cat.h>

#include <algorithm>
#include <cstdio>
#include <iostream>
#include <iterator>
#include <memory>
#include <optional>
#include <utility>

#include "core/base/status_macros.h"
#include "core/hull/audit.h"
#include "core/hull/growth/hull_builder.h"
#include "server/process/log.h"
#include "server/registry/memory/hull_loader.h"
#include "server/settings/subcommand.h"
#include "server/store/rocksdb_store.h"

namespace hulld::server {
namespace {

constexpr int kExitDamaged = 1;
constexpr int kExitUsage = 2;

struct Finding {
  // The ID of a hull, or of a body.
  std::string hull_id;
  std::string what;
};

struct Report {
  std::string store_id;
  uint64_t revision = 0;
  uint64_t hulls = 0;
  uint64_t vertices = 0;
  uint64_t bodies = 0;
  std::vector<Finding> findings;
  // Error that prevented reading the hulls.
  std::string failure;
};

absl::Status Examine(RocksDbStore& store, const StoredHull& stored) {
  HULLD_ASSIGN_OR_RETURN(const std::vector<Vector> points, store.LoadVertices(stored));
  const absl::StatusOr<std::unique_ptr<HullBuilder>> builder =
      BuildHull(stored.record, points, /*should_stop=*/{});
  return builder.ok() ? AuditHull((*builder)->Snapshot()) : builder.status();
}

Report ExamineAll(RocksDbStore& store) {
  Report report;
  report.store_id = store.id();
  report.revision = store.revision();
  std::vector<std::pair<std::string, absl::StatusOr<StoredHull>>> hulls;
  std::vector<Finding> of_bodies;
  const absl::Status read = store.ForEachRecord(
      [&](const std::string& id, absl::StatusOr<StoredHull> stored) {
        hulls.emplace_back(id, std::move(stored));
      },
      [&](const std::string& id, const absl::StatusOr<StoredBody>& stored) {
        ++report.bodies;
        if (!stored.ok()) of_bodies.push_back({id, std::string(stored.status().message())});
      });
  for (const auto& [id, stored] : hulls) {
    ++report.hulls;
    const absl::Status status = stored.ok() ? Examine(store, *stored) : stored.status();
    if (stored.ok()) report.vertices += stored->record.vertex_count;
    if (!status.ok()) report.findings.push_back({id, std::string(status.message())});
  }
  std::ranges::move(of_bodies, std::back_inserter(report.findings));
  if (!read.ok()) report.failure = std::string(read.message());
  return report;
}

std::string JsonText(const std::string& text) { return "\"" + JsonEscape(text) + "\""; }

void PrintJson(const Report& report) {
  std::string findings;
  for (const Finding& finding : report.findings) {
    absl::StrAppend(&findings, findings.empty() ? "" : ",",
                    "{\"hullId\":", JsonText(finding.hull_id),
                    ",\"finding\":", JsonText(finding.what), "}");
  }
  const std::string text =
      absl::StrCat("{\"storeId\":", JsonText(report.store_id), ",\"revision\":\"", report.revision,
                   "\",\"hulls\":\"", report.hulls, "\",\"vertices\":\"", report.vertices,
                   "\",\"bodies\":\"", report.bodies, "\",\"damaged\":[", findings,
                   "],\"failure\":", JsonText(report.failure), "}\n");
  std::fputs(text.c_str(), stdout);
}

void PrintText(const Report& report) {
  for (const Finding& finding : report.findings) {
    std::printf("DAMAGED  %s\n         %s\n", finding.hull_id.c_str(), finding.what.c_str());
  }
  if (!report.failure.empty()) std::printf("FAILED   %s\n", report.failure.c_str());
  const auto counted = [](uint64_t count, const char* one, const char* many) {
    return absl::StrCat(count, " ", count == 1 ? one : many);
  };
  const std::string bodies =
      report.bodies == 0 ? "" : ", " + counted(report.bodies, "body", "bodies");
  const std::string summary =
      absl::StrCat("store ", report.store_id, " at revision ", report.revision, ": ",
                   counted(report.hulls, "hull", "hulls"), " with ",
                   counted(report.vertices, "vertex", "vertices"), bodies, ", ",
                   report.findings.size(), " damaged\n");
  std::fputs(summary.c_str(), stdout);
}

}  // namespace

int RunDoctor(const std::vector<std::string>& arguments) {
  RocksDbOptions options;
  options.read_only = true;
  bool json = false;
  bool accept_loss = false;
  const Subcommand command = {
      "hulld doctor",
      "Audits every hull and body of a store that no hulld has open.",
      {{"--data-dir", &options.data_dir, "Directory of the store", "HULLD_DATA_DIR"},
       {"--json", &json, "Print one JSON object"},
       {"--accept-loss", &accept_loss,
        "Accept the loss of acknowledged changes if the log is damaged or truncated. The store "
        "gets a new ID. Without this flag, nothing is changed"}},
      "Exit status: 0 the store is sound, 1 it is damaged, 2 it could not be opened or the "
      "arguments are wrong."};
  if (const std::optional<int> exit = command.Parse(arguments, std::cout, std::cerr)) return *exit;
  if (options.data_dir.empty()) {
    std::cerr << "hulld doctor: set --data-dir\n";
    return kExitUsage;
  }
  absl::StatusOr<std::unique_ptr<RocksDbStore>> store = RocksDbStore::Open(options);
  if (accept_loss && absl::IsDataLoss(store.status())) {
    RocksDbOptions accepting = options;
    accepting.read_only = false;
    accepting.accept_loss = true;
    const absl::Status accepted = RocksDbStore::Open(std::move(accepting)).status();
    store = accepted.ok() ? RocksDbStore::Open(options) : accepted;
  }
  if (!store.ok()) {
    std::fprintf(stderr, "hulld doctor: %s\n", std::string(store.status().message()).c_str());
    return absl::IsDataLoss(store.status()) ? kExitDamaged : kExitUsage;
  }
  const Report report = ExamineAll(**store);
  json ? PrintJson(report) : PrintText(report);
  return report.findings.empty() && report.failure.empty() ? 0 : kExitDamaged;
}

}  // namespace hulld::server
