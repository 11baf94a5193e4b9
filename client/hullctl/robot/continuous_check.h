#ifndef HULLD_CLIENT_HULLCTL_ROBOT_CONTINUOUS_CHECK_H_
#define HULLD_CLIENT_HULLCTL_ROBOT_CONTINUOUS_CHECK_H_

#include <absl/status/status.h>

#include <atomic>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "client/client.h"
#include "client/hullctl/robot/check_scope.h"
#include "client/hullctl/robot/robot_model.h"
#include "client/robot/joint_motion.h"

namespace hulld {

// Finds the first contact of each pair while all joints move linearly from waypoint to waypoint.
//
// A span of time between two waypoints is checked as a motion of the server between the poses at
// its ends. Each shape is inflated by the bound of its deviation from that motion (MotionBound), so
// the verdict "separated" is proven for the path itself. Where the inflated shapes meet, the span
// is halved, and the poses in its middle are checked exactly. A contact is claimed only for such
// poses. The earliest span that is still open when no point of either shape travels farther than
// half of the resolution ends the search between these waypoints.
//
// The spans of all pairs between many waypoints share two batches per round.
class ContinuousCheck {
 public:
  struct Settings {
    RigidPose X_WB = kNoMotion;
    // Separations up to this count as contact, in meters.
    double clearance = 0;
    // In meters.
    double resolution = 0;
  };

  // The result of a search between two waypoints that did not prove a pair free to the end.
  struct Event {
    // Index of the preceding waypoint, from 0.
    uint64_t waypoint = 0;
    size_t pair = 0;
    // At contact_time; unspecified if undecided, or with a problem.
    v1::Relation relation = v1::RELATION_UNSPECIFIED;
    // The pair is separated (proven), by more than the clearance, at all times before this one. 0
    // and 1 are the waypoints.
    double separated_until = 0;
    // Absent: undecided within the resolution, or `problem` is set.
    std::optional<double> contact_time;
    // Reason for a missing answer; empty otherwise.
    std::string problem;
  };
  using Receiver = std::function<void(const Event& event)>;

  // `model` and `stopped` must outlive the object. A true `stopped` ends the check.
  ContinuousCheck(const Client& client, const RobotModel& model, CheckScope scope,
                  const Settings& settings, const std::atomic<bool>& stopped, Receiver receive);

  // Returns the number of waypoints that Check is efficient for.
  size_t waypoints_per_call() const;

  // Checks the motion from the last waypoint of the previous call, if any, through these, given as
  // values of the robot's variables. Passes on events ordered by waypoint, then by pair: at most
  // one contact or problem per pair, after which the pair is not checked, and one undecided search
  // per pair between two waypoints. INVALID_ARGUMENT: a link turns or moves too far between two
  // waypoints for a bound. CANCELLED: stopped.
  absl::Status Check(std::span<const std::vector<double>> waypoints);

 private:
  using Poses = std::vector<double>;

  // The motion between two waypoints.
  struct Segment {
    std::vector<JointValue> from;
    std::vector<JointValue> to;
    // Bounds of each part.
    std::vector<MotionBound> bounds;
  };
  struct Span {
    double begin = 0;
    double duration = 1;
    // True if the span is too short to halve.
    bool is_last = false;
  };
  // The search for the first contact of a pair in a segment.
  struct Search {
    size_t segment = 0;
    size_t pair = 0;
    // Spans before the contact that are not proven to be free, in order of time.
    std::vector<Span> open = {Span{}};
    // The earliest poses in contact so far.
    std::optional<double> contact_time = std::nullopt;
    v1::Relation relation = v1::RELATION_UNSPECIFIED;
    std::string problem = {};
    bool is_done = false;
  };
  // A span of a search, and its answer.
  struct QueriedSpan {
    Search* search = nullptr;
    Span span;
    bool is_separated = false;
    double separated_until = 0;
  };

  absl::Status AddSegments(std::span<const std::vector<double>> waypoints);
  absl::Status RunRound(std::vector<Search>* searches);
  absl::Status QueryMotions(std::vector<QueriedSpan>* queried);
  // Checks poses at times of searches.
  absl::Status QueryPoses(const std::vector<std::pair<Search*, double>>& times);
  // Replaces the queried spans, at the front of the search, with their halves that are not proven
  // free. Adds the times at which poses must be checked.
  void Divide(std::span<const QueriedSpan> queried, Search* search,
              std::vector<std::pair<Search*, double>>* times);
  void Close(Search* search);
  void Report(const std::vector<Search>& searches);

  // Returns how far a shape deviates from its motion in a span; 0 for fixed objects.
  double DeviationOf(const QueriedSpan& queried, size_t side) const;
  bool CanQuery(const Search& search, const Span& span) const;
  bool IsLast(const Search& search, const Span& span) const;
  // Returns the poses of all parts.
  const Poses& PosesAt(size_t segment, double time);
  uint32_t ObjectOf(const Search& search, size_t side) const {
    return scope_.pairs[2 * search.pair + side];
  }
  // Adds a placement of an object; `end`: the end of its motion, or null.
  void Place(uint32_t object, double radius, const Poses& poses, const Poses* end,
             v1::BatchCheckCollisionsRequest* request) const;

  const Client& client_;
  const RobotModel& model_;
  const CheckScope scope_;
  const Settings settings_;
  const std::atomic<bool>& stopped_;
  const Receiver receive_;
  // The largest distance of a point of each part's hull from the origin of its frame.
  std::vector<double> reaches_;
  std::vector<Segment> segments_;
  std::map<std::pair<size_t, double>, Poses> poses_;
  std::vector<JointValue> last_waypoint_;
  // Index of the waypoint at the start of segments_.
  uint64_t first_waypoint_ = 0;
  // True for each pair whose contact or problem was passed on.
  std::vector<bool> is_closed_;
};

}  // namespace hulld

#endif  // HULLD_CLIENT_HULLCTL_ROBOT_CONTINUOUS_CHECK_H_
