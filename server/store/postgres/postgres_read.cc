// Reading from the store: records, vertices of a hull, a writer's sequence.
#include <absl/status/status.h>

#include <algorithm>
#include <optional>
#include <utility>

#include "core/base/status_macros.h"
#include "server/contract/errors.h"
#include "server/store/postgres/postgres_store.h"
#include "server/store/store_keys.h"

namespace hulld::server {
namespace {

// Selects the deltas of a hull after one revision and up to another.
Statement SelectDeltas(const HullRecord& hull, uint64_t after, uint64_t up_to) {
  return {.name = "hulld_deltas",
          .parameters = {hull.hull_id, EncodeBigint(hull.create_revision), EncodeBigint(after),
                         EncodeBigint(up_to)}};
}

// Encodes a boolean in PostgreSQL's binary format.
std::string EncodeBoolean(bool value) { return std::string(1, value ? '\1' : '\0'); }

// rows: the store's revision and, for each hull or body: ID, true for a body, true if the value is
// omitted, and the value. A row without an ID means that none was found.
absl::StatusOr<FoundRecords> ParseRecords(const Rows& rows, std::string_view prefix, size_t limit) {
  if (rows.count() == 0) return absl::DataLossError("the row of hulld.store is missing");
  FoundRecords found;
  found.revision = rows.bigint(0, 0);
  for (int i = 0; i < rows.count(); ++i) {
    const std::string id(rows.at(i, 1));
    if (id.empty() || !id.starts_with(prefix)) break;
    const bool is_left_out = rows.at(i, 3) == EncodeBoolean(true);
    found.more = is_left_out || found.hulls.size() + found.bodies.size() == limit;
    if (found.more) break;
    if (rows.at(i, 2) == EncodeBoolean(true)) {
      found.bodies.emplace(id, UnsealStoredBody(id, rows.at(i, 4)));
    } else {
      found.hulls.emplace(id, UnsealStoredHull(id, rows.at(i, 4)));
    }
  }
  return found;
}

// deltas: between the two versions.
std::optional<std::vector<Vector>> PointsOf(const Rows& deltas, const HullGrowth& hull) {
  const VertexLayout& before = hull.before.layout;
  const VertexLayout& after = hull.after.layout;
  if (before.delta_count + deltas.count() != after.delta_count) return std::nullopt;
  std::vector<Vector> points;
  for (int i = 0; i < deltas.count(); ++i) {
    const std::string key = DeltaKey(hull.after.record.create_revision, deltas.bigint(i, 0));
    const absl::StatusOr<std::string_view> value = Unseal(key, deltas.at(i, 1));
    if (!value.ok() || !AppendVertices(*value, &points).ok()) return std::nullopt;
  }
  if (before.delta_vertices + points.size() != after.delta_vertices) return std::nullopt;
  const bool is_finite =
      std::ranges::all_of(points, [](const Vector& point) { return point.allFinite(); });
  return is_finite ? std::optional(std::move(points)) : std::nullopt;
}

}  // namespace

// A server that became active during the read may have changed the data. The owner is read last, so
// if it is still this server, everything read before is valid, including missing or damaged data.
absl::StatusOr<std::vector<Rows>> PostgresStore::Read(std::vector<Statement> statements) {
  HULLD_RETURN_IF_ERROR(ended());
  statements.push_back({.name = "hulld_owner"});
  absl::StatusOr<std::vector<Rows>> rows = readers_.Execute(statements);
  if (!rows.ok()) {
    ++read_failures_;
    return Unavailable("cannot read from the database: ", rows.status().message());
  }
  const Rows owner = std::move(rows->back());
  rows->pop_back();
  if (owner.count() == 1 && owner.at(0, 0) == store_owner()) return rows;
  End(Superseded(owner.count() == 1 ? owner.at(0, 0) : ""));
  return ended();
}

absl::StatusOr<Rows> PostgresStore::ReadOne(Statement statement) {
  std::vector<Statement> statements;
  statements.push_back(std::move(statement));
  HULLD_ASSIGN_OR_RETURN(std::vector<Rows> rows, Read(std::move(statements)));
  return std::move(rows.front());
}

absl::StatusOr<FoundRecords> PostgresStore::FindRecords(std::span<const std::string> ids) {
  ArrayParameter id_array(ArrayParameter::Element::kText);
  for (const std::string& id : ids) id_array.Add(id);
  HULLD_ASSIGN_OR_RETURN(const Rows rows,
                         ReadOne({.name = "hulld_find", .parameters = {id_array.Take()}}));
  return ParseRecords(rows, "", SIZE_MAX);
}

// Requests one extra row to detect whether more follow. A prefix that no ID can have may contain
// characters that the database rejects; the query then starts after all IDs.
absl::StatusOr<FoundRecords> PostgresStore::ListRecords(const std::string& prefix,
                                                        const std::string& after, size_t limit,
                                                        RecordKinds kinds) {
  const bool may_be = std::ranges::all_of(prefix, [](char c) { return c > ' ' && c <= '~'; });
  HULLD_ASSIGN_OR_RETURN(
      const Rows rows,
      ReadOne({.name = "hulld_list",
               .parameters = {may_be ? prefix : "\x7f", after, EncodeBigint(limit + 1),
                              EncodeBoolean(kinds.hulls), EncodeBoolean(kinds.bodies),
                              EncodeBigint(kMaxListedBytes)}}));
  return ParseRecords(rows, prefix, limit);
}

absl::StatusOr<std::vector<Vector>> PostgresStore::LoadVertices(const StoredHull& hull) {
  const std::string& id = hull.record.hull_id;
  const uint64_t incarnation = hull.record.create_revision;
  HULLD_ASSIGN_OR_RETURN(
      const std::vector<Rows> rows,
      Read(
          {{.name = "hulld_base",
            .parameters = {id, EncodeBigint(incarnation), EncodeBigint(hull.layout.base_revision)}},
           SelectDeltas(hull.record, hull.layout.base_revision, hull.record.revision)}));
  const Rows& base = rows[0];
  const Rows& deltas = rows[1];
  VertexAssembly assembly(hull);
  absl::Status status;
  for (int i = 0; status.ok() && assembly.wants_base_part(); ++i) {
    const uint32_t part = assembly.next_part();
    absl::StatusOr<std::string_view> value = absl::DataLossError("it is missing");
    if (i < base.count() && base.bigint(i, 0) == part) {
      value = Unseal(BaseKey(incarnation, hull.layout.base_revision, part), base.at(i, 1));
    }
    status = assembly.AddBasePart(value);
  }
  for (int i = 0; status.ok() && i < deltas.count(); ++i) {
    const uint64_t revision = deltas.bigint(i, 0);
    status = assembly.AddDelta(revision, Unseal(DeltaKey(incarnation, revision), deltas.at(i, 1)));
  }
  absl::StatusOr<std::vector<Vector>> vertices = std::move(assembly).Finish(std::move(status));
  if (!options_.shared || !absl::IsDataLoss(vertices.status())) return vertices;
  return ExplainDamage(hull, vertices.status());
}

// The data may be newer than the requested versions, and then does not match them.
std::vector<std::optional<std::vector<Vector>>> PostgresStore::LoadGrowth(
    std::span<const HullGrowth> hulls) {
  std::vector<std::optional<std::vector<Vector>>> growth(hulls.size());
  std::vector<Statement> statements;
  for (const HullGrowth& hull : hulls) {
    statements.push_back(
        SelectDeltas(hull.after.record, hull.before.record.revision, hull.after.record.revision));
  }
  const absl::StatusOr<std::vector<Rows>> rows = follower_.Execute(statements);
  if (!rows.ok()) {
    ++read_failures_;
    return growth;
  }
  for (size_t i = 0; i < hulls.size(); ++i) growth[i] = PointsOf((*rows)[i], hulls[i]);
  return growth;
}

absl::StatusOr<uint64_t> PostgresStore::LoadSequence(const HullRecord& hull,
                                                     const std::string& writer_id) {
  const uint64_t incarnation = hull.create_revision;
  HULLD_ASSIGN_OR_RETURN(
      const Rows rows,
      ReadOne({.name = "hulld_sequence",
               .parameters = {hull.hull_id, EncodeBigint(incarnation), writer_id}}));
  HULLD_RETURN_IF_ERROR(options_.shared ? CheckRecord(hull, rows) : absl::OkStatus());
  if (rows.count() == 0 || rows.at(0, 0).empty()) return 0;
  return UnsealSequence(hull.hull_id, WriterKey(incarnation, writer_id), rows.at(0, 0));
}

absl::StatusOr<std::vector<WriterSequence>> PostgresStore::LoadWriters(const StoredHull& hull) {
  const std::string& id = hull.record.hull_id;
  const uint64_t incarnation = hull.record.create_revision;
  HULLD_ASSIGN_OR_RETURN(const Rows rows, ReadOne({.name = "hulld_writers",
                                                   .parameters = {id, EncodeBigint(incarnation)}}));
  std::vector<WriterSequence> writers;
  for (int i = 0; i < rows.count(); ++i) {
    const std::string writer_id(rows.at(i, 0));
    HULLD_ASSIGN_OR_RETURN(const uint64_t sequence,
                           UnsealSequence(id, WriterKey(incarnation, writer_id), rows.at(i, 1)));
    writers.push_back({writer_id, sequence});
  }
  return writers;
}

}  // namespace hulld::server
