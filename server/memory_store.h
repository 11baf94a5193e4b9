#ifndef HULLD_SERVER_MEMORY_STORE_H_
#define HULLD_SERVER_MEMORY_STORE_H_

#include <string>

#include "server/random_id.h"
#include "server/store.h"

namespace hulld::server {

// Keeps nothing beside what the registry holds in memory; a new store at each start.
class MemoryStore : public Store {
 public:
  std::string kind() const override { return "memory"; }
  std::string id() const override { return id_; }
  Durability durability() const override { return Durability::kMemory; }
  absl::Status Commit(const Change&) override { return absl::OkStatus(); }

 private:
  const std::string id_ = RandomId();
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_MEMORY_STORE_H_
