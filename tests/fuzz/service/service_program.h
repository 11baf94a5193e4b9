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

// Returns the part of a hull's information that every reply contains.
std::string Known(const v1::HullInfo& hull);

// Returns true if a call can change a hull.
bool ChangesHulls(server::Rpc rpc);

// One run of a program: decodes and makes its calls, and checks the replies.
class ServiceProgram {
 public:
  // hulls: all existing ones, by ID.
  ServiceProgram(ServiceFuzz& service, std::map<std::string, v1::HullInfo> hulls,
                 std::span<const uint8_t> program)
      : service_(service), in_(program), hulls_(std::move(hulls)) {}

  // Returns the first finding, or empty.
  std::string Run();
  // Checks that the server answers and that the guards, which no program can name, are unchanged.
  std::string CheckGuards();
  // Checks that the existing hulls are those acknowledged, each with all acknowledged and no
  // refused changes. Requires: no call is running.
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
  void QueryBody();
  void SendRaw();

  MessageHints Hints() const { return {revision_, 1, 0, service_.store_id_}; }
  // Sets the call's deadline; rarely, one that has already passed.
  void Hurry(grpc::ClientContext& context, CallManner& manner);
  void Note(std::string finding);
  void Reach(const std::string& what) { ++service_.reached_[what]; }
  // Checks the final status of a call. Returns true if OK.
  bool Ended(server::Rpc rpc, const CallManner& manner, const grpc::Status& status);
  // Waits until all calls have ended: an abandoned call may still change something.
  void Settle();
  // Checks the header of a watch; its revision is that of the reported events.
  void SeeStore(const v1::ResponseHeader& header);
  void SeeHeader(const v1::ResponseHeader& header);
  void SeeHull(const v1::HullInfo& hull);
  // Checks that a hull in a reply equals the acknowledged one.
  void SeeKnownHull(const v1::HullInfo& hull);
  // Marks a hull with a change of unknown outcome.
  void Doubt(const std::string& hull_id) { doubtful_.insert(hull_id); }
  // Returns `if_revision`, or the acknowledged revision of the hull if `if_revision` is the
  // revision last seen.
  uint64_t RevisionToExpect(const std::string& hull_id, uint64_t if_revision) const;

  // Makes a unary call. Returns true if it ended OK with a valid header.
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
  // Reads a server stream into `parts`. Returns true if it ended OK.
  template <typename Stub, typename Request, typename Response>
  bool ReadStream(server::Rpc rpc, Stub& stub,
                  std::unique_ptr<grpc::ClientReader<Response>> (Stub::*method)(
                      grpc::ClientContext*, const Request&),
                  const Request& request, std::vector<Response>* parts);

  // Calls besides the program's own, which must end OK.
  std::vector<double> VerticesOf(const std::string& hull_id);
  void CheckCertificateOf(const v1::CheckCollisionRequest& query,
                          const v1::CheckCollisionResponse& answer);
  std::vector<v1::Relation> QueryBatch(const v1::BatchCheckCollisionsRequest& request);
  void CompareSceneWithBatch(const v1::FindCollisionsRequest& request,
                             std::span<const v1::FindCollisionsResponse> parts);

  // Returns a hull ID, usually of an existing hull.
  std::string AnyHull();
  // Checks that a body's relation is the strongest of its pieces', and that its certificates prove
  // it.
  void CompareWithPieces(const v1::CheckCollisionRequest& request,
                         const v1::CheckCollisionResponse& response);

  // Makes a WatchHulls call. Returns true if it reported everything expected.
  bool WatchHullsOnce(const v1::WatchHullsRequest& request, bool then_change,
                      HullWatchCheck* check);
  std::vector<std::string> ChangedSince(const std::map<std::string, v1::HullInfo>& before) const;
  void CompareWatched(const HullWatchCheck& check);
  void CompareWatchWithBatch(const CollisionWatchCheck& check);

  v1::AppendPointsRequest NextAppendMessage(bool first, uint64_t* sequence);
  v1::ReplaceHullRequest NextReplaceMessage(bool first);
  v1::StreamCollisionsRequest NextCollisionMessage(bool first, size_t placements);
  v1::WatchCollisionsRequest NextWatchMessage(bool first, size_t placements);
  // Sometimes returns the request in packed form, unless inline shapes may be malformed.
  template <typename Request>
  std::optional<Request> MaybePacked(const Request& request) {
    if (request.placements().empty() || request.has_packed_placements() || !in_.OneOf(3)) {
      return std::nullopt;
    }
    for (const v1::Placement& placement : request.placements()) {
      if (placement.has_points()) return std::nullopt;
    }
    Request packed = request;
    *packed.mutable_packed_placements() = PackPlacements(request.placements());
    packed.clear_placements();
    return packed;
  }

  ServiceFuzz& service_;
  ByteReader in_;
  std::string finding_;
  // Revision of the hull last seen.
  uint64_t revision_ = 0;
  // Acknowledged state of each hull, and the hulls with changes of unknown outcome.
  std::map<std::string, v1::HullInfo> hulls_;
  std::set<std::string> doubtful_;
  // Bodies with an acknowledged last change.
  std::map<std::string, v1::PutBodyRequest> bodies_;
  // True if any hull may have changed.
  bool all_doubtful_ = false;
  // Streams that are never read; they end with the program.
  std::vector<std::shared_ptr<void>> idle_;
  // A watch that runs during other calls; null after it is abandoned.
  grpc::ClientContext* watch_ = nullptr;
};

}  // namespace hulld::fuzz

#endif  // HULLD_TESTS_FUZZ_SERVICE_SERVICE_PROGRAM_H_
