#ifndef HULLD_TESTS_SERVER_HARNESS_HISTORY_HISTORY_CLIENT_H_
#define HULLD_TESTS_SERVER_HARNESS_HISTORY_HISTORY_CLIENT_H_

#include <grpcpp/grpcpp.h>

#include <functional>
#include <map>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include "hulld/v1/body.grpc.pb.h"
#include "hulld/v1/collision.grpc.pb.h"
#include "hulld/v1/freshness.pb.h"
#include "hulld/v1/hull.grpc.pb.h"
#include "tests/server/harness/history/hull_history.h"
#include "tests/server/harness/test_server.h"

namespace hulld::server {

// A hull of one point at the origin, placed at points of the cloud to probe other hulls. Not part
// of any history.
inline constexpr const char* kProbeHull = "probe";

// The cloud for histories: this many points, all extreme.
inline constexpr int kCloudSize = 48;
const Coordinates& HistoryCloud();

// A client that issues random calls and records requests and answers. Not thread-safe.
class HistoryClient {
 public:
  // name: its writer ID. `history` must outlive this client.
  HistoryClient(const std::shared_ptr<grpc::Channel>& channel, HullHistory& history,
                std::string name, uint64_t seed);

  // Makes later reads use any freshness: latest, the revision of the last answer, a bound of a few
  // milliseconds, or both. Default: latest.
  void ReadAtAnyFreshness() { any_freshness_ = true; }

  // Creates kProbeHull. Call once per store.
  void MakeProbe();

  // Directs later calls to another or restarted server. Open streams are lost.
  void Connect(const std::shared_ptr<grpc::Channel>& channel);

  // Issues one random call on this hull: any call, a change, or a read. Returns false if the server
  // was unavailable.
  bool CallAtRandom(const std::string& hull_id);
  bool ChangeAtRandom(const std::string& hull_id);
  bool ReadAtRandom(const std::string& hull_id);

  bool Create(const std::string& hull_id, bool if_absent);
  // Opens a stream if none is open, then appends one chunk (Append) or several pipelined chunks
  // (AppendAtOnce).
  bool Append(const std::string& hull_id);
  bool AppendAtOnce(const std::string& hull_id);
  // Sends one to three blocks. Some streams end without the last, empty block, which must change
  // nothing; some are cancelled after it, which leaves the outcome unknown.
  bool Replace(const std::string& hull_id);
  bool Delete(const std::string& hull_id, bool if_known_revision);
  bool Get(const std::string& hull_id);
  bool Mesh(const std::string& hull_id);
  bool Probe(const std::string& hull_id);
  // Queries the relation of two hulls of the history.
  bool Pair(const std::string& hull_id, const std::string& other);

  // Issues one random call on this body, with some of these hulls as pieces, each at the identity
  // pose.
  bool CallBodyAtRandom(const std::string& body_id, const std::vector<std::string>& hulls);
  bool PutBody(const std::string& body_id, const std::vector<std::string>& hulls);
  bool DeleteBody(const std::string& body_id, bool if_known_revision);
  bool GetBody(const std::string& body_id);
  // Queries whether the body touches a point of the cloud.
  bool QueryBody(const std::string& body_id);

  // Issues one random call about all of these, each at the identity pose. IDs of hulls and of
  // bodies start with different first segments.
  bool CallSeveralAtRandom(const std::vector<std::string>& hulls,
                           const std::vector<std::string>& bodies);
  // Queries which of some points of the cloud each touches.
  bool Batch(const std::vector<std::string>& hulls, const std::vector<std::string>& bodies);
  bool Scene(const std::vector<std::string>& hulls, const std::vector<std::string>& bodies);
  // Like Scene, but by a collision stream, which is opened if none is open. An open stream resolves
  // the hulls again, and sometimes moves a point.
  bool QueryStream(const std::vector<std::string>& hulls, const std::vector<std::string>& bodies);
  // Lists in one page or in single-item pages. Requires: no other IDs have their prefix.
  bool ListHulls(const std::vector<std::string>& hulls);
  bool ListBodies(const std::vector<std::string>& bodies);

 private:
  struct JointQuery;
  struct JointAnswer;
  struct CollisionStream;
  struct Page;
  struct Stream {
    std::unique_ptr<Appender> appender;
    uint64_t incarnation = 0;
    uint64_t next_sequence = 1;
  };

  Operation Begin(Operation::Kind kind);
  // Records the operation with the status of its call. Returns false if unanswered.
  bool End(const std::string& hull_id, Operation& operation, const grpc::Status& status);
  Stream* OpenStream(const std::string& hull_id, bool* answered);
  // Returns `count` points of the cloud, with repetition, and records them in `operation`.
  Coordinates SomePoints(int count, Operation& operation);
  // Sets the same random freshness in the request and the operation.
  void ChooseFreshness(Operation& operation, v1::Freshness& freshness);
  // Like ChooseFreshness, but for queries about several hulls; half of them are linearizable.
  void ChooseFreshnessOfSeveral(Operation& operation, v1::Freshness& freshness);
  // Records an answer about several hulls, received now.
  void RecordSeveral(Operation operation, const v1::ResponseHeader& header, std::vector<Seen> seen);
  std::vector<Seen> SeenIn(const JointQuery& query, const JointAnswer& answer,
                           const v1::Freshness& freshness);
  void RecordQuery(const Operation& operation, const JointQuery& query, const JointAnswer& answer,
                   const v1::Freshness& freshness);
  // Returns the next request: it opens the stream or queries again.
  v1::StreamCollisionsRequest NextMessage(const std::vector<std::string>& hulls,
                                          const std::vector<std::string>& bodies,
                                          Operation& operation);
  bool List(std::vector<std::string> ids,
            const std::function<Page(const v1::Freshness&, int page_size,
                                     const std::string& token)>& ask);
  template <typename Response, typename Request, typename Call>
  bool DeleteAs(const std::string& id, bool if_known_revision, Request request, const Call& call);
  void TakeHeader(const v1::ResponseHeader& header, Operation& operation);
  // Usually absent; otherwise the revision last seen.
  std::optional<uint64_t> SomeRevision(const std::string& hull_id);
  int Below(int n) { return static_cast<int>(random_() % static_cast<uint64_t>(n)); }

  std::unique_ptr<v1::HullService::Stub> hulls_;
  std::unique_ptr<v1::BodyService::Stub> bodies_;
  std::unique_ptr<v1::CollisionService::Stub> collisions_;
  HullHistory& history_;
  const std::string name_;
  std::mt19937_64 random_;
  std::map<std::string, Stream> streams_;
  std::map<std::string, uint64_t> revisions_;
  std::shared_ptr<CollisionStream> collision_stream_;
  bool any_freshness_ = false;
  // Header of the last answer.
  v1::ResponseHeader last_header_;
};

}  // namespace hulld::server

#endif  // HULLD_TESTS_SERVER_HARNESS_HISTORY_HISTORY_CLIENT_H_
