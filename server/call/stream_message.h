#ifndef HULLD_SERVER_CALL_STREAM_MESSAGE_H_
#define HULLD_SERVER_CALL_STREAM_MESSAGE_H_

#include <absl/status/status.h>
#include <google/protobuf/message.h>

namespace hulld::server {

// gRPC reports the end of a client's stream and a message that it cannot parse alike, as a read
// that is not ok. But parsing starts by clearing the message, and the end leaves it alone: so what
// is about to be read into gets a mark, which is gone afterwards if there was a message.

// Empties the message and marks it. Comes before each StartRead.
void PrepareToRead(google::protobuf::Message* message);

// After a read that was not ok: OK when the stream has ended, INVALID_ARGUMENT when its last
// message was malformed.
absl::Status WhyNotRead(const google::protobuf::Message& message);

}  // namespace hulld::server

#endif  // HULLD_SERVER_CALL_STREAM_MESSAGE_H_
