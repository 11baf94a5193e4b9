#include "client/hullctl/robot/continuous_check.h"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <cmath>

#include "client/hullctl/pairs/batch_answers.h"

namespace hulld {
namespace {

// Searches per call of Check, and spans per batch: enough to amortize the round trip.
constexpr size_t kMaxSearches = 4096;
constexpr size_t kMaxSpans = 4096;
constexpr size_t kMaxWaypoints = 1024;
// Spans of one search in a batch. More would save rounds where bounds are wide, but be wasted where
// a contact comes first.
constexpr size_t kSpansPerSearch = 8;
// The search visits spans of at most 2 rad one by one.
constexpr double kMaxTurnOfSegment = 4096;
// Times in [0, 1] that are multiples of 2^-50 are exact, as are their differences from 1.
constexpr double kShortestSpan = 0x1p-50;
// Covers the rounding of three sums.
constexpr double kRoundedUp = 1 + 0x1p-50;

void Normalize(double* quaternion) {
  double squared = 0;
  for (size_t i = 0; i < 4; ++i) squared += quaternion[i] * quaternion[i];
  const double length = std::sqrt(squared);
  for (size_t i = 0; i < 4; ++i) quaternion[i] /= length;
}

double ReachOf(const std::vector<double>& xyz) {
  double reach = 0;
  for (size_t i = 0; i < xyz.size(); i += 3) {
    reach = std::max(reach, std::hypot(xyz[i], xyz[i + 1], xyz[i + 2]));
  }
  return reach;
}

}  // namespace

ContinuousCheck::ContinuousCheck(const Client& client, const RobotModel& model, CheckScope scope,
                                 const Settings& settings, const std::atomic<bool>& stopped,
                                 Receiver receive)
    : client_(client),
      model_(model),
      scope_(std::move(scope)),
      settings_(settings),
      stopped_(stopped),
      receive_(std::move(receive)),
      is_closed_(scope_.pairs.size() / 2, false) {
  for (const RobotPart& part : model_.parts) reaches_.push_back(ReachOf(part.hull.xyz));
}

size_t ContinuousCheck::waypoints_per_call() const {
  return std::clamp<size_t>(kMaxSearches / std::max<size_t>(1, is_closed_.size()), 1,
                            kMaxWaypoints);
}

absl::Status ContinuousCheck::Check(std::span<const std::vector<double>> waypoints) {
  if (absl::Status added = AddSegments(waypoints); !added.ok()) return added;
  std::vector<Search> searches;
  for (size_t segment = 0; segment < segments_.size(); ++segment) {
    for (size_t pair = 0; pair < is_closed_.size(); ++pair) {
      if (!is_closed_[pair]) searches.push_back({.segment = segment, .pair = pair});
    }
  }
  const auto is_open = [](const Search& search) { return !search.is_done; };
  while (std::any_of(searches.begin(), searches.end(), is_open)) {
    if (stopped_) return absl::CancelledError("stopped");
    if (absl::Status ran = RunRound(&searches); !ran.ok()) return ran;
  }
  Report(searches);
  first_waypoint_ += segments_.size();
  return absl::OkStatus();
}

absl::Status ContinuousCheck::AddSegments(std::span<const std::vector<double>> waypoints) {
  segments_.clear();
  for (const std::vector<double>& waypoint : waypoints) {
    std::vector<JointValue> values = AllJointValues(model_.robot, waypoint);
    if (!last_waypoint_.empty()) {
      Segment& segment = segments_.emplace_back();
      AlignTurns(model_.robot, last_waypoint_, values);
      const std::vector<MotionBound> of_links =
          BoundMotions(model_.robot, settings_.X_WB, last_waypoint_, values);
      for (size_t i = 0; i < model_.parts.size(); ++i) {
        const RobotPart& part = model_.parts[i];
        const MotionBound bound =
            BoundFixedFrame(of_links[static_cast<size_t>(part.link)], part.X_LS);
        if (!(bound.turn <= kMaxTurnOfSegment) || !std::isfinite(bound.Deviation(1, reaches_[i]))) {
          const uint64_t number = first_waypoint_ + segments_.size();
          return absl::InvalidArgumentError(absl::StrCat(
              "--continuous: ", part.name, " turns or moves too far between waypoints ", number,
              " and ", number + 1, "; add waypoints between them"));
        }
        segment.bounds.push_back(bound);
      }
      segment.from = std::move(last_waypoint_);
      segment.to = values;
    }
    last_waypoint_ = std::move(values);
  }
  return absl::OkStatus();
}

absl::Status ContinuousCheck::RunRound(std::vector<Search>* searches) {
  poses_.clear();
  // A contact makes the later searches of its pair unnecessary.
  std::vector<size_t> first_contact(is_closed_.size(), segments_.size());
  for (const Search& search : *searches) {
    if (search.contact_time.has_value() || !search.problem.empty()) {
      first_contact[search.pair] = std::min(first_contact[search.pair], search.segment);
    }
  }
  std::vector<QueriedSpan> queried;
  for (Search& search : *searches) {
    if (search.segment > first_contact[search.pair]) search.is_done = true;
    if (search.is_done || queried.size() >= kMaxSpans) continue;
    const size_t count = std::min(search.open.size(), kSpansPerSearch);
    for (size_t i = 0; i < count; ++i) {
      queried.push_back({.search = &search, .span = search.open[i]});
    }
  }
  if (absl::Status motions = QueryMotions(&queried); !motions.ok()) return motions;
  std::vector<std::pair<Search*, double>> times;
  for (size_t first = 0, end = 0; first < queried.size(); first = end) {
    while (end < queried.size() && queried[end].search == queried[first].search) ++end;
    Divide(std::span(queried).subspan(first, end - first), queried[first].search, &times);
  }
  if (absl::Status poses = QueryPoses(times); !poses.ok()) return poses;
  for (const QueriedSpan& one : queried) Close(one.search);
  return absl::OkStatus();
}

absl::Status ContinuousCheck::QueryMotions(std::vector<QueriedSpan>* queried) {
  v1::BatchCheckCollisionsRequest request;
  *request.mutable_packed_placements() = scope_.hulls;
  // Only the halves of a span matter.
  request.mutable_wanted()->set_max_time_error(0.25);
  request.mutable_wanted()->set_resolution(settings_.resolution / 2);
  std::vector<QueriedSpan*> rows;
  for (QueriedSpan& one : *queried) {
    const Search& search = *one.search;
    if (!CanQuery(search, one.span)) continue;
    rows.push_back(&one);
    const Poses& begin = PosesAt(search.segment, one.span.begin);
    const Poses& end = PosesAt(search.segment, one.span.begin + one.span.duration);
    for (const size_t side : {0, 1}) {
      const uint32_t object = ObjectOf(search, side);
      const double inflation = DeviationOf(one, side) + (side == 0 ? settings_.clearance : 0);
      const double radius =
          inflation == 0 ? scope_.radii[object] : kRoundedUp * (scope_.radii[object] + inflation);
      Place(object, radius, begin, &end, &request);
    }
  }
  if (rows.empty()) return absl::OkStatus();
  return QueryBatch(client_, request, nullptr,
                    [&](size_t row, const AnswerRow& answer, const std::string* problem) {
                      QueriedSpan& one = *rows[row];
                      one.is_separated = answer.relation == v1::RELATION_SEPARATED;
                      if (answer.first_contact.has_value()) {
                        one.separated_until = answer.first_contact->separated_until();
                      }
                      if (problem != nullptr) one.search->problem = *problem;
                      return absl::OkStatus();
                    });
}

absl::Status ContinuousCheck::QueryPoses(const std::vector<std::pair<Search*, double>>& times) {
  if (times.empty()) return absl::OkStatus();
  v1::BatchCheckCollisionsRequest request;
  *request.mutable_packed_placements() = scope_.hulls;
  if (settings_.clearance > 0) request.mutable_wanted()->set_clearance(settings_.clearance);
  for (const auto& [search, time] : times) {
    const Poses& poses = PosesAt(search->segment, time);
    for (const size_t side : {0, 1}) {
      const uint32_t object = ObjectOf(*search, side);
      Place(object, scope_.radii[object], poses, nullptr, &request);
    }
  }
  return QueryBatch(client_, request, nullptr,
                    [&](size_t row, const AnswerRow& answer, const std::string* problem) {
                      const auto& [search, time] = times[row];
                      if (problem != nullptr) search->problem = *problem;
                      const bool meets = answer.relation == v1::RELATION_TOUCHING ||
                                         answer.relation == v1::RELATION_OVERLAPPING ||
                                         answer.within_clearance.value_or(false);
                      if (meets && time <= search->contact_time.value_or(time)) {
                        search->contact_time = time;
                        search->relation = answer.relation;
                      }
                      return absl::OkStatus();
                    });
}

void ContinuousCheck::Divide(std::span<const QueriedSpan> queried, Search* search,
                             std::vector<std::pair<Search*, double>>* times) {
  std::vector<Span> left;
  for (const QueriedSpan& one : queried) {
    if (one.is_separated) continue;
    Span span = one.span;
    if (span.duration == 1) times->insert(times->end(), {{search, 0.0}, {search, 1.0}});
    span.is_last = CanQuery(*search, span) && IsLast(*search, span);
    if (span.is_last) {
      left.push_back(span);
      continue;
    }
    const double half = span.duration / 2;
    times->emplace_back(search, span.begin + half);
    if (one.separated_until <= 0.5) left.push_back({span.begin, half});
    left.push_back({span.begin + half, half});
  }
  left.insert(left.end(), search->open.begin() + static_cast<ptrdiff_t>(queried.size()),
              search->open.end());
  search->open = std::move(left);
}

void ContinuousCheck::Close(Search* search) {
  const double end = search->contact_time.value_or(1);
  std::erase_if(search->open, [&](const Span& span) { return span.begin >= end; });
  search->is_done =
      search->open.empty() || search->open.front().is_last || !search->problem.empty();
}

void ContinuousCheck::Report(const std::vector<Search>& searches) {
  for (const Search& search : searches) {
    if (is_closed_[search.pair]) continue;
    const bool ends_early =
        search.contact_time.has_value() || !search.open.empty() || !search.problem.empty();
    if (!ends_early) continue;
    is_closed_[search.pair] = search.contact_time.has_value() || !search.problem.empty();
    receive_({.waypoint = first_waypoint_ + search.segment,
              .pair = search.pair,
              .relation = search.relation,
              .separated_until =
                  search.open.empty() ? search.contact_time.value_or(0) : search.open.front().begin,
              .contact_time = search.contact_time,
              .problem = search.problem});
  }
}

double ContinuousCheck::DeviationOf(const QueriedSpan& queried, size_t side) const {
  const uint32_t object = ObjectOf(*queried.search, side);
  if (object >= scope_.parts) return 0;
  return segments_[queried.search->segment].bounds[object].Deviation(queried.span.duration,
                                                                     reaches_[object]);
}

bool ContinuousCheck::CanQuery(const Search& search, const Span& span) const {
  const auto turns_little = [&](size_t side) {
    const uint32_t object = ObjectOf(search, side);
    return object >= scope_.parts ||
           span.duration * segments_[search.segment].bounds[object].turn <= MotionBound::kMaxTurn;
  };
  return turns_little(0) && turns_little(1);
}

bool ContinuousCheck::IsLast(const Search& search, const Span& span) const {
  if (span.duration <= kShortestSpan) return true;
  double travel = 0;
  for (const size_t side : {0, 1}) {
    const uint32_t object = ObjectOf(search, side);
    if (object >= scope_.parts) continue;
    travel += segments_[search.segment].bounds[object].Travel(span.duration, reaches_[object]);
  }
  return travel <= settings_.resolution / 2;
}

const ContinuousCheck::Poses& ContinuousCheck::PosesAt(size_t segment, double time) {
  const auto [found, is_new] = poses_.try_emplace({segment, time});
  if (is_new) {
    const Segment& of = segments_[segment];
    model_.AppendPoses(settings_.X_WB, JointValuesAt(of.from, of.to, time), &found->second);
  }
  return found->second;
}

void ContinuousCheck::Place(uint32_t object, double radius, const Poses& poses, const Poses* end,
                            v1::BatchCheckCollisionsRequest* request) const {
  v1::PackedPlacements* const packed = request->mutable_packed_placements();
  request->add_pairs(static_cast<uint32_t>(packed->hulls_size()));
  packed->add_hulls(scope_.hull_of[object]);
  packed->add_radii(radius);
  const bool moves = object < scope_.parts;
  const auto add = [&](const Poses& of_parts, google::protobuf::RepeatedField<double>* numbers) {
    const double* const pose =
        moves ? of_parts.data() + size_t{kPoseNumbers} * object
              : scope_.fixed_poses.data() + size_t{kPoseNumbers} * (object - scope_.parts);
    numbers->Add(pose, pose + kPoseNumbers);
    if (moves && end != nullptr) {
      Normalize(numbers->mutable_data() + numbers->size() - kPoseNumbers);
    }
  };
  add(poses, packed->mutable_poses());
  if (end != nullptr) add(*end, packed->mutable_end_poses());
}

}  // namespace hulld
