#ifndef HULLD_SERVER_REGISTRY_SERVED_HULL_H_
#define HULLD_SERVER_REGISTRY_SERVED_HULL_H_

#include <atomic>
#include <cstddef>
#include <mutex>
#include <optional>
#include <utility>

#include "core/hull/hull.h"
#include "core/query/placed/query_hull.h"

namespace hulld::server {

// What readers of one version of a hull share: its canonical snapshot and what is derived from
// that, made when the first request needs it and kept with it. Thread-safe.
class ServedHull {
 public:
  explicit ServedHull(Hull hull) : hull_(std::move(hull)) {}

  // The canonical snapshot.
  const Hull& hull() const { return hull_; }

  // What collision queries need of the hull. The first call makes it.
  const QueryHull& query_hull() const {
    std::call_once(query_hull_once_, [this] {
      query_hull_.emplace(hull_);
      query_hull_bytes_.store(query_hull_->MemoryBytes(), std::memory_order_release);
    });
    return *query_hull_;
  }
  // Whether query_hull() would only return.
  bool has_query_hull() const { return query_hull_bytes_.load(std::memory_order_acquire) > 0; }

  // What it holds in memory by now. Bytes.
  size_t MemoryBytes() const {
    return sizeof(*this) + hull_.MemoryBytes() + query_hull_bytes_.load(std::memory_order_relaxed);
  }

 private:
  const Hull hull_;
  mutable std::once_flag query_hull_once_;
  mutable std::optional<QueryHull> query_hull_;
  // Above 0 once it is made.
  mutable std::atomic<size_t> query_hull_bytes_ = 0;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_REGISTRY_SERVED_HULL_H_
