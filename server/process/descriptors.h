#ifndef HULLD_SERVER_PROCESS_DESCRIPTORS_H_
#define HULLD_SERVER_PROCESS_DESCRIPTORS_H_

#include <cstdint>
#include <string>

namespace hulld::server {

// What this process has open.
struct OpenDescriptors {
  // All that are open; 0 where /proc is not there.
  uint64_t count = 0;
  // Connections that others made to the address.
  uint64_t connections = 0;
};

// address: where the process listens, as ListenAddress::Format writes it: "host:port" or
// "unix:path". Cost: ~2 us a descriptor.
OpenDescriptors CountDescriptors(const std::string& address);

// How many it may have open.
uint64_t MostDescriptors();

}  // namespace hulld::server

#endif  // HULLD_SERVER_PROCESS_DESCRIPTORS_H_
