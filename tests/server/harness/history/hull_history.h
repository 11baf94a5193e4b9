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

// A set of points by number, of a cloud of at most 64 points that all are extreme: a hull of any of
// them has exactly these as vertices.
using PointSet = uint64_t;

// What an answer about several says of a hull beside the first; in a batch, of any hull.
struct Seen {
  std::string hull_id;
  uint64_t create_revision = 0;
  uint64_t revision = 0;
  // The store of this hull and its revisions, as in Operation.
  std::string store_id = {};
  uint64_t store_revision = 0;
  uint64_t at_least_revision = 0;

  // The following are for batches only. There is no such hull, or body.
  bool is_missing = false;
  // The hull that a piece of it lacks; empty: none.
  std::string missing_piece = {};
  // It is there, and an answer about it is missing.
  bool lacks_answer = false;
  // Points of the cloud that were asked about, and those of them that it touches.
  PointSet probed = 0;
  PointSet touched = 0;
  // How many vertices, or pieces, it has.
  std::optional<uint64_t> size = {};
};

// One call on one hull or body, as its client saw it. Where an answer about several is not of one
// instant, each part of it is an operation of its own.
struct Operation {
  enum class Kind {
    kCreate,
    kOpen,  // of an AppendPoints stream
    kAppend,
    kReplace,
    kDelete,
    kGet,
    kMesh,
    kProbe,    // CheckCollision with one point of the cloud
    kPair,     // CheckCollision with another hull of the history
    kVersion,  // what an answer about several says of this hull, or body, alone
    kPut,      // of a body
    kGetBody,
    kAsk,    // CheckCollision of a body with one point of the cloud
    kBatch,  // what a batch, a scene, an answer of a collision stream, or a page of a list, or its
             // part of one store, says of each of `others`
  };
  enum class Outcome {
    kOk,
    kNotFound,
    kAlreadyExists,
    kAborted,
    kUnknown,  // no answer: the call may have taken effect, now, later or never
  };

  Kind kind = Kind::kGet;
  Outcome outcome = Outcome::kUnknown;
  // Times of the history's clock: the call took effect between the two, if it did.
  uint64_t invoked = 0;
  uint64_t returned = UINT64_MAX;

  // What was asked.
  // Create, open: keeps a hull that exists. Open, replace: makes one that does not.
  bool if_absent = false;
  // A replace with 0: the hull must not exist.
  std::optional<uint64_t> if_revision;
  std::string writer;
  uint64_t sequence = 0;
  // Append: that of the stream, as its opening said.
  uint64_t incarnation = 0;
  // Append: acknowledged with chunks after it, so that nobody told what it did alone; and with
  // chunks before it, so that counts, and whether it was applied already, are of all.
  bool is_untold = false;
  bool is_told_with_others = false;
  // Append, replace: how many points were sent; and which, without repetition.
  uint64_t sent = 0;
  PointSet points = 0;
  int probe = 0;
  // For a read that may be answered from the past: from how long ago at most, in nanoseconds, or
  // from any time; and not before this revision of the store.
  std::optional<uint64_t> max_staleness = 0;
  uint64_t at_least_revision = 0;

  // Put, and what GetBody answers: the hull of each piece, in order.
  std::vector<std::string> pieces;

  // What was answered.
  uint64_t store_revision = 0;
  // Whose that is, where hulls are spread over several stores.
  std::string store_id;
  // How old the state that was answered from may be, in nanoseconds.
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
  // Pair: the other hull. Ask: hulls of pieces. Batch: all that it says; the operation is recorded
  // under the first, and its own revisions are none.
  std::vector<Seen> others;
  // Ask: `pieces` names the hulls of all pieces, each once.
  bool tells_pieces = false;
  // Ask, when touching: the hull of the piece that decided.
  std::string deciding;
  // Ask that found nothing: the hull that a piece lacks; empty: it is the body that is missing.
  std::string missing;
  // Ask: `others` has only those pieces that are in the body's store, so that nothing follows from
  // whether it touches.
  bool is_part = false;
};

// What clients did to hulls, by hull ID. Thread-safe while it is recorded.
class HullHistory {
 public:
  // The time, in nanoseconds by the monotonic clock of the machine, which is later than all before.
  uint64_t Tick();
  // Requires that invoked and returned are ticks of this clock, in this order, or that returned is
  // UINT64_MAX.
  void Record(const std::string& hull_id, const Operation& operation);

  // Says that the server that was called so far is gone: what it has not answered took effect
  // before now or never. No call may be running.
  void Settle();

  const std::map<std::string, std::vector<Operation>>& operations() const { return operations_; }
  size_t size() const;

 private:
  std::atomic<uint64_t> clock_ = 0;
  std::mutex mutex_;
  std::map<std::string, std::vector<Operation>> operations_;
};

// Whether the operations on one hull are linearizable: whether there is an order that agrees with
// real time in which a hull that does one thing at a time, as hull.proto says, would have answered
// the same. Empty when there is one; otherwise what could not be explained.
//
// A read that may be answered from the past took effect between its answer and as long before its
// call as that says, which is no longer than was asked for, and after every change up to the
// revision that it asked for. Whatever it asked for, an answer holds every change up to the
// revision of the store that it names.
//
// The store's revision is shared by all hulls, so that of a change is taken from the answer and
// must be greater than all before. Search with memory of the states seen; a read that fits and
// tells nothing new is taken at once, as it stands in the way of nothing. Source: Wing and Gong
// 1993, Testing and Verifying Concurrent Objects; Lowe 2017, Testing for Linearizability.
std::string LinearizabilityFault(std::vector<Operation> operations);

// The same for several hulls and bodies together, by ID: there must be one order for all of them,
// so that both hulls of a pair, and a body and the hulls of its pieces, were as an answer says at
// one instant. In it, changes to one store come in the order of its revisions.
std::string JointLinearizabilityFault(
    const std::map<std::string, std::vector<Operation>>& operations);

// The same for every hull, or for all together where several were asked about at once, and that
// revisions of the store, which all hulls share, never fall from one call to a later one, as far as
// that may not be answered from the past, and that no two changes have the same; of each store by
// itself.
std::string HistoryFault(const HullHistory& history);

}  // namespace hulld::server

#endif  // HULLD_TESTS_SERVER_HARNESS_HISTORY_HULL_HISTORY_H_
