#ifndef HULLD_SERVER_MEMORY_LIMIT_H_
#define HULLD_SERVER_MEMORY_LIMIT_H_

#include <cstdint>

namespace hulld::server {

// Half of the memory that this process may use: the machine's, or its control group's (version 2,
// then 1) where that is less. Bytes.
uint64_t DefaultMemoryLimit();

}  // namespace hulld::server

#endif  // HULLD_SERVER_MEMORY_LIMIT_H_
