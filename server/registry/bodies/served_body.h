#ifndef HULLD_SERVER_REGISTRY_BODIES_SERVED_BODY_H_
#define HULLD_SERVER_REGISTRY_BODIES_SERVED_BODY_H_

#include <cstdint>
#include <memory>
#include <vector>

#include "core/query/body/query_body.h"
#include "server/registry/catalog/body.h"
#include "server/registry/catalog/registry_types.h"
#include "server/registry/memory/memory_budget.h"

namespace hulld::server {

// A body as seen by one call. Holds the hulls of its pieces; charged to --memory-limit.
struct ServedBody {
  std::shared_ptr<const Body> body;
  // In the order of Body::hull_ids().
  std::vector<HullView> hulls;
  QueryBody query;
  MemoryCharge charge;

  const HullView& hull_of(uint32_t piece) const { return hulls[body->pieces()[piece].hull]; }
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_REGISTRY_BODIES_SERVED_BODY_H_
