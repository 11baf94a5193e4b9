#ifndef HULLD_SERVER_PROCESS_RANDOM_ID_H_
#define HULLD_SERVER_PROCESS_RANDOM_ID_H_

#include <string>

namespace hulld::server {

// Returns 128 random bits as 32 hexadecimal digits: unique for all practical purposes.
std::string RandomId();

}  // namespace hulld::server

#endif  // HULLD_SERVER_PROCESS_RANDOM_ID_H_
