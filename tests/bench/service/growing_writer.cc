#include "tests/bench/service/growing_writer.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdlib>
#include <numbers>

#include "tests/bench/service/ball_hull.h"

namespace hulld::bench {

std::shared_ptr<grpc::Channel> ConnectAlone(const std::string& address) {
  grpc::ChannelArguments own;
  own.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
  return grpc::CreateCustomChannel(address, grpc::InsecureChannelCredentials(), own);
}

GrowingWriter::GrowingWriter(const std::shared_ptr<grpc::Channel>& channel,
                             const std::string& hull_id, const std::string& writer_id)
    : stub_(v1::HullService::NewStub(channel)), stream_(stub_->AppendPoints(&context_)) {
  v1::AppendPointsRequest open;
  open.mutable_open()->set_hull_id(hull_id);
  open.mutable_open()->set_writer_id(writer_id);
  v1::AppendPointsResponse reply;
  if (!stream_->Write(open) || !stream_->Read(&reply)) {
    Require(stream_->Finish(), "AppendPoints");
    std::abort();
  }
}

GrowingWriter::~GrowingWriter() {
  stream_->WritesDone();
  Require(stream_->Finish(), "AppendPoints");
}

void GrowingWriter::Send() {
  constexpr int kDirections = 16;
  // Counts the chunks of all writers, so that successive writers may grow the same hull.
  static std::atomic<int> count = 0;
  const int i = count++;
  const double angle = 2 * std::numbers::pi * (i % kDirections) / kDirections;
  const double radius = 1.1 + 1e-7 * i;
  v1::AppendPointsRequest request;
  request.mutable_chunk()->set_sequence(++sent_);
  for (const double x : {radius * std::cos(angle), radius * std::sin(angle), 0.0}) {
    request.mutable_chunk()->mutable_points()->add_xyz(x);
  }
  if (!stream_->Write(request)) std::abort();
}

void GrowingWriter::Receive() {
  v1::AppendPointsResponse reply;
  if (!stream_->Read(&reply)) std::abort();
  const v1::PointCounts& counts = reply.ack().counts();
  if (counts.outside() != counts.received()) std::abort();
  received_ = reply.ack().sequence();
}

double Percentile(const std::vector<double>& sorted, double p) {
  const auto at = static_cast<size_t>(p * static_cast<double>(sorted.size()));
  return sorted[std::min(sorted.size() - 1, at)];
}

}  // namespace hulld::bench
