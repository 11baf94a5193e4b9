#ifndef HULLD_SERVER_CALL_REQUEST_ID_H_
#define HULLD_SERVER_CALL_REQUEST_ID_H_

#include <string>

namespace hulld::server {

// Returns true if `text` is a valid request ID: 1 to 128 letters, digits or -_.:/+=, safe in logs
// and metadata without escaping.
bool IsRequestId(const std::string& text);

// Returns a unique request ID: a random part for the process, followed by a counter. Cost: ~100 ns.
std::string NextRequestId();

}  // namespace hulld::server

#endif  // HULLD_SERVER_CALL_REQUEST_ID_H_
