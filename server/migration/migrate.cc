#include "server/migration/migrate.h"

#include <absl/strings/str_cat.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <chrono>
#include <filesystem>
#include <memory>
#include <system_error>
#include <utility>
#include <vector>

#include "server/access/secret_file.h"
#include "server/contract/status_map.h"
#include "server/migration/migration.h"
#include "server/migration/sharded_source.h"
#include "server/process/log.h"
#include "server/shards/slots.h"
#include "server/store/data_directory.h"
#include "server/store/postgres/conninfo.h"
#include "server/store/postgres/postgres_store.h"
#include "server/store/postgres/session.h"
#include "server/store/rocksdb_store.h"

namespace hulld::server {
namespace {

constexpr int kExitFailed = 1;
constexpr int kExitRefused = 2;
// Between two lines that say how far it is.
constexpr std::chrono::seconds kPause{10};

// One end of the copy, or a shard of it, as options name it. One of the three is set.
struct Place {
  std::string data_dir;
  std::string conninfo_file;
  std::string shards_file = {};
  // The slots of a shard, as PostgresOptions::slots.
  std::string slots = {};

  bool is_one() const {
    return 1 == !data_dir.empty() + !conninfo_file.empty() + !shards_file.empty();
  }
  bool operator==(const Place&) const = default;
  std::string Describe() const {
    if (!shards_file.empty()) return "shards (" + shards_file + ")";
    return data_dir.empty() ? "PostgreSQL (" + conninfo_file + ")" : data_dir;
  }
};

// What opening a store at a place says, in the words of this program.
absl::Status Explain(const Place& place, const absl::Status& status) {
  if (status.ok()) return status;
  if (absl::IsCancelled(status)) {
    return absl::FailedPreconditionError(absl::StrCat(
        place.Describe(), ": a hulld is active over this database; end every hulld that uses it"));
  }
  return Prefixed(absl::StrCat(place.Describe(), ": "), status);
}

absl::StatusOr<std::string> ReadConninfo(const Place& place, const char* option) {
  return ReadSecretFile(place.conninfo_file, option);
}

// Opening a store that is not there would make one.
absl::StatusOr<std::unique_ptr<Store>> OpenRocksDbSource(const std::string& data_dir) {
  RocksDbOptions options;
  options.data_dir = data_dir;
  options.read_only = true;
  // Where it cannot be looked at, opening it says why.
  std::error_code error;
  if (!std::filesystem::exists(DatabaseDirectory(data_dir), error) && !error) {
    return absl::NotFoundError("there is no store of hulld");
  }
  if (absl::Status s = RocksDbStore::Open(options).status(); !s.ok()) return s;
  options.read_only = false;
  absl::StatusOr<std::unique_ptr<RocksDbStore>> store = RocksDbStore::Open(options);
  if (!store.ok()) return store.status();
  return *std::move(store);
}

absl::StatusOr<std::unique_ptr<Store>> OpenPostgresSource(const std::string& conninfo,
                                                          const std::string& slots) {
  PostgresOptions options;
  options.conninfo = conninfo;
  options.slots = slots;
  options.should_stop = [] { return true; };
  const absl::StatusOr<Conninfo> parsed = Conninfo::Parse(conninfo);
  if (!parsed.ok()) return parsed.status();
  {
    const absl::StatusOr<std::unique_ptr<Session>> session =
        Session::Open(*parsed, options.answer_time);
    if (!session.ok()) return session.status();
    const absl::StatusOr<Rows> there =
        (*session)->Run("SELECT to_regclass('hulld.store') IS NOT NULL");
    if (!there.ok()) return there.status();
    if (there->at(0, 0) != "t") return absl::NotFoundError("there is no store of hulld");
  }
  absl::StatusOr<std::unique_ptr<PostgresStore>> store = PostgresStore::Open(std::move(options));
  if (!store.ok()) return store.status();
  return *std::move(store);
}

absl::StatusOr<std::unique_ptr<Store>> OpenSource(const Place& place) {
  if (!place.data_dir.empty()) return OpenRocksDbSource(place.data_dir);
  const auto conninfo = ReadConninfo(place, "--from-postgres-conninfo-file");
  return conninfo.ok() ? OpenPostgresSource(*conninfo, place.slots) : conninfo.status();
}

absl::StatusOr<std::unique_ptr<MigrationTarget>> OpenTarget(const Place& place) {
  if (!place.data_dir.empty()) return OpenRocksDbTarget(place.data_dir);
  const auto conninfo = ReadConninfo(place, "--to-postgres-conninfo-file");
  return conninfo.ok() ? OpenPostgresTarget(*conninfo, place.slots) : conninfo.status();
}

// Says how far it is, now and then.
class ProgressLines {
 public:
  explicit ProgressLines(std::ostream& err) : err_(err) {}

  void SetPhase(const char* phase) { phase_ = phase; }
  void Tell(uint64_t done, uint64_t all) {
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
  return absl::StrCat(text, "; ", counts.resumed, " of these were there from an earlier run");
}

// What is compared is what a server will open, nothing that is still in our memory.
absl::Status CompareAnew(const Place& to, const Migration& migration,
                         absl::StatusOr<std::unique_ptr<MigrationTarget>>* target) {
  target->value().reset();
  *target = OpenTarget(to);
  if (absl::IsCancelled(target->status())) {
    return absl::AbortedError(absl::StrCat(
        to.Describe(),
        ": a hulld that waited for this database has its turn before all was compared; end it"));
  }
  if (!target->ok()) return Explain(to, target->status());
  return migration.Compare(target->value()->store());
}

// The places of the shards, and which of them has which slot; for a place that is not several,
// itself.
struct Places {
  std::vector<Place> all;
  std::array<uint16_t, kSlots> shard_of{};

  size_t IndexOf(const std::string& id) const { return shard_of[SlotOf(id)]; }
};

absl::StatusOr<Places> PlacesOf(const Place& place, const char* option) {
  if (place.shards_file.empty()) return Places{{place}, {}};
  const absl::StatusOr<ShardFile> file = ReadShardFile(place.shards_file, option);
  if (!file.ok()) return file.status();
  Places places;
  places.shard_of = file->shard_of;
  for (const ShardFile::Shard& shard : file->shards) {
    places.all.push_back({"", shard.conninfo_file, "", shard.slots});
  }
  return places;
}

// What is left to do of one store, once it holds what it is to hold.
struct Copied {
  MigrationSource source;
  bool is_finished = false;
};

// Whether an earlier run finished this shard and was ended before it finished all.
absl::StatusOr<bool> IsFinished(const Migration& migration, MigrationTarget& target) {
  const absl::StatusOr<std::optional<MigrationSource>> mark = target.ReadMark();
  if (!mark.ok()) return mark.status();
  const uint64_t revision = target.store().revision();
  if (mark->has_value() || revision == 0 || revision != migration.source().revision) return false;
  const absl::Status compared = migration.Compare(target.store());
  if (compared.ok() || absl::IsDataLoss(compared)) return compared.ok();
  return compared;
}

// Copies into one store what belongs there, and compares; what is left is to finish.
absl::StatusOr<Copied> CopyInto(const Place& from, const Place& to, bool is_of_several,
                                Store& source,
                                absl::StatusOr<std::unique_ptr<MigrationTarget>>* target,
                                std::ostream& out, std::ostream& err) {
  ProgressLines lines(err);
  absl::StatusOr<Migration> migration =
      Migration::Read(source, [&lines](uint64_t done, uint64_t all) { lines.Tell(done, all); });
  if (!migration.ok()) return Explain(from, migration.status());
  if (is_of_several) {
    const absl::StatusOr<bool> is_finished = IsFinished(*migration, ***target);
    if (!is_finished.ok()) return Explain(to, is_finished.status());
    if (*is_finished) return Copied{migration->source(), true};
  }
  absl::StatusOr<MigrationCounts> counts = migration->CopyTo(***target);
  if (!counts.ok()) return is_of_several ? Explain(to, counts.status()) : counts.status();
  out << "copied store " << migration->source().store_id << " at revision "
      << migration->source().revision << ": " << Describe(*counts)
      << (is_of_several ? ", to " + to.Describe() : "") << std::endl;
  lines.SetPhase("compared");
  absl::Status compared = CompareAnew(to, *migration, target);
  if (absl::IsDataLoss(compared) && counts->resumed > 0) {
    // Points that move no vertex leave the store's revision as it is, so the source may have
    // changed unseen since the earlier run.
    out << std::string(compared.message()) << "; copying it anew" << std::endl;
    if (absl::Status s = (**target)->Begin(migration->source()); !s.ok()) return s;
    lines.SetPhase("copied");
    counts = migration->CopyTo(***target);
    if (!counts.ok()) return counts.status();
    lines.SetPhase("compared");
    compared = CompareAnew(to, *migration, target);
  }
  if (!compared.ok()) return compared;
  return Copied{migration->source(), false};
}

absl::Status Run(const Place& from, const Place& to, std::ostream& out, std::ostream& err) {
  if (from == to) {
    return absl::InvalidArgumentError(
        absl::StrCat("source and destination are both ", from.Describe()));
  }
  const absl::StatusOr<Places> sources = PlacesOf(from, "--from-postgres-shards");
  if (!sources.ok()) return sources.status();
  const absl::StatusOr<Places> targets = PlacesOf(to, "--to-postgres-shards");
  if (!targets.ok()) return targets.status();
  std::vector<std::unique_ptr<Store>> stores;
  std::vector<Store*> pointers;
  for (const Place& place : sources->all) {
    absl::StatusOr<std::unique_ptr<Store>> store = OpenSource(place);
    if (!store.ok()) return Explain(place, store.status());
    pointers.push_back(store->get());
    stores.push_back(*std::move(store));
  }
  // All are claimed before anything is copied.
  std::vector<absl::StatusOr<std::unique_ptr<MigrationTarget>>> opened;
  for (const Place& place : targets->all) {
    opened.push_back(OpenTarget(place));
    if (!opened.back().ok()) return Explain(place, opened.back().status());
  }
  std::vector<Copied> copied;
  for (size_t i = 0; i < opened.size(); ++i) {
    ShardedSource source(
        pointers, [&](const std::string& id) { return targets->IndexOf(id) == i; },
        [&](const std::string& id) { return sources->IndexOf(id); });
    const absl::StatusOr<Copied> done =
        CopyInto(from, targets->all[i], opened.size() > 1, source, &opened[i], out, err);
    if (!done.ok()) {
      // Some of the destination is filled by now, which is no refusal.
      const bool has_filled =
          std::ranges::any_of(copied, [](const Copied& one) { return !one.is_finished; });
      return has_filled ? absl::AbortedError(done.status().message()) : done.status();
    }
    copied.push_back(*done);
  }
  std::string ids;
  for (size_t i = 0; i < opened.size(); ++i) {
    if (!copied[i].is_finished) {
      if (absl::Status s = (*opened[i])->Finish(copied[i].source); !s.ok()) return s;
    }
    absl::StrAppend(&ids, i == 0 ? "" : ", ", (*opened[i])->store().id());
  }
  out << "compared: every record is the same; " << to.Describe() << " is store " << ids << " now\n";
  return absl::OkStatus();
}

}  // namespace

int RunMigrate(const std::vector<std::string>& arguments, std::ostream& out, std::ostream& err) {
  CLI::App app(
      "Copies a store to another place while no hulld has either open, and compares the two. The "
      "source stays as it is.",
      "hulld migrate");
  Place from;
  Place to;
  app.add_option("--from-data-dir", from.data_dir, "The source: a directory of --store=rocksdb");
  app.add_option("--from-postgres-conninfo-file", from.conninfo_file,
                 "The source: a database of --store=postgres");
  app.add_option("--from-postgres-shards", from.shards_file,
                 "The source: the databases of --postgres-shards");
  app.add_option("--to-data-dir", to.data_dir, "The destination: a directory, which is made");
  app.add_option("--to-postgres-conninfo-file", to.conninfo_file,
                 "The destination: an empty database");
  app.add_option("--to-postgres-shards", to.shards_file,
                 "The destination: empty databases, by slots of the IDs");
  app.footer(
      "A run that was ended is gone on with by the same command. Revisions and writers' sequences "
      "are\nkept; the copy is another store, with an ID of its own.\n"
      "Exit status: 0 all is copied and the same, 1 it failed on its way and can be run again, 2 "
      "it was\nrefused, and nothing was changed.");
  std::vector<std::string> reversed(arguments.rbegin(), arguments.rend());
  try {
    app.parse(std::move(reversed));
  } catch (const CLI::ParseError& error) {
    return app.exit(error, out, err) == 0 ? 0 : kExitRefused;
  }
  if (!from.is_one() || !to.is_one()) {
    err << "hulld migrate: name one source (--from-data-dir, --from-postgres-conninfo-file or "
           "--from-postgres-shards) and one destination (--to-data-dir, "
           "--to-postgres-conninfo-file or --to-postgres-shards)\n";
    return kExitRefused;
  }
  SetUpLog("warn", "text");
  const absl::Status status = Run(from, to, out, err);
  if (status.ok()) return 0;
  err << "hulld migrate: " << std::string(status.message()) << "\n";
  const bool is_refused = absl::IsFailedPrecondition(status) || absl::IsInvalidArgument(status) ||
                          absl::IsNotFound(status);
  return is_refused ? kExitRefused : kExitFailed;
}

}  // namespace hulld::server
