#include "server/store/postgres/batch_statements.h"

#include <algorithm>
#include <iterator>
#include <map>
#include <string>
#include <string_view>
#include <utility>

#include "server/store/store_keys.h"

namespace hulld::server {
namespace {

using Element = ArrayParameter::Element;

// A message of PostgreSQL's protocol is limited to 1 GB; statements stay far below.
constexpr size_t kMaxStatementBytes = 16 << 20;

// Rows of a hull after a batch.
struct HullRows {
  // Existing rows to delete: all rows of the hull, or only its vertices.
  bool drops_all = false;
  bool drops_vertices = false;
  // The hull's last change; null before the first.
  const Change* last = nullptr;
  // New rows of the resulting hull.
  std::map<std::string, uint64_t> sequences;
  const Change* base = nullptr;
  std::vector<const Change*> deltas;

  void Add(const Change& change);
};

void HullRows::Add(const Change& change) {
  last = &change;
  if (change.deleted || change.replaced.has_value()) {
    drops_all = true;
    sequences.clear();
    base = nullptr;
    deltas.clear();
  }
  if (change.deleted) return;
  if (change.writer.has_value()) sequences[change.writer->writer_id] = change.writer->sequence;
  if (change.vertex_change == VertexChange::kReplaced) {
    drops_vertices = drops_vertices || !change.previous_layout.empty();
    base = &change;
    deltas.clear();
  } else if (change.vertex_change == VertexChange::kAdded) {
    deltas.push_back(&change);
  }
}

// A value of a row, in binary format.
struct Value {
  Element element;
  std::string bytes;
};

Value Text(const std::string& text) { return {Element::kText, text}; }
Value Bigint(uint64_t number) { return {Element::kBigint, EncodeBigint(number)}; }
Value Sealed(std::string_view key, std::string value) {
  return {Element::kBytea, Seal(key, std::move(value))};
}

// Rows of prepared statements, column by column.
class Encoder {
 public:
  void Add(std::string_view statement, const std::vector<Value>& row) {
    std::vector<ArrayParameter>& columns = columns_[statement];
    size_t bytes = 0;
    for (size_t i = 0; i < row.size(); ++i) {
      if (columns.size() == i) columns.emplace_back(row[i].element);
      columns[i].Add(row[i].bytes);
      bytes += columns[i].bytes();
    }
    if (bytes >= kMaxStatementBytes) Flush(statement, columns);
  }

  std::vector<Statement> Take() && {
    for (auto& [statement, columns] : columns_) Flush(statement, columns);
    return std::move(statements_);
  }

 private:
  void Flush(std::string_view statement, std::vector<ArrayParameter>& columns) {
    if (columns.front().count() == 0) return;
    Statement& full = statements_.emplace_back(Statement{.name = statement.data()});
    for (ArrayParameter& column : columns) full.parameters.push_back(column.Take());
  }

  std::vector<Statement> statements_;
  std::map<std::string_view, std::vector<ArrayParameter>> columns_;
};

void AddDrops(const std::string& hull_id, const HullRows& rows, Encoder& drops) {
  if (rows.last->deleted) drops.Add("hulld_drop_hulls", {Text(hull_id)});
  if (rows.drops_all) drops.Add("hulld_drop_writers", {Text(hull_id)});
  if (!rows.drops_all && !rows.drops_vertices) return;
  drops.Add("hulld_drop_bases", {Text(hull_id)});
  drops.Add("hulld_drop_deltas", {Text(hull_id)});
}

void AddBase(const std::string& hull_id, const Change& change, Encoder& puts) {
  const uint64_t incarnation = change.hull.record.create_revision;
  const uint64_t revision = change.hull.record.revision;
  std::span<const Vector> rest = change.vertices;
  for (uint32_t part = 0; !rest.empty(); ++part) {
    const auto vertices = rest.first(std::min(rest.size(), kBasePartVertices));
    puts.Add("hulld_put_bases",
             {Text(hull_id),
              Bigint(incarnation),
              Bigint(revision),
              {Element::kInteger, EncodeInteger(part)},
              Sealed(BaseKey(incarnation, revision, part), EncodeVertices(vertices))});
    rest = rest.subspan(vertices.size());
  }
}

void AddRows(const std::string& hull_id, const HullRows& rows, Encoder& puts) {
  if (rows.last->deleted) return;
  const uint64_t incarnation = rows.last->hull.record.create_revision;
  puts.Add("hulld_put_hulls",
           {Text(hull_id), Sealed(HullKey(hull_id), EncodeStoredHull(rows.last->hull))});
  for (const auto& [writer_id, sequence] : rows.sequences) {
    puts.Add("hulld_put_writers",
             {Text(hull_id), Bigint(incarnation), Text(writer_id),
              Sealed(WriterKey(incarnation, writer_id), EncodeNumber(sequence))});
  }
  if (rows.base != nullptr) AddBase(hull_id, *rows.base, puts);
  for (const Change* delta : rows.deltas) {
    const uint64_t revision = delta->hull.record.revision;
    puts.Add("hulld_put_deltas",
             {Text(hull_id), Bigint(incarnation), Bigint(revision),
              Sealed(DeltaKey(incarnation, revision), EncodeVertices(delta->vertices))});
  }
}

// Returns the create_revision of the incarnation that a change ends; 0: none. It is unknown for a
// damaged hull; the value 1 then records that the hull existed, which peer servers need to know.
uint64_t CreateRevisionOfEnded(const Change& change) {
  const auto known = [](uint64_t revision) { return std::max<uint64_t>(revision, 1); };
  if (change.replaced.has_value()) return known(change.replaced->record.create_revision);
  if (!change.deleted) return 0;
  return known(change.body != nullptr ? change.body->record.create_revision
                                      : change.hull.record.create_revision);
}

}  // namespace

std::string PrepareBatchStatements() {
  return R"(
    PREPARE hulld_drop_hulls(text[]) AS DELETE FROM hulld.hulls WHERE hull_id = ANY ($1);
    PREPARE hulld_drop_bodies(text[]) AS DELETE FROM hulld.bodies WHERE body_id = ANY ($1);
    PREPARE hulld_drop_writers(text[]) AS DELETE FROM hulld.writers WHERE hull_id = ANY ($1);
    PREPARE hulld_drop_bases(text[]) AS DELETE FROM hulld.bases WHERE hull_id = ANY ($1);
    PREPARE hulld_drop_deltas(text[]) AS DELETE FROM hulld.deltas WHERE hull_id = ANY ($1);
    PREPARE hulld_put_hulls(text[], bytea[]) AS
      INSERT INTO hulld.hulls (hull_id, record) SELECT * FROM unnest($1, $2)
      ON CONFLICT (hull_id) DO UPDATE SET record = excluded.record;
    PREPARE hulld_put_bodies(text[], bytea[]) AS
      INSERT INTO hulld.bodies (body_id, body) SELECT * FROM unnest($1, $2)
      ON CONFLICT (body_id) DO UPDATE SET body = excluded.body;
    PREPARE hulld_put_writers(text[], bigint[], text[], bytea[]) AS
      INSERT INTO hulld.writers (hull_id, incarnation, writer_id, sequence)
      SELECT * FROM unnest($1, $2, $3, $4)
      ON CONFLICT (hull_id, incarnation, writer_id) DO UPDATE SET sequence = excluded.sequence;
    PREPARE hulld_put_bases(text[], bigint[], bigint[], integer[], bytea[]) AS
      INSERT INTO hulld.bases (hull_id, incarnation, revision, part, vertices)
      SELECT * FROM unnest($1, $2, $3, $4, $5);
    PREPARE hulld_put_deltas(text[], bigint[], bigint[], bytea[]) AS
      INSERT INTO hulld.deltas (hull_id, incarnation, revision, vertices)
      SELECT * FROM unnest($1, $2, $3, $4);)";
}

StoreTotals AddedBy(std::span<const Change* const> changes) {
  StoreTotals added;
  for (const Change* change : changes) {
    if (change->body != nullptr) {
      if (change->deleted) {
        --added.bodies;
      } else if (change->begins && !change->replaces_body) {
        ++added.bodies;
      }
      continue;
    }
    const uint64_t vertices = change->hull.record.vertex_count;
    if (change->deleted) {
      --added.hulls;
      added.vertices -= vertices;
    } else if (change->begins) {
      if (!change->replaced.has_value()) ++added.hulls;
      added.vertices += vertices;
      if (change->replaced.has_value()) added.vertices -= change->replaced->record.vertex_count;
    } else {
      added.vertices += vertices - change->previous_vertices;
    }
  }
  return added;
}

std::vector<Statement> StatementsOf(std::span<const Change* const> changes) {
  std::map<std::string, HullRows> hulls;
  std::map<std::string, const Change*> bodies;
  for (const Change* change : changes) {
    if (change->body != nullptr) {
      bodies[change->body->record.body_id] = change;
    } else {
      hulls[change->hull.record.hull_id].Add(*change);
    }
  }
  Encoder drops;
  Encoder puts;
  for (const auto& [hull_id, rows] : hulls) {
    AddDrops(hull_id, rows, drops);
    AddRows(hull_id, rows, puts);
  }
  for (const auto& [id, last] : bodies) {
    if (last->deleted) {
      drops.Add("hulld_drop_bodies", {Text(id)});
    } else {
      puts.Add("hulld_put_bodies", {Text(id), Sealed(BodyKey(id), EncodeStoredBody(*last->body))});
    }
  }
  std::vector<Statement> statements = std::move(drops).Take();
  std::ranges::move(std::move(puts).Take(), std::back_inserter(statements));
  return statements;
}

std::vector<Statement> ListChanges(std::span<const Change* const> changes, uint64_t batch) {
  struct Row {
    uint64_t revision = 0;
    uint64_t ended_at = 0;
    uint64_t began = 0;
    bool was_body = false;
  };
  std::map<std::string, Row> rows;
  for (const Change* change : changes) {
    Row& row = rows[change->id()];
    row.revision = change->revision;
    const uint64_t began = CreateRevisionOfEnded(*change);
    if (began != 0 || change->deleted) row.ended_at = row.revision;
    if (row.began == 0) row.was_body = change->body != nullptr;
    if (row.began == 0) row.began = began;
  }
  Encoder list;
  for (const auto& [id, row] : rows) {
    list.Add("hulld_put_changes",
             {Bigint(batch), Text(id), Bigint(row.revision), Bigint(row.ended_at),
              Bigint(row.was_body ? 0 : row.began), Bigint(row.was_body ? row.began : 0)});
  }
  return std::move(list).Take();
}

}  // namespace hulld::server
