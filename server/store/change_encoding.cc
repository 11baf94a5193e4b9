#include "server/store/change_encoding.h"

#include <algorithm>
#include <span>
#include <utility>

#include "server/store/store_keys.h"

namespace hulld::server {

void PutSealed(rocksdb::WriteBatch& batch, const std::string& key, std::string value) {
  batch.Put(key, Seal(key, std::move(value)));
}

namespace {

// Deletes all keys of an incarnation except its record.
void DropIncarnation(rocksdb::WriteBatch& batch, const StoredHull& hull,
                     const VertexLayout& layout) {
  const uint64_t incarnation = hull.record.create_revision;
  const auto drop = [&](char prefix) {
    batch.DeleteRange(IncarnationKey(prefix, incarnation), IncarnationKey(prefix, incarnation + 1));
  };
  if (hull.writer_count > 0) drop(kWriterPrefix);
  if (layout.base_revision != 0) drop(kBasePrefix);
  if (layout.delta_count > 0) drop(kDeltaPrefix);
}

void PutBase(rocksdb::WriteBatch& batch, const Change& change) {
  const HullRecord& record = change.hull.record;
  const uint64_t incarnation = record.create_revision;
  if (change.former_layout.base_revision != 0) {
    batch.DeleteRange(IncarnationKey(kBasePrefix, incarnation),
                      BaseKey(incarnation, record.revision, 0));
  }
  if (change.former_layout.delta_count > 0) {
    batch.DeleteRange(IncarnationKey(kDeltaPrefix, incarnation),
                      DeltaKey(incarnation, record.revision));
  }
  std::span<const Vector> rest = change.vertices;
  for (uint32_t part = 0; !rest.empty(); ++part) {
    const auto vertices = rest.first(std::min(rest.size(), kBasePartVertices));
    PutSealed(batch, BaseKey(incarnation, record.revision, part), EncodeVertices(vertices));
    rest = rest.subspan(vertices.size());
  }
}

void EncodeBody(rocksdb::WriteBatch& batch, const StoredBody& body, bool deleted) {
  const std::string key = BodyKey(body.record.body_id);
  if (deleted) {
    batch.Delete(key);
  } else {
    PutSealed(batch, key, EncodeStoredBody(body));
  }
}

}  // namespace

bool EndsUnknown(const Change& change) {
  if (change.body != nullptr) return false;
  if (change.deleted) return change.hull.record.create_revision == 0;
  return change.replaced.has_value() && change.replaced->record.create_revision == 0;
}

void EncodeChange(rocksdb::WriteBatch& batch, const Change& change) {
  if (change.body != nullptr) return EncodeBody(batch, *change.body, change.deleted);
  const HullRecord& record = change.hull.record;
  const std::string hull_key = HullKey(record.hull_id);
  if (change.replaced.has_value()) {
    DropIncarnation(batch, *change.replaced, change.replaced->layout);
  }
  if (change.deleted) {
    batch.Delete(hull_key);
    DropIncarnation(batch, change.hull, change.former_layout);
    return;
  }
  PutSealed(batch, hull_key, EncodeStoredHull(change.hull));
  if (change.writer.has_value()) {
    PutSealed(batch, WriterKey(record.create_revision, change.writer->writer_id),
              EncodeNumber(change.writer->sequence));
  }
  if (change.vertex_change == VertexChange::kReplaced) PutBase(batch, change);
  if (change.vertex_change == VertexChange::kAdded) {
    PutSealed(batch, DeltaKey(record.create_revision, record.revision),
              EncodeVertices(change.vertices));
  }
}

}  // namespace hulld::server
