#ifndef HULLD_TESTS_FUZZ_SERVICE_SERVICE_PROGRAM_H_
#define HULLD_TESTS_FUZZ_SERVICE_SERVICE_PROGRAM_H_

#include <grpcpp/grpcpp.h>

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "client/packed_placements.h"
#include "server/contract/rpc.h"
#include "tests/fuzz/byte_reader.h"
#include "tests/fuzz/service/fuzz_message.h"
#include "tests/fuzz/service/reply_check.h"
#include "tests/fuzz/service/service_contract.h"
#include "tests/fuzz/service/service_fuzz.h"
#include "tests/fuzz/service/watch_check.h"

namespace hulld::fuzz {

// What replies tell of a hull, whichever call they answer.
std::string Known(const v1::HullInfo& hull);

// Whether a call can change a hull.
bool ChangesHulls(server::Rpc rpc);

// One run of one program: decodes and makes its calls, and checks what comes back.
class ServiceProgram {
 public:
  // hulls: all that there are, by ID.
  ServiceProgram(ServiceFuzz& service, std::map<std::string, v1::HullInfo> hulls,
                 std::span<const uint8_t> program)
      : service_(service), in_(program), hulls_(std::move(hulls)) {}

  // The first finding, or nothing.
  std::string Run();
  // Whether the hulls that no program can name are as they were, and the server answers.
  std::string CheckGuards();
  // Whether the hulls that are there are those that the server acknowledged, of whose changes each
  // was answered or refused: nothing is lost, and what was refused has changed nothing. Requires
  // that no call runs.
  std::string CheckAcknowledged();

 private:
  void Step();
  void CreateHull();
  void AppendPoints();
  void ReplaceHull();
  void GetHull();
  void GetHullMesh();
  void ListHulls();
  void DeleteHull();
  void CheckCollision();
  void BatchCheckCollisions();
  void StreamCollisions();
  void FindCollisions();
  void GetStatus();
  void SaveBackup();
  void WatchHulls();
  void WatchCollisions();
  void PutBody();
  void GetBody();
  void ListBodies();
  void DeleteBody();
  void AskAboutBody();
  void SendRaw();

  MessageHints Hints() const { return {revision_, 1, 0, service_.store_id_}; }
  // Gives the call its deadline, rarely one that has passed.
  void Hurry(grpc::ClientContext& context, CallManner& manner);
  void Note(std::string finding);
  void Reach(const std::string& what) { ++service_.reached_[what]; }
  // How a call ended; true when OK.
  bool Ended(server::Rpc rpc, const CallManner& manner, const grpc::Status& status);
  // A call that its client gives up may still change something: waits until all calls have ended.
  void Settle();
  // Takes the header of a watch, whose revision is that of what was told.
  void SeeStore(const v1::ResponseHeader& header);
  void SeeHeader(const v1::ResponseHeader& header);
  void SeeHull(const v1::HullInfo& hull);
  // A hull that a reply tells of is the one that was acknowledged.
  void SeeKnownHull(const v1::HullInfo& hull);
  // A change of this hull was not acknowledged, and not refused for certain.
  void Doubt(const std::string& hull_id) { doubtful_.insert(hull_id); }
  // `if_revision` as a client has it that knows this hull, where it is to be the last one seen.
  uint64_t RevisionToExpect(const std::string& hull_id, uint64_t if_revision) const;

  // One unary call; true when it ended OK, its header checked.
  template <typename Stub, typename Request, typename Response>
  bool Call(server::Rpc rpc, Stub& stub,
            grpc::Status (Stub::*method)(grpc::ClientContext*, const Request&, Response*),
            const Request& request, Response* response) {
    grpc::ClientContext context;
    CallManner manner;
    Hurry(context, manner);
    const bool ok = Ended(rpc, manner, (stub.*method)(&context, request, response));
    if constexpr (requires { request.hull_id(); }) {
      if (!ok && manner.hurried && ChangesHulls(rpc)) Doubt(request.hull_id());
    }
    if (ok) SeeHeader(response->header());
    return ok;
  }
  // One server stream; `parts` holds all of it and true comes back when it was read to an OK end.
  template <typename Stub, typename Request, typename Response>
  bool ReadStream(server::Rpc rpc, Stub& stub,
                  std::unique_ptr<grpc::ClientReader<Response>> (Stub::*method)(
                      grpc::ClientContext*, const Request&),
                  const Request& request, std::vector<Response>* parts);

  // Careful calls, beside the program's own: they must end OK.
  std::vector<double> VerticesOf(const std::string& hull_id);
  void CheckCertificateOf(const v1::CheckCollisionRequest& asked,
                          const v1::CheckCollisionResponse& answer);
  std::vector<v1::Relation> AskBatch(const v1::BatchCheckCollisionsRequest& request);
  void CompareSceneWithBatch(const v1::FindCollisionsRequest& request,
                             std::span<const v1::FindCollisionsResponse> parts);

  // One that is there, mostly.
  std::string AnyHull();
  // Whether a body's relation is the strongest of its pieces', and its certificates prove it.
  void CompareWithPieces(const v1::CheckCollisionRequest& request,
                         const v1::CheckCollisionResponse& response);

  // One WatchHulls call; true when all was told that is to be.
  bool WatchHullsOnce(const v1::WatchHullsRequest& request, bool then_change,
                      HullWatchCheck* check);
  std::vector<std::string> ChangedSince(const std::map<std::string, v1::HullInfo>& before) const;
  void CompareWatched(const HullWatchCheck& check);
  void CompareWatchWithBatch(const CollisionWatchCheck& check);

  v1::AppendPointsRequest NextAppendMessage(bool first, uint64_t* sequence);
  v1::ReplaceHullRequest NextReplaceMessage(bool first);
  v1::StreamCollisionsRequest NextCollisionMessage(bool first, size_t placements);
  v1::WatchCollisionsRequest NextWatchMessage(bool first, size_t placements);
  // The same request in its other form, now and then.
  template <typename Request>
  std::optional<Request> MaybePacked(const Request& request) {
    if (request.placements().empty() || request.has_packed_placements() || !in_.OneOf(3)) {
      return std::nullopt;
    }
    Request packed = request;
    *packed.mutable_packed_placements() = PackPlacements(request.placements());
    packed.clear_placements();
    return packed;
  }

  ServiceFuzz& service_;
  ByteReader in_;
  std::string finding_;
  // The revision of the hull that was last seen.
  uint64_t revision_ = 0;
  // What the server has acknowledged of each hull, and of which that is not all.
  std::map<std::string, v1::HullInfo> hulls_;
  std::set<std::string> doubtful_;
  // Those of the bodies whose last change was acknowledged.
  std::map<std::string, v1::PutBodyRequest> bodies_;
  // A change of any hull may have happened.
  bool all_doubtful_ = false;
  // Streams that nobody reads; they end with the program.
  std::vector<std::shared_ptr<void>> idle_;
  // A watch that lasts while other calls are made; null once it was given up.
  grpc::ClientContext* watch_ = nullptr;
};

}  // namespace hulld::fuzz

#endif  // HULLD_TESTS_FUZZ_SERVICE_SERVICE_PROGRAM_H_
