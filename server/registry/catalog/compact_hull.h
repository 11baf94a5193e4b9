#ifndef HULLD_SERVER_REGISTRY_CATALOG_COMPACT_HULL_H_
#define HULLD_SERVER_REGISTRY_CATALOG_COMPACT_HULL_H_

#include <cstddef>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "core/numeric/vector.h"

namespace hulld::server {

// Everything in memory that a small hull at rest needs besides its record. The structures for
// queries and growth are rebuilt at the next use, in some microseconds.
struct CompactHull {
  // At least the vertices, and no point outside the hull.
  std::vector<Vector> points;
  // Last sequence of each writer; empty if the store holds them.
  std::vector<std::pair<std::string, uint64_t>> writers;

  size_t MemoryBytes() const {
    size_t bytes = sizeof(*this) + points.capacity() * sizeof(Vector) +
                   writers.capacity() * sizeof(writers.front());
    for (const auto& [id, sequence] : writers) bytes += id.capacity();
    return bytes;
  }
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_REGISTRY_CATALOG_COMPACT_HULL_H_
