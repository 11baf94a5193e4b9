#ifndef HULLD_SERVER_CALL_MESSAGE_BYTES_H_
#define HULLD_SERVER_CALL_MESSAGE_BYTES_H_

#include <absl/status/status.h>
#include <google/protobuf/message.h>
#include <grpcpp/grpcpp.h>
#include <grpcpp/support/byte_buffer.h>

#include <atomic>
#include <cstdint>
#include <utility>

namespace hulld::server {

// Memory of all parsed requests that are not answered yet. Bounded by --request-memory, so that
// many callers together cannot exhaust the machine's memory. Thread-safe.
class RequestMemory {
 public:
  // Share of a request, released on destruction. The RequestMemory must outlive it. Not
  // thread-safe.
  class Share {
   public:
    Share() = default;
    Share(Share&& other) noexcept
        : memory_(std::exchange(other.memory_, nullptr)), bytes_(std::exchange(other.bytes_, 0)) {}
    Share& operator=(Share&& other) noexcept {
      std::swap(memory_, other.memory_);
      std::swap(bytes_, other.bytes_);
      return *this;
    }
    ~Share() { Release(); }

    void Release() {
      if (memory_ != nullptr) memory_->taken_.fetch_sub(bytes_, std::memory_order_relaxed);
      memory_ = nullptr;
      bytes_ = 0;
    }
    uint64_t bytes() const { return bytes_; }

   private:
    friend class RequestMemory;
    RequestMemory* memory_ = nullptr;
    uint64_t bytes_ = 0;
  };

  explicit RequestMemory(uint64_t limit_bytes) : limit_bytes_(limit_bytes) {}
  RequestMemory(const RequestMemory&) = delete;
  RequestMemory& operator=(const RequestMemory&) = delete;

  // Sets `share` to this many bytes, releasing its previous bytes. RESOURCE_EXHAUSTED: the request
  // alone exceeds the limit or, with a retry delay, other requests leave no room for it.
  absl::Status Take(uint64_t bytes, Share& share);

  uint64_t limit_bytes() const { return limit_bytes_; }
  uint64_t taken_bytes() const { return taken_.load(std::memory_order_relaxed); }

 private:
  const uint64_t limit_bytes_;
  std::atomic<uint64_t> taken_ = 0;
};

// Serialized messages, as gRPC transports them. Calls exchange bytes instead of messages, because
// gRPC would parse a request before authentication and without a limit.

using Bytes = grpc::ByteBuffer;
using CallContext = grpc::CallbackServerContext;
using UnaryReactor = grpc::ServerUnaryReactor;
using ReadReactor = grpc::ServerReadReactor<Bytes>;
using WriteReactor = grpc::ServerWriteReactor<Bytes>;
using BidiReactor = grpc::ServerBidiReactor<Bytes, Bytes>;

// Parses a request of an admitted caller and frees its bytes. `share` then covers the message and
// must live as long. INVALID_ARGUMENT: the bytes are not a message of this type.
// RESOURCE_EXHAUSTED: see RequestMemory::Take; the message is then not parsed.
absl::Status ParseRequest(Bytes& bytes, RequestMemory& memory, google::protobuf::Message* message,
                          RequestMemory::Share& share);

// Moves the bytes out of a request that gRPC passes as const but no longer needs.
inline Bytes StealBytes(const Bytes& bytes) {
  Bytes taken;
  taken.Swap(const_cast<Bytes*>(&bytes));
  return taken;
}

Bytes SerializeReply(const google::protobuf::Message& message);

}  // namespace hulld::server

#endif  // HULLD_SERVER_CALL_MESSAGE_BYTES_H_
