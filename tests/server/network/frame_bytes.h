#ifndef HULLD_TESTS_SERVER_NETWORK_FRAME_BYTES_H_
#define HULLD_TESTS_SERVER_NETWORK_FRAME_BYTES_H_

#include <cstdint>
#include <string>

namespace hulld::server {

// Raw HTTP/2 bytes, to send frames that no client library sends.
inline const std::string kPrefaceBytes = "PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n";

enum class Frame : uint8_t {
  kData = 0,
  kHeaders = 1,
  kResetStream = 3,
  kSettings = 4,
  kPing = 6,
  kWindowUpdate = 8,
  kContinuation = 9,
};
inline constexpr uint8_t kEndStreamFlag = 1;
inline constexpr uint8_t kEndHeadersFlag = 4;

inline std::string BigEndian(uint32_t number) {
  std::string bytes;
  for (int shift = 24; shift >= 0; shift -= 8) bytes += static_cast<char>(number >> shift);
  return bytes;
}

inline std::string FrameBytes(Frame type, uint8_t flags, uint32_t stream,
                              const std::string& payload) {
  std::string bytes = BigEndian(static_cast<uint32_t>(payload.size())).substr(1);
  bytes += static_cast<char>(type);
  bytes += static_cast<char>(flags);
  return bytes + BigEndian(stream) + payload;
}

// Returns an uncompressed header block of gRPC.
inline std::string HeaderBlock(const std::string& path) {
  const auto text = [](const std::string& value) {
    return static_cast<char>(value.size()) + value;
  };
  return "\x83\x86\x04" + text(path) + "\x01" + text("hulld") + "\x0f\x10" +
         text("application/grpc") + std::string(1, '\0') + text("te") + text("trailers");
}

// Returns a gRPC message with its prefix.
inline std::string MessageBytes(const std::string& message) {
  return std::string(1, '\0') + BigEndian(static_cast<uint32_t>(message.size())) + message;
}

inline const std::string kOpening = kPrefaceBytes + FrameBytes(Frame::kSettings, 0, 0, "");

}  // namespace hulld::server

#endif  // HULLD_TESTS_SERVER_NETWORK_FRAME_BYTES_H_
