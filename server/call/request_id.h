#ifndef HULLD_SERVER_CALL_REQUEST_ID_H_
#define HULLD_SERVER_CALL_REQUEST_ID_H_

#include <string>

namespace hulld::server {

// Whether a client may name its request so: 1 to 128 letters, digits or -_.:/+=, so that it can
// stand in a log and in metadata as it is.
bool IsRequestId(const std::string& text);

// An ID that no other request has: random per process, then counted. Cost: ~100 ns.
std::string NextRequestId();

}  // namespace hulld::server

#endif  // HULLD_SERVER_CALL_REQUEST_ID_H_
