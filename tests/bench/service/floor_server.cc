// A no-op server: hulld's services, transport, and message sizes, with precomputed answers. Its
// cost is the minimum of a call to hulld.
//
//   floor_server ADDRESS
//
// Call metadata `floor-found: N` makes FindCollisions answer N pairs.

#include <absl/synchronization/mutex.h>
#include <grpcpp/grpcpp.h>

#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "hulld/v1/collision.grpc.pb.h"
#include "hulld/v1/hull.grpc.pb.h"
#include "server/call/transport.h"
#include "server/process/heap.h"
#include "server/process/random_id.h"
#include "server/settings/config.h"

namespace hulld::bench {
namespace {

constexpr uint64_t kRevision = 14;
constexpr v1::Relation kRelation = v1::RELATION_SEPARATED;
constexpr v1::Rung kRung = v1::RUNG_FLOATING_POINT;
// A relation and a rung, each a byte.
constexpr int kPairsPerMessage = server::Config::kReplyMessageBytes / 2;

const std::string& StoreId() {
  static const auto* const id = new std::string(server::RandomId());
  return *id;
}

void FillHeader(v1::ResponseHeader* header) {
  header->set_store_id(StoreId());
  header->set_revision(kRevision);
}

void FillVersion(const std::string& hull_id, v1::HullVersion* version) {
  version->set_hull_id(hull_id);
  version->set_create_revision(kRevision);
  version->set_revision(kRevision);
  version->set_store_id(StoreId());
}

template <typename Request, typename Response>
void FillHead(const Request& request, Response* response) {
  FillHeader(response->mutable_header());
  for (const v1::Placement& placement : request.placements()) {
    FillVersion(placement.hull_id(), response->add_hulls());
  }
  for (const std::string& hull_id : request.packed_placements().hull_ids()) {
    FillVersion(hull_id, response->add_hulls());
  }
}

void FillColumns(int count, v1::AnswerColumns* columns) {
  columns->mutable_relations()->Resize(count, kRelation);
  columns->mutable_rungs()->Resize(count, kRung);
}

// Sends prebuilt messages.
template <typename Response>
class Replies : public grpc::ServerWriteReactor<Response> {
 public:
  explicit Replies(std::vector<Response> messages) : messages_(std::move(messages)) { Next(); }

  void OnWriteDone(bool /*ok*/) override { Next(); }
  void OnDone() override { delete this; }

 private:
  void Next() {
    if (next_ == messages_.size()) return this->Finish(grpc::Status::OK);
    this->StartWrite(&messages_[next_++]);
  }

  std::vector<Response> messages_;
  size_t next_ = 0;
};

// Answers each message before it reads the next.
template <typename Request, typename Response>
class Dialogue : public grpc::ServerBidiReactor<Request, Response> {
 public:
  Dialogue() { this->StartRead(&request_); }

  void OnReadDone(bool ok) override {
    if (!ok) return this->Finish(grpc::Status::OK);
    response_.Clear();
    Answer(request_, &response_);
    this->StartWrite(&response_);
  }
  void OnWriteDone(bool ok) override {
    if (!ok) return this->Finish(grpc::Status::OK);
    this->StartRead(&request_);
  }
  void OnDone() override { delete this; }

 protected:
  virtual void Answer(const Request& request, Response* response) = 0;

 private:
  Request request_;
  Response response_;
};

class UpdateDialogue : public Dialogue<v1::StreamCollisionsRequest, v1::StreamCollisionsResponse> {
  void Answer(const v1::StreamCollisionsRequest& request,
              v1::StreamCollisionsResponse* response) override {
    if (request.has_open()) {
      FillHead(request.open(), response);
      for (int i = 0; i < request.open().pairs_size() / 2; ++i) pairs_.push_back(i);
    } else {
      FillHeader(response->mutable_header());
    }
    response->set_update(updates_++);
    response->set_last(true);
    response->mutable_pairs()->Add(pairs_.begin(), pairs_.end());
    FillColumns(static_cast<int>(pairs_.size()), response->mutable_columns());
  }

  uint64_t updates_ = 0;
  std::vector<uint32_t> pairs_;
};

class AppendDialogue : public Dialogue<v1::AppendPointsRequest, v1::AppendPointsResponse> {
  void Answer(const v1::AppendPointsRequest& request, v1::AppendPointsResponse* response) override {
    if (request.has_open()) {
      v1::AppendOpened* const opened = response->mutable_opened();
      FillHeader(opened->mutable_header());
      opened->mutable_hull()->set_hull_id(request.open().hull_id());
      opened->set_writer_id(request.open().writer_id());
      return;
    }
    const v1::PointBlock& points = request.chunk().points();
    v1::AppendAck* const ack = response->mutable_ack();
    FillHeader(ack->mutable_header());
    ack->set_sequence(request.chunk().sequence());
    ack->set_outcome(v1::APPEND_OUTCOME_APPLIED);
    ack->set_durability(v1::DURABILITY_MEMORY);
    ack->set_hull_revision(kRevision);
    ack->set_vertex_count(kRevision);
    ack->mutable_counts()->set_received((points.xyz_size() + points.xyz_float_size()) / 3);
    ack->mutable_counts()->set_outside((points.xyz_size() + points.xyz_float_size()) / 3);
  }
};

class HullFloor : public v1::HullService::CallbackService {
 public:
  grpc::ServerBidiReactor<v1::AppendPointsRequest, v1::AppendPointsResponse>* AppendPoints(
      grpc::CallbackServerContext* /*context*/) override {
    return new AppendDialogue();
  }
  grpc::ServerUnaryReactor* DeleteHull(grpc::CallbackServerContext* context,
                                       const v1::DeleteHullRequest* /*request*/,
                                       v1::DeleteHullResponse* response) override {
    FillHeader(response->mutable_header());
    grpc::ServerUnaryReactor* const reactor = context->DefaultReactor();
    reactor->Finish(grpc::Status::OK);
    return reactor;
  }
};

class CollisionFloor : public v1::CollisionService::CallbackService {
 public:
  grpc::ServerUnaryReactor* CheckCollision(grpc::CallbackServerContext* context,
                                           const v1::CheckCollisionRequest* request,
                                           v1::CheckCollisionResponse* response) override {
    FillHeader(response->mutable_header());
    FillVersion(request->a().hull_id(), response->mutable_hull_a());
    FillVersion(request->b().hull_id(), response->mutable_hull_b());
    response->set_relation(kRelation);
    response->set_rung(kRung);
    grpc::ServerUnaryReactor* const reactor = context->DefaultReactor();
    reactor->Finish(grpc::Status::OK);
    return reactor;
  }

  grpc::ServerWriteReactor<v1::BatchCheckCollisionsResponse>* BatchCheckCollisions(
      grpc::CallbackServerContext* /*context*/,
      const v1::BatchCheckCollisionsRequest* request) override {
    std::vector<v1::BatchCheckCollisionsResponse> messages(1);
    FillHead(*request, &messages.back());
    const int pairs = request->pairs_size() / 2;
    for (int begin = 0; begin < pairs; begin += kPairsPerMessage) {
      if (begin > 0) messages.emplace_back();
      messages.back().set_first_pair(begin);
      FillColumns(std::min(kPairsPerMessage, pairs - begin), messages.back().mutable_columns());
    }
    return new Replies<v1::BatchCheckCollisionsResponse>(std::move(messages));
  }

  grpc::ServerBidiReactor<v1::StreamCollisionsRequest, v1::StreamCollisionsResponse>*
  StreamCollisions(grpc::CallbackServerContext* /*context*/) override {
    return new UpdateDialogue();
  }

  grpc::ServerWriteReactor<v1::FindCollisionsResponse>* FindCollisions(
      grpc::CallbackServerContext* context, const v1::FindCollisionsRequest* request) override {
    const auto metadata = context->client_metadata().find("floor-found");
    int found = 0;
    if (metadata != context->client_metadata().end()) {
      found = std::atoi(std::string(metadata->second.begin(), metadata->second.end()).c_str());
    }
    std::vector<v1::FindCollisionsResponse> messages(2);
    FillHead(*request, &messages[0]);
    const auto placements = static_cast<uint32_t>(request->placements_size() +
                                                  request->packed_placements().hulls_size());
    for (int i = 0; i < found; ++i) {
      messages[1].add_pairs(static_cast<uint32_t>(i) % placements);
      messages[1].add_pairs(placements - 1);
    }
    FillColumns(found, messages[1].mutable_columns());
    messages[1].mutable_totals()->set_overlapping(found);
    return new Replies<v1::FindCollisionsResponse>(std::move(messages));
  }
};

int Main(const std::string& address) {
  server::SetUpHeap();
  HullFloor hulls;
  CollisionFloor collisions;
  grpc::ServerBuilder builder;
  int port = 0;
  builder.AddListeningPort(address, grpc::InsecureServerCredentials(), &port);
  server::SetTransport(server::Config(), builder);
  builder.RegisterService(&hulls);
  builder.RegisterService(&collisions);
  const std::unique_ptr<grpc::Server> server = builder.BuildAndStart();
  if (server == nullptr) return 1;
  const bool is_unix = address.starts_with("unix:");
  const std::string host = address.substr(0, address.rfind(':') + 1);
  std::fprintf(stderr, "listening on %s\n",
               is_unix ? address.c_str() : (host + std::to_string(port)).c_str());
  server->Wait();
  return 0;
}

}  // namespace
}  // namespace hulld::bench

int main(int argc, char** argv) {
  absl::SetMutexDeadlockDetectionMode(absl::OnDeadlockCycle::kIgnore);  // as hulld does
  if (argc == 2) return hulld::bench::Main(argv[1]);
  std::fprintf(stderr, "usage: floor_server ADDRESS\n");
  return 2;
}
