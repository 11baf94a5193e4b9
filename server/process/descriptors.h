#ifndef HULLD_SERVER_PROCESS_DESCRIPTORS_H_
#define HULLD_SERVER_PROCESS_DESCRIPTORS_H_

#include <cstdint>

namespace hulld::server {

// Returns the number of open descriptors of this process; 0 without /proc. Cost: ~1 us each.
uint64_t CountDescriptors();

// Returns the limit on open descriptors.
uint64_t MostDescriptors();

// Raises that limit to the hard limit.
void RaiseDescriptorLimit();

}  // namespace hulld::server

#endif  // HULLD_SERVER_PROCESS_DESCRIPTORS_H_
