#include "tests/bench/motions/motion_truth.h"

#include <cstdio>
#include <cstdlib>

#include "client/verify/motion_check.h"
#include "core/query/motion/first_contact.h"
#include "server/wire/encode.h"

namespace hulld::bench {
namespace {

// For a rotation by 30 degrees, a piece deviates by at most 2.2e-9 radians, and the hulls are
// within 1.5 of their origins.
constexpr int kPieces = 64;
constexpr double kDeviation = 1e-8;

v1::Pose ToMessage(const Pose& pose) {
  v1::Pose message;
  message.mutable_rotation()->set_w(pose.q[0]);
  message.mutable_rotation()->set_x(pose.q[1]);
  message.mutable_rotation()->set_y(pose.q[2]);
  message.mutable_rotation()->set_z(pose.q[3]);
  server::EncodeVector(pose.t, message.mutable_translation());
  return message;
}

std::span<const double> CoordinatesOf(const Hull& hull) {
  return {hull.vertices().front().data(), 3 * hull.vertices().size()};
}

MotionTruth ProvenTruth(const MotionSet& set, const MotionSet::Query& query) {
  MotionOptions options;
  options.want_certificate = true;
  const FirstContact contact = *FindFirstContact({set.query_a(query), {query.X_WA, query.X_WA}},
                                                 {set.query_b(query), query.X_WB}, options);
  v1::FirstContact message;
  server::EncodeFirstContact(contact, &message);
  v1::Certificate certificate;
  if (contact.certificate) {
    server::EncodeCertificate(*contact.certificate, set.a(query), set.b(query), &certificate);
  }
  const v1::Pose at_rest = ToMessage(query.X_WA);
  const v1::Pose start = ToMessage(query.X_WB.start);
  const v1::Pose end = ToMessage(query.X_WB.end);
  const absl::Status status =
      CheckFirstContact(server::EncodeRelation(contact.relation), message, certificate,
                        {{CoordinatesOf(set.a(query)), at_rest}, at_rest},
                        {{CoordinatesOf(set.b(query)), start}, end}, options.max_time_error);
  if (!status.ok()) {
    std::fprintf(stderr, "motion_benchmark: a wrong certificate: %s\n", status.ToString().c_str());
    std::exit(1);
  }
  return {contact.contact_time.has_value(), contact.separated_until,
          contact.contact_time.value_or(1)};
}

// The pose at a time on a path of constant angular velocity.
Pose SteadyPose(const Motion& motion, double time) {
  const auto& p = motion.start.q;
  const auto& q = motion.end.q;
  const Eigen::Quaterniond at = Eigen::Quaterniond(p[0], p[1], p[2], p[3])
                                    .slerp(time, Eigen::Quaterniond(q[0], q[1], q[2], q[3]));
  return {{at.w(), at.x(), at.y(), at.z()}, (1 - time) * motion.start.t + time * motion.end.t};
}

// Returns the earliest time of the whole path at which a piece meets A, or the time up to which it
// is separated.
struct SteadyContact {
  bool meets = false;
  double separated_until = 1;
  double contact_time = 1;
};
SteadyContact FindSteadyContact(const MotionSet& set, const MotionSet::Query& query,
                                double radius) {
  for (int piece = 0; piece < kPieces; ++piece) {
    const auto whole_time = [&](double time) { return (piece + time) / kPieces; };
    const Motion X_WB = {SteadyPose(query.X_WB, whole_time(0)),
                         SteadyPose(query.X_WB, whole_time(1))};
    const FirstContact contact = *FindFirstContact({set.query_a(query), {query.X_WA, query.X_WA}},
                                                   {set.query_b(query), X_WB, radius});
    if (contact.relation == Relation::kSeparated) continue;
    return {true, whole_time(contact.separated_until),
            whole_time(contact.contact_time.value_or(1))};
  }
  return {};
}

MotionTruth SteadyTruth(const MotionSet& set, const MotionSet::Query& query) {
  const SteadyContact wider = FindSteadyContact(set, query, kDeviation);
  if (!wider.meets) return {false};
  const SteadyContact contact = FindSteadyContact(set, query, 0);
  if (!contact.meets) return {};
  return {true, wider.separated_until, contact.contact_time};
}

}  // namespace

std::vector<MotionTruth> FindTruth(const MotionSet& set, Path path) {
  std::vector<MotionTruth> truth;
  for (const MotionSet::Query& query : set.queries) {
    truth.push_back(path == Path::kLinear ? ProvenTruth(set, query) : SteadyTruth(set, query));
  }
  return truth;
}

}  // namespace hulld::bench
