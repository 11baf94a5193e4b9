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

// The hull of one point at the origin, which probes points of others. Not part of any history.
inline constexpr const char* kProbeHull = "probe";

// The cloud that histories are made of: this many points, all extreme.
inline constexpr int kCloudSize = 48;
const Coordinates& HistoryCloud();

// A client that calls at random and records what it asked and was answered. For one thread.
class HistoryClient {
 public:
  // name: its writer ID. The history must outlive this.
  HistoryClient(const std::shared_ptr<grpc::Channel>& channel, HullHistory& history,
                std::string name, uint64_t seed);

  // From now on reads ask for any freshness: the latest, the revision of the last answer, a bound
  // of some milliseconds, or both. Otherwise for the latest.
  void ReadAtAnyFreshness() { any_freshness_ = true; }
  // From now on operations say which store they are of: hulls are spread over several. A revision
  // that is asked for is then the greatest that any answer told, of some of them or of all.
  void TellStores() { tells_stores_ = true; }

  // Makes kProbeHull; once per store.
  void MakeProbe();

  // From now on calls go to another server, or the same one started again; open streams are gone.
  void Connect(const std::shared_ptr<grpc::Channel>& channel);

  // One call at random on this hull: any, or one that changes, or one that reads. False when the
  // server was not there to answer.
  bool CallAtRandom(const std::string& hull_id);
  bool ChangeAtRandom(const std::string& hull_id);
  bool ReadAtRandom(const std::string& hull_id);

  bool Create(const std::string& hull_id, bool if_absent);
  // Opens a stream when none is open, and appends one chunk, or some, the next before the one
  // before is acknowledged.
  bool Append(const std::string& hull_id);
  bool AppendAtOnce(const std::string& hull_id);
  // One to three blocks. Now and then the stream ends without the last, empty one, which must
  // change nothing, or is cancelled after it, which leaves open whether anything changed.
  bool Replace(const std::string& hull_id);
  bool Delete(const std::string& hull_id, bool if_known_revision);
  bool Get(const std::string& hull_id);
  bool Mesh(const std::string& hull_id);
  bool Probe(const std::string& hull_id);
  // How two hulls of the history stand to each other.
  bool Pair(const std::string& hull_id, const std::string& other);

  // One call at random on this body, whose pieces are some of these hulls, each where it is.
  bool CallBodyAtRandom(const std::string& body_id, const std::vector<std::string>& hulls);
  bool PutBody(const std::string& body_id, const std::vector<std::string>& hulls);
  bool DeleteBody(const std::string& body_id, bool if_known_revision);
  bool GetBody(const std::string& body_id);
  // Whether it touches a point of the cloud.
  bool Ask(const std::string& body_id);

  // One call at random about all of these, each where it is. IDs of hulls have a prefix of their
  // own, and so have those of bodies: the first segment. Requires TellStores.
  bool CallSeveralAtRandom(const std::vector<std::string>& hulls,
                           const std::vector<std::string>& bodies);
  // Which points of some of the cloud each touches.
  bool Batch(const std::vector<std::string>& hulls, const std::vector<std::string>& bodies);
  bool Scene(const std::vector<std::string>& hulls, const std::vector<std::string>& bodies);
  // The same by a collision stream, which is opened when none is open. One that is open looks the
  // hulls up anew, and moves a point now and then.
  bool AskStream(const std::vector<std::string>& hulls, const std::vector<std::string>& bodies);
  // In one page or in pages of one. Requires that no others have their prefix.
  bool ListHulls(const std::vector<std::string>& hulls);
  bool ListBodies(const std::vector<std::string>& bodies);

 private:
  struct Asked;
  struct Told;
  struct CollisionStream;
  struct Page;
  struct Stream {
    std::unique_ptr<Appender> appender;
    uint64_t incarnation = 0;
    uint64_t next_sequence = 1;
  };

  Operation Begin(Operation::Kind kind);
  // Records the operation with the status of its call; false when no answer came.
  bool End(const std::string& hull_id, Operation& operation, const grpc::Status& status);
  Stream* OpenStream(const std::string& hull_id, bool* answered);
  // `count` points of the cloud, with repetition; tells the operation of them.
  Coordinates SomePoints(int count, Operation& operation);
  // Tells request and operation, which is on this hull, of the same freshness, at random.
  void ChooseFreshness(const std::string& hull_id, Operation& operation, v1::Freshness& freshness);
  // The same for a question about several, half of which are of one instant.
  void ChooseFreshnessOfSeveral(const std::string& hull_id, Operation& operation,
                                v1::Freshness& freshness);
  void ChooseRevisions(v1::Freshness& freshness);
  // The revision that is asked for of the store of this hull; 0: none, or it is not known which.
  uint64_t LeastFor(const std::string& hull_id, const v1::Freshness& freshness) const;
  // What an answer about several says of this one, recorded by itself.
  bool EndPart(Operation::Kind kind, const Operation& whole, const Seen& seen,
               const grpc::Status& status);
  // What an answer that came in now says of several. It is recorded as one operation where it is of
  // one instant, otherwise as one for each store.
  void RecordSeveral(Operation operation, const v1::ResponseHeader& header, std::vector<Seen> seen,
                     bool is_of_one_instant);
  std::vector<Seen> SeenIn(const Asked& asked, const Told& told, const v1::Freshness& freshness,
                           bool is_of_one_instant);
  void RecordAsked(const Operation& operation, const Asked& asked, const Told& told,
                   const v1::Freshness& freshness);
  void TellStoreOf(const v1::ResponseHeader& header, Seen& seen) const;
  // Opens one, or asks again; the request that it sends.
  v1::StreamCollisionsRequest NextMessage(const std::vector<std::string>& hulls,
                                          const std::vector<std::string>& bodies,
                                          Operation& operation);
  bool List(std::vector<std::string> ids,
            const std::function<Page(const v1::Freshness&, int page_size,
                                     const std::string& token)>& ask);
  template <typename Response, typename Request, typename Call>
  bool DeleteAs(const std::string& id, bool if_known_revision, Request request, const Call& call);
  // What an answer says of the store; if there are several, of the one with this ID.
  void TakeHeader(const v1::ResponseHeader& header, Operation& operation,
                  const std::string& store_id = "");
  // Absent most times; otherwise the revision last seen.
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
  bool tells_stores_ = false;
  // The header of the last answer.
  v1::ResponseHeader last_header_;
  // Where there are several: the greatest revision told of each, and the store of each hull.
  std::map<std::string, uint64_t> store_revisions_;
  std::map<std::string, std::string> stores_;
};

}  // namespace hulld::server

#endif  // HULLD_TESTS_SERVER_HARNESS_HISTORY_HISTORY_CLIENT_H_
