#include "server/migration/migration.h"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <bit>
#include <memory>
#include <optional>
#include <utility>

#include "core/base/status_macros.h"
#include "server/store/store_keys.h"

namespace hulld::server {
namespace {

// Limits of a transaction: vertices (24 MB), or changes of hulls and bodies. Not tuned.
constexpr size_t kMaxVertices = 1'000'000;
constexpr size_t kMaxChanges = 1000;

absl::Status Differs(const std::string& id, const std::string& what) {
  return absl::DataLossError(absl::StrCat("\"", id, "\" differs in the copy: ", what));
}

const std::string& IdOf(const StoredHull& hull) { return hull.record.hull_id; }
const std::string& IdOf(const StoredBody& body) { return body.record.body_id; }

// OK if both have the same IDs with equal values. Requires byte order of the IDs.
template <typename Stored, typename Same>
absl::Status CompareAll(const std::vector<Stored>& expected, const std::vector<Stored>& found,
                        const Same& same) {
  for (size_t i = 0; i < expected.size(); ++i) {
    const std::string& id = IdOf(expected[i]);
    if (i >= found.size() || id < IdOf(found[i])) return Differs(id, "it is missing");
    if (IdOf(found[i]) < id) return Differs(IdOf(found[i]), "it is not in the source");
    HULLD_RETURN_IF_ERROR(same(expected[i], found[i]));
  }
  if (found.size() <= expected.size()) return absl::OkStatus();
  return Differs(IdOf(found[expected.size()]), "it is not in the source");
}

bool HasSameBits(const Vector& a, const Vector& b) {
  return std::equal(a.data(), a.data() + 3, b.data(), [](double x, double y) {
    return std::bit_cast<uint64_t>(x) == std::bit_cast<uint64_t>(y);
  });
}

absl::StatusOr<std::vector<WriterSequence>> ReadWriters(Store& store, const StoredHull& hull) {
  absl::StatusOr<std::vector<WriterSequence>> writers = store.LoadWriters(hull);
  if (!writers.ok() || writers->size() == hull.writer_count) return writers;
  return absl::DataLossError(absl::StrCat("hull \"", hull.record.hull_id, "\" has ",
                                          writers->size(), " writers in store ", store.id(),
                                          ", not ", hull.writer_count, " as its record states"));
}

}  // namespace

Migration::Migration(Store& source, Progress progress)
    : source_(&source), progress_(std::move(progress)), as_of_{source.id(), source.revision()} {}

absl::StatusOr<Migration> Migration::Read(Store& source, Progress progress) {
  Migration migration(source, std::move(progress));
  absl::Status damage;
  HULLD_RETURN_IF_ERROR(source.ForEachRecord(
      [&](const std::string&, absl::StatusOr<StoredHull> hull) {
        if (!hull.ok()) return damage.Update(hull.status());
        migration.hulls_.push_back(*std::move(hull));
      },
      [&](const std::string&, absl::StatusOr<StoredBody> body) {
        if (!body.ok()) return damage.Update(body.status());
        migration.bodies_.push_back(*std::move(body));
      }));
  HULLD_RETURN_IF_ERROR(damage);
  return migration;
}

// A database may have lost whole rows, for example in a partial restore.
absl::Status Migration::CheckSource() const {
  const StoreTotals totals = source_->totals();
  if (source_->supports_lookup() &&
      (hulls_.size() != totals.hulls || bodies_.size() != totals.bodies)) {
    return absl::DataLossError(absl::StrCat("the source has recorded ", totals.hulls, " hulls and ",
                                            totals.bodies, " bodies, but contains ", hulls_.size(),
                                            " and ", bodies_.size(), "; restore a backup"));
  }
  uint64_t revision = 0;
  for (const StoredHull& hull : hulls_) revision = std::max(revision, hull.record.revision);
  for (const StoredBody& body : bodies_) revision = std::max(revision, body.record.revision);
  if (revision <= as_of_.revision) return absl::OkStatus();
  return absl::DataLossError(absl::StrCat("the source is at revision ", as_of_.revision,
                                          ", but contains a change of revision ", revision,
                                          "; restore a backup"));
}

// Resumes an unfinished migration if it copied the current state of this source. Restarts one that
// copied an earlier state.
absl::Status Migration::Prepare(MigrationTarget& target) {
  HULLD_ASSIGN_OR_RETURN(const std::optional<MigrationSource> mark, target.ReadMark());
  if (mark.has_value()) {
    if (*mark == as_of_) return absl::OkStatus();
    if (mark->store_id == as_of_.store_id) return target.Begin(as_of_);
    return absl::FailedPreconditionError(
        absl::StrCat("the destination contains an unfinished migration from store ", mark->store_id,
                     ", but the source is store ", as_of_.store_id,
                     "; use that source, or another destination"));
  }
  uint64_t held = 0;
  const auto count = [&held](const auto&...) { ++held; };
  HULLD_RETURN_IF_ERROR(target.store().ForEachRecord(count, count));
  if (held == 0 && target.store().revision() == 0) return target.Begin(as_of_);
  return absl::FailedPreconditionError(absl::StrCat(
      "the destination is not empty: it is store ", target.store().id(), " at revision ",
      target.store().revision(), " with ", held, " hulls and bodies; use an empty destination"));
}

absl::StatusOr<bool> Migration::IsFinished(MigrationTarget& target) const {
  HULLD_ASSIGN_OR_RETURN(const std::optional<MigrationSource> mark, target.ReadMark());
  const uint64_t revision = target.store().revision();
  if (mark.has_value() || revision == 0 || revision != as_of_.revision) return false;
  const absl::Status compared = Compare(target.store());
  if (absl::IsDataLoss(compared)) return false;
  if (!compared.ok()) return compared;
  return true;
}

absl::StatusOr<MigrationCounts> Migration::CopyTo(MigrationTarget& target) {
  HULLD_RETURN_IF_ERROR(CheckSource());
  HULLD_RETURN_IF_ERROR(Prepare(target));
  // Greatest IDs in the target: its hulls and bodies are contiguous up to these.
  std::string last_hull;
  std::string last_body;
  HULLD_RETURN_IF_ERROR(
      target.store().ForEachRecord([&](const std::string& id, const auto&) { last_hull = id; },
                                   [&](const std::string& id, const auto&) { last_body = id; }));
  MigrationCounts counts;
  std::vector<Change> pending;
  size_t vertices = 0;
  const auto flush = [&] {
    std::vector<const Change*> changes;
    changes.reserve(pending.size());
    for (const Change& change : pending) changes.push_back(&change);
    absl::Status status = changes.empty() ? absl::OkStatus() : target.Add(changes);
    pending.clear();
    vertices = 0;
    return status;
  };
  const auto copy = [&](const auto& records, const std::string& last_id,
                        uint64_t* count) -> absl::Status {
    for (const auto& each : records) {
      ++*count;
      if (IdOf(each) <= last_id) {
        ++counts.resumed;
        continue;
      }
      HULLD_ASSIGN_OR_RETURN(std::vector<Change> changes, ChangesOf(each));
      for (Change& change : changes) {
        vertices += change.vertices.size();
        pending.push_back(std::move(change));
      }
      if (vertices >= kMaxVertices || pending.size() >= kMaxChanges) {
        HULLD_RETURN_IF_ERROR(flush());
      }
      progress_(counts.hulls + counts.bodies, all());
    }
    return flush();
  };
  HULLD_RETURN_IF_ERROR(copy(hulls_, last_hull, &counts.hulls));
  HULLD_RETURN_IF_ERROR(copy(bodies_, last_body, &counts.bodies));
  return counts;
}

absl::StatusOr<std::vector<Change>> Migration::ChangesOf(const StoredBody& body) const {
  std::vector<Change> changes(1);
  changes[0].body = std::make_shared<StoredBody>(body);
  changes[0].revision = body.record.revision;
  changes[0].begins = true;
  return changes;
}

// Returns the state of a hull as changes: all vertices as one base, and each writer.
absl::StatusOr<std::vector<Change>> Migration::ChangesOf(const StoredHull& hull) const {
  HULLD_ASSIGN_OR_RETURN(std::vector<Vector> vertices, source_->LoadVertices(hull));
  HULLD_ASSIGN_OR_RETURN(std::vector<WriterSequence> writers, ReadWriters(*source_, hull));
  Change change;
  change.hull = hull;
  change.hull.layout = {};
  change.revision = hull.record.revision;
  change.begins = true;
  if (!vertices.empty()) {
    change.hull.layout.base_revision = hull.record.revision;
    change.hull.layout.base_vertices = vertices.size();
    change.vertex_change = VertexChange::kReplaced;
    change.vertices = std::move(vertices);
  }
  std::vector<Change> changes = {std::move(change)};
  for (WriterSequence& writer : writers) {
    Change committed;
    committed.hull = changes.front().hull;
    committed.revision = hull.record.revision;
    committed.previous_vertices = hull.record.vertex_count;
    committed.writer = std::move(writer);
    changes.push_back(std::move(committed));
  }
  return changes;
}

absl::Status Migration::Compare(Store& copy) const {
  HULLD_ASSIGN_OR_RETURN(const Migration read, Read(copy, progress_));
  uint64_t done = 0;
  HULLD_RETURN_IF_ERROR(
      CompareAll(hulls_, read.hulls_, [&](const StoredHull& hull, const StoredHull& other) {
        progress_(++done, all());
        return CompareHull(copy, hull, other);
      }));
  return CompareAll(bodies_, read.bodies_, [&](const StoredBody& body, const StoredBody& other) {
    progress_(++done, all());
    return EncodeStoredBody(body) == EncodeStoredBody(other)
               ? absl::OkStatus()
               : Differs(body.record.body_id, "its record or its pieces");
  });
}

absl::Status Migration::CompareHull(Store& copy, const StoredHull& hull,
                                    const StoredHull& other) const {
  const std::string& id = hull.record.hull_id;
  if (!(hull.record == other.record) || hull.writer_count != other.writer_count) {
    return Differs(id, "its record");
  }
  HULLD_ASSIGN_OR_RETURN(const std::vector<Vector> vertices, source_->LoadVertices(hull));
  HULLD_ASSIGN_OR_RETURN(const std::vector<Vector> copied, copy.LoadVertices(other));
  if (!std::ranges::equal(vertices, copied, HasSameBits)) return Differs(id, "its vertices");
  HULLD_ASSIGN_OR_RETURN(const std::vector<WriterSequence> writers, ReadWriters(*source_, hull));
  HULLD_ASSIGN_OR_RETURN(const std::vector<WriterSequence> copied_writers,
                         ReadWriters(copy, other));
  return writers == copied_writers ? absl::OkStatus() : Differs(id, "its writers' sequences");
}

}  // namespace hulld::server
