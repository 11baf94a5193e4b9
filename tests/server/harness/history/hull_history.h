#ifndef HULLD_TESTS_SERVER_HARNESS_HISTORY_HULL_HISTORY_H_
#define HULLD_TESTS_SERVER_HARNESS_HISTORY_HULL_HISTORY_H_

#include <atomic>
#include <cstdint>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

namespace hulld::server {

// A set of points of a cloud, by number. The cloud has at most 64 points, all extreme: a hull of
// any subset has exactly that subset as vertices.
using PointSet = uint64_t;

// The part of a joint answer about one hull: for a pair or body, any hull except the first; for a
// batch, every hull.
struct Seen {
  std::string hull_id;
  uint64_t create_revision = 0;
  uint64_t revision = 0;
  // The hull's store and its revisions, as in Operation.
  std::string store_id = {};
  uint64_t store_revision = 0;
  uint64_t at_least_revision = 0;

  // Batches only, from here on. The hull or body does not exist.
  bool is_missing = false;
  // The hull that one of its pieces lacks; empty if none.
  std::string missing_piece = {};
  // It exists, but its answer is missing.
  bool lacks_answer = false;
  // Points of the cloud that were queried, and the subset that it touches.
  PointSet probed = 0;
  PointSet touched = 0;
  // Number of vertices or pieces.
  std::optional<uint64_t> size = {};
};

// One call on one or several hulls or bodies, as its client saw it.
struct Operation {
  enum class Kind {
    kCreate,
    kOpen,  // of an AppendPoints stream
    kAppend,
    kReplace,
    kDelete,
    kGet,
    kMesh,
    kProbe,  // CheckCollision with one point of the cloud
    kPair,   // CheckCollision with another hull of the history
    kPut,    // of a body
    kGetBody,
    kBodyQuery,  // CheckCollision of a body with one point of the cloud
    kBatch,      // a batch, scene, collision stream answer, or list page; its parts are in `others`
  };
  enum class Outcome {
    kOk,
    kNotFound,
    kAlreadyExists,
    kAborted,
    kUnknown,  // no answer: the call may take effect at any time or never
  };

  Kind kind = Kind::kGet;
  Outcome outcome = Outcome::kUnknown;
  // Ticks of the history's clock. The call took effect between them, if at all.
  uint64_t invoked = 0;
  uint64_t returned = UINT64_MAX;

  // Request fields.
  //
  // Create, open: keeps an existing hull. Open, replace: creates a missing one.
  bool if_absent = false;
  // Replace with 0: the hull must not exist.
  std::optional<uint64_t> if_revision;
  std::string writer;
  uint64_t sequence = 0;
  // Append: the incarnation given when the stream opened.
  uint64_t incarnation = 0;
  // Append. shares_later_ack: one ack covered this chunk and later ones, so its own effect is
  // unknown. covers_earlier_chunks: the ack covered earlier chunks too, so its counts and its
  // already-applied flag are of all of them.
  bool shares_later_ack = false;
  bool covers_earlier_chunks = false;
  // Append, replace: the number of points sent, and the distinct points.
  uint64_t sent = 0;
  PointSet points = 0;
  int probe = 0;
  // Bounds of a stale read: its maximum age in nanoseconds (nullopt: any age), and the minimum
  // revision of the store.
  std::optional<uint64_t> max_staleness = 0;
  uint64_t at_least_revision = 0;

  // Put, and the answer of GetBody: the hull of each piece, in order.
  std::vector<std::string> pieces;

  // Answer fields.
  uint64_t store_revision = 0;
  // The store of this revision.
  std::string store_id;
  // Maximum age of the state that the answer is from, in nanoseconds.
  uint64_t staleness = 0;
  uint64_t create_revision = 0;
  uint64_t revision = 0;
  bool created = false;
  bool already_applied = false;
  bool touching = false;
  uint64_t last_sequence = 0;
  uint64_t vertex_count = 0;
  uint64_t received = 0;
  uint64_t outside = 0;
  uint64_t duplicate = 0;
  // Pair: the other hull. Body query: the hulls of pieces. Batch: the whole answer; the operation
  // is recorded under the first and has no revisions of its own.
  std::vector<Seen> others;
  // Body query: `pieces` names the hull of each piece exactly once.
  bool lists_pieces = false;
  // Body query, if touching: the hull of the deciding piece.
  std::string deciding;
  // Body query, if not found: the hull that a piece lacks; empty if the body is missing.
  std::string missing;
};

// Operations of all clients, by hull ID. Recording is thread-safe.
class HullHistory {
 public:
  // Returns the machine's monotonic time in nanoseconds, strictly later than all earlier results.
  uint64_t Tick();
  // Requires: invoked and returned are ticks of this clock, in this order, or returned is
  // UINT64_MAX.
  void Record(const std::string& hull_id, const Operation& operation);

  // Declares the server gone: its unanswered calls took effect before now or never do. Requires: no
  // call is running.
  void Settle();

  const std::map<std::string, std::vector<Operation>>& operations() const { return operations_; }
  size_t size() const;

 private:
  std::atomic<uint64_t> clock_ = 0;
  std::mutex mutex_;
  std::map<std::string, std::vector<Operation>> operations_;
};

// Returns empty if the operations on one hull are linearizable: if an order that agrees with real
// time exists in which a sequential hull, as specified by hull.proto, gives the same answers.
// Otherwise returns the unexplained part.
//
// A stale read takes effect after its call minus the staleness that it reports, which is at most
// the requested bound, before its answer, and after every change up to the requested revision. In
// any case an answer contains every change up to the store revision that it names.
//
// All hulls share the store's revisions, so the revision of a change is taken from the answer and
// must exceed all earlier ones. The search remembers visited states; a read that fits and adds no
// information is taken immediately. Source: Wing and Gong 1993, Testing and Verifying Concurrent
// Objects; Lowe 2017, Testing for Linearizability.
std::string LinearizabilityFault(std::vector<Operation> operations);

// Like LinearizabilityFault, but for several hulls and bodies by ID. One order must explain all of
// them, so that both hulls of a pair, or a body and the hulls of its pieces, had the answered
// states at one instant. Changes to one store follow the order of its revisions.
std::string JointLinearizabilityFault(
    const std::map<std::string, std::vector<Operation>>& operations);

// Checks every hull, or all jointly if a query concerned several. Also checks, per store, that
// revisions never decrease from one call to a later one (except in stale reads), and that no two
// changes share a revision.
std::string HistoryFault(const HullHistory& history);

}  // namespace hulld::server

#endif  // HULLD_TESTS_SERVER_HARNESS_HISTORY_HULL_HISTORY_H_
