#ifndef HULLD_TESTS_BENCH_SERVICE_GROWING_WRITER_H_
#define HULLD_TESTS_BENCH_SERVICE_GROWING_WRITER_H_

#include <grpcpp/grpcpp.h>

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "hulld/v1/hull.grpc.pb.h"

namespace hulld::bench {

// Returns a connection that is not shared.
std::shared_ptr<grpc::Channel> ConnectAlone(const std::string& address);

// One stream of single-point chunks, into an existing hull. Each point lies slightly outside the
// previous point in its direction and covers it, so that the number of vertices stays approximately
// constant. Requires: a hull within a radius of 1.1 about the origin. Ends the program if a call
// fails or a point was not outside.
class GrowingWriter {
 public:
  GrowingWriter(const std::shared_ptr<grpc::Channel>& channel, const std::string& hull_id,
                const std::string& writer_id);
  GrowingWriter(const GrowingWriter&) = delete;
  GrowingWriter& operator=(const GrowingWriter&) = delete;
  ~GrowingWriter();

  void Send();
  // Waits for an ack, which may cover several chunks.
  void Receive();
  void SendAndReceive() {
    Send();
    Receive();
  }
  uint64_t waiting() const { return sent_ - received_; }
  uint64_t received() const { return received_; }

 private:
  std::unique_ptr<v1::HullService::Stub> stub_;
  grpc::ClientContext context_;
  std::unique_ptr<grpc::ClientReaderWriter<v1::AppendPointsRequest, v1::AppendPointsResponse>>
      stream_;
  uint64_t sent_ = 0;
  uint64_t received_ = 0;
};

// Returns the value below which a share p of the values lies. Requires: sorted, non-empty values.
double Percentile(const std::vector<double>& sorted, double p);

}  // namespace hulld::bench

#endif  // HULLD_TESTS_BENCH_SERVICE_GROWING_WRITER_H_
