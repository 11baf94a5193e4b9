#include "server/store/postgres/batch_statements.h"

#include <algorithm>
#include <initializer_list>
#include <iterator>
#include <map>
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
    drops_vertices = drops_vertices || !change.former_layout.empty();
    base = &change;
    deltas.clear();
  } else if (change.vertex_change == VertexChange::kAdded) {
    deltas.push_back(&change);
  }
}

// Rows of a table, column by column.
class RowsOfTable {
 public:
  RowsOfTable(const char* statement, std::initializer_list<Element> columns)
      : statement_(statement), columns_(columns.begin(), columns.end()) {}

  void Add(std::initializer_list<std::string_view> row, std::vector<Statement>* statements) {
    size_t bytes = 0;
    auto column = columns_.begin();
    for (const std::string_view value : row) {
      column->Add(value);
      bytes += (column++)->bytes();
    }
    if (bytes >= kMaxStatementBytes) Flush(statements);
  }

  void Flush(std::vector<Statement>* statements) {
    if (columns_.front().count() == 0) return;
    Statement statement = {.name = statement_};
    for (ArrayParameter& column : columns_) statement.parameters.push_back(column.Take());
    statements->push_back(std::move(statement));
  }

 private:
  const char* const statement_;
  std::vector<ArrayParameter> columns_;
};

class Encoder {
 public:
  void AddDrops(const std::string& hull_id, const HullRows& rows) {
    if (rows.last->deleted) no_hulls_.Add({hull_id}, &drops_);
    if (rows.drops_all) no_writers_.Add({hull_id}, &drops_);
    if (!rows.drops_all && !rows.drops_vertices) return;
    no_bases_.Add({hull_id}, &drops_);
    no_deltas_.Add({hull_id}, &drops_);
  }

  void AddRows(const std::string& hull_id, const HullRows& rows) {
    if (rows.last->deleted) return;
    const HullRecord& record = rows.last->hull.record;
    const uint64_t incarnation = record.create_revision;
    hulls_.Add({hull_id, Seal(HullKey(hull_id), EncodeStoredHull(rows.last->hull))}, &puts_);
    const std::string incarnation_column = EncodeBigint(incarnation);
    for (const auto& [writer_id, sequence] : rows.sequences) {
      writers_.Add({hull_id, incarnation_column, writer_id,
                    Seal(WriterKey(incarnation, writer_id), EncodeNumber(sequence))},
                   &puts_);
    }
    if (rows.base != nullptr) AddBase(hull_id, *rows.base);
    for (const Change* delta : rows.deltas) {
      const uint64_t revision = delta->hull.record.revision;
      deltas_.Add({hull_id, incarnation_column, EncodeBigint(revision),
                   Seal(DeltaKey(incarnation, revision), EncodeVertices(delta->vertices))},
                  &puts_);
    }
  }

  void AddBody(const std::string& body_id, const Change& last) {
    if (last.deleted) return no_bodies_.Add({body_id}, &drops_);
    bodies_.Add({body_id, Seal(BodyKey(body_id), EncodeStoredBody(*last.body))}, &puts_);
  }

  std::vector<Statement> Take() && {
    for (RowsOfTable* table : {&no_hulls_, &no_bodies_, &no_writers_, &no_bases_, &no_deltas_}) {
      table->Flush(&drops_);
    }
    for (RowsOfTable* table : {&hulls_, &bodies_, &writers_, &bases_, &deltas_})
      table->Flush(&puts_);
    std::ranges::move(puts_, std::back_inserter(drops_));
    return std::move(drops_);
  }

 private:
  void AddBase(const std::string& hull_id, const Change& change) {
    const uint64_t incarnation = change.hull.record.create_revision;
    const uint64_t revision = change.hull.record.revision;
    std::span<const Vector> rest = change.vertices;
    for (uint32_t part = 0; !rest.empty(); ++part) {
      const auto vertices = rest.first(std::min(rest.size(), kBasePartVertices));
      bases_.Add({hull_id, EncodeBigint(incarnation), EncodeBigint(revision), EncodeInteger(part),
                  Seal(BaseKey(incarnation, revision, part), EncodeVertices(vertices))},
                 &puts_);
      rest = rest.subspan(vertices.size());
    }
  }

  std::vector<Statement> drops_;
  std::vector<Statement> puts_;
  RowsOfTable no_hulls_{"hulld_drop_hulls", {Element::kText}};
  RowsOfTable no_bodies_{"hulld_drop_bodies", {Element::kText}};
  RowsOfTable no_writers_{"hulld_drop_writers", {Element::kText}};
  RowsOfTable no_bases_{"hulld_drop_bases", {Element::kText}};
  RowsOfTable no_deltas_{"hulld_drop_deltas", {Element::kText}};
  RowsOfTable hulls_{"hulld_put_hulls", {Element::kText, Element::kBytea}};
  RowsOfTable bodies_{"hulld_put_bodies", {Element::kText, Element::kBytea}};
  RowsOfTable writers_{"hulld_put_writers",
                       {Element::kText, Element::kBigint, Element::kText, Element::kBytea}};
  RowsOfTable bases_{
      "hulld_put_bases",
      {Element::kText, Element::kBigint, Element::kBigint, Element::kInteger, Element::kBytea}};
  RowsOfTable deltas_{"hulld_put_deltas",
                      {Element::kText, Element::kBigint, Element::kBigint, Element::kBytea}};
};

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
      added.vertices += vertices - change->former_vertices;
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
  Encoder encoder;
  for (const auto& [hull_id, rows] : hulls) encoder.AddDrops(hull_id, rows);
  for (const auto& [hull_id, rows] : hulls) encoder.AddRows(hull_id, rows);
  for (const auto& [body_id, last] : bodies) encoder.AddBody(body_id, *last);
  return std::move(encoder).Take();
}

}  // namespace hulld::server
