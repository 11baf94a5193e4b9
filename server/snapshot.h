#ifndef HULLD_SERVER_SNAPSHOT_H_
#define HULLD_SERVER_SNAPSHOT_H_

#include <mutex>
#include <optional>
#include <utility>

#include "core/hull/hull.h"
#include "core/query/query_hull.h"

namespace hulld::server {

// A hull's canonical snapshot and what is derived from it, made when the first request needs it and
// kept with it. Thread-safe.
class Snapshot {
 public:
  explicit Snapshot(Hull hull) : hull_(std::move(hull)) {}

  const Hull& hull() const { return hull_; }

  // What collision queries need of the hull. The first call makes it.
  const QueryHull& query_hull() const {
    std::call_once(query_hull_once_, [this] { query_hull_.emplace(hull_); });
    return *query_hull_;
  }

 private:
  const Hull hull_;
  mutable std::once_flag query_hull_once_;
  mutable std::optional<QueryHull> query_hull_;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_SNAPSHOT_H_
