#ifndef HULLD_SERVER_STORE_H_
#define HULLD_SERVER_STORE_H_

#include <absl/status/status.h>

#include <cstdint>
#include <span>
#include <string>
#include <variant>

#include "core/hull/hull.h"
#include "core/hull/hull_builder.h"

namespace hulld::server {

// What a committed change survives.
enum class Durability {
  kMemory,  // nothing: it is lost when the server ends
};

// A hull that was empty from `revision` on.
struct HullCreated {
  const std::string& hull_id;
  uint64_t revision;
};

// A chunk that was applied. `revision` is the hull's afterwards: its former one when no vertex
// changed.
struct ChunkApplied {
  const std::string& hull_id;
  uint64_t create_revision;
  uint64_t revision;
  const std::string& writer_id;
  uint64_t sequence;
  std::span<const Vector> points;
  PointCounts counts;
};

struct HullDeleted {
  const std::string& hull_id;
  uint64_t create_revision;
  uint64_t revision;
};

using Change = std::variant<HullCreated, ChunkApplied, HullDeleted>;

// Where changes are kept, beside the registry that serves them.
class Store {
 public:
  virtual ~Store() = default;

  // As in --store.
  virtual std::string kind() const = 0;
  // Random per store.
  virtual std::string id() const = 0;
  virtual Durability durability() const = 0;
  // Keeps a change before anyone can see it; changes come one at a time, in the order in which they
  // take effect. An error refuses the change.
  virtual absl::Status Commit(const Change& change) = 0;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_STORE_H_
