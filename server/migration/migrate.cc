#include <absl/strings/str_cat.h>

#include <chrono>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "core/base/status_macros.h"
#include "server/access/secret_file.h"
#include "server/contract/errors.h"
#include "server/migration/migration.h"
#include "server/process/log.h"
#include "server/settings/subcommand.h"
#include "server/store/postgres/postgres_store.h"
#include "server/store/rocksdb_store.h"
#include "server/store/store_errors.h"

namespace hulld::server {
namespace {

constexpr int kExitFailed = 1;
constexpr int kExitRefused = 2;
// Interval between progress lines.
constexpr std::chrono::seconds kPause{10};

// Source or destination of the copy, as named by options. One of the two members is set.
struct Place {
  std::string data_dir;
  std::string conninfo_file;

  bool is_one() const { return data_dir.empty() != conninfo_file.empty(); }
  bool operator==(const Place&) const = default;
  std::string Describe() const {
    return data_dir.empty() ? "PostgreSQL (" + conninfo_file + ")" : data_dir;
  }
};

// Rewords the error of opening a store for this program.
absl::Status Explain(const Place& place, const absl::Status& status) {
  if (status.ok()) return status;
  if (absl::IsCancelled(status)) {
    return absl::FailedPreconditionError(absl::StrCat(
        place.Describe(), ": a hulld is active on this database; stop every hulld that uses it"));
  }
  return Prefixed(absl::StrCat(place.Describe(), ": "), status);
}

absl::StatusOr<std::unique_ptr<Store>> OpenSource(const Place& place) {
  if (!place.data_dir.empty()) {
    RocksDbOptions options;
    options.data_dir = place.data_dir;
    options.read_only = true;
    return RocksDbStore::Open(std::move(options));
  }
  PostgresOptions options;
  HULLD_ASSIGN_OR_RETURN(options.conninfo,
                         ReadSecretFile(place.conninfo_file, "--from-postgres-conninfo-file"));
  options.must_exist = true;
  options.should_stop = [] { return true; };
  return PostgresStore::Open(std::move(options));
}

absl::StatusOr<std::unique_ptr<MigrationTarget>> OpenTarget(const Place& place) {
  if (!place.data_dir.empty()) return OpenRocksDbTarget(place.data_dir);
  HULLD_ASSIGN_OR_RETURN(const std::string conninfo,
                         ReadSecretFile(place.conninfo_file, "--to-postgres-conninfo-file"));
  return OpenPostgresTarget(conninfo);
}

// Prints progress at intervals.
class ProgressLines {
 public:
  explicit ProgressLines(std::ostream& err) : err_(err) {}

  void SetPhase(const char* phase) { phase_ = phase; }
  void Print(uint64_t done, uint64_t all) {
    const auto now = std::chrono::steady_clock::now();
    if (now < next_) return;
    next_ = now + kPause;
    err_ << phase_ << " " << done << " of " << all << " hulls and bodies" << std::endl;
  }

 private:
  std::ostream& err_;
  const char* phase_ = "copied";
  std::chrono::steady_clock::time_point next_ = std::chrono::steady_clock::now() + kPause;
};

std::string Describe(const MigrationCounts& counts) {
  const auto count = [](uint64_t number, const char* one, const char* many) {
    return absl::StrCat(number, " ", number == 1 ? one : many);
  };
  std::string text = absl::StrCat(count(counts.hulls, "hull", "hulls"), ", ",
                                  count(counts.bodies, "body", "bodies"));
  if (counts.resumed == 0) return text;
  return absl::StrCat(text, "; ", counts.resumed, " of them copied by an earlier run");
}

// Reopens the target, so that the comparison reads the data that a server will open instead of data
// that is still in memory.
absl::Status CompareReopened(const Place& to, const Migration& migration,
                             absl::StatusOr<std::unique_ptr<MigrationTarget>>* target) {
  target->value().reset();
  *target = OpenTarget(to);
  if (absl::IsCancelled(target->status())) {
    return absl::AbortedError(absl::StrCat(to.Describe(),
                                           ": a hulld that was waiting for this database became "
                                           "active before the comparison finished; stop it"));
  }
  if (!target->ok()) return Explain(to, target->status());
  return migration.Compare(target->value()->store());
}

absl::Status Run(const Place& from, const Place& to, std::ostream& out, std::ostream& err) {
  if (from == to) {
    return InvalidArgument("source and destination are both ", from.Describe());
  }
  const absl::StatusOr<std::unique_ptr<Store>> source = OpenSource(from);
  if (!source.ok()) return Explain(from, source.status());
  absl::StatusOr<std::unique_ptr<MigrationTarget>> target = OpenTarget(to);
  if (!target.ok()) return Explain(to, target.status());
  ProgressLines lines(err);
  absl::StatusOr<Migration> migration =
      Migration::Read(**source, [&lines](uint64_t done, uint64_t all) { lines.Print(done, all); });
  if (!migration.ok()) return Explain(from, migration.status());
  HULLD_ASSIGN_OR_RETURN(const bool is_finished, migration->IsFinished(**target));
  if (is_finished) {
    out << "nothing to copy: " << to.Describe() << " already contains the copy, store "
        << (*target)->store().id() << "; all records match\n";
    return absl::OkStatus();
  }
  absl::StatusOr<MigrationCounts> counts = migration->CopyTo(**target);
  if (!counts.ok()) return counts.status();
  out << "copied store " << migration->source().store_id << " at revision "
      << migration->source().revision << ": " << Describe(*counts) << std::endl;
  lines.SetPhase("compared");
  absl::Status compared = CompareReopened(to, *migration, &target);
  if (absl::IsDataLoss(compared) && counts->resumed > 0) {
    // Points that change no vertex do not raise the store's revision, so the source may have
    // changed unnoticed since the earlier run.
    out << std::string(compared.message()) << "; starting the copy over" << std::endl;
    HULLD_RETURN_IF_ERROR((*target)->Begin(migration->source()));
    lines.SetPhase("copied");
    counts = migration->CopyTo(**target);
    if (!counts.ok()) return counts.status();
    lines.SetPhase("compared");
    compared = CompareReopened(to, *migration, &target);
  }
  if (!compared.ok()) return compared;
  HULLD_RETURN_IF_ERROR((*target)->Finish(migration->source()));
  out << "verified: all records match; " << to.Describe() << " is now store "
      << (*target)->store().id() << "\n";
  return absl::OkStatus();
}

}  // namespace

int RunMigrate(const std::vector<std::string>& arguments, std::ostream& out, std::ostream& err) {
  Place from;
  Place to;
  const Subcommand command = {
      "hulld migrate",
      "Copies a store and compares the copy with it. No hulld may have either store open. The "
      "source is not changed.",
      {{"--from-data-dir", &from.data_dir, "The source: a directory of --store=rocksdb"},
       {"--from-postgres-conninfo-file", &from.conninfo_file,
        "The source: a database of --store=postgres"},
       {"--to-data-dir", &to.data_dir, "The destination: a directory, created if missing"},
       {"--to-postgres-conninfo-file", &to.conninfo_file, "The destination: an empty database"}},
      "Run the same command again to resume an interrupted run, or to verify a finished copy\n"
      "that no server has changed. Revisions and writers' sequences are kept;\n"
      "the copy is a new store with its own ID.\n"
      "Exit status: 0 everything is copied and verified, 1 it failed and can be resumed, 2 it "
      "was\nrefused, and nothing was changed."};
  if (const std::optional<int> exit = command.Parse(arguments, out, err)) return *exit;
  if (!from.is_one() || !to.is_one()) {
    err << "hulld migrate: set one source (--from-data-dir or --from-postgres-conninfo-file) and "
           "one destination (--to-data-dir or --to-postgres-conninfo-file)\n";
    return kExitRefused;
  }
  SetUpLog("warn", "text");
  const absl::Status status = Run(from, to, out, err);
  if (status.ok()) return 0;
  // The message of a store advises the clients of a server.
  err << "hulld migrate: "
      << (IsDiskFull(status) ? "the disk of the destination is full"
                             : std::string(status.message()))
      << "\n";
  const bool is_refused = absl::IsFailedPrecondition(status) || absl::IsInvalidArgument(status) ||
                          absl::IsNotFound(status);
  if (is_refused) return kExitRefused;
  err << "The copy is incomplete; fix the cause, then run the same command again to resume it.\n";
  return kExitFailed;
}

}  // namespace hulld::server
