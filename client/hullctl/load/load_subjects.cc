#include "client/hullctl/load/load_subjects.h"

#include <absl/strings/str_cat.h>

#include <utility>

#include "client/base/status_macros.h"
#include "client/hullctl/load/point_generator.h"
#include "client/packed_placements.h"
#include "client/pose/rigid_pose.h"

namespace hulld {
namespace {

// Number of distinct requests per client, created before the clock starts and used in turn.
constexpr size_t kDistinctRequests = 256;
// Maximum number of placements per batch: a scene with parts that meet repeatedly.
constexpr uint64_t kMaxPlacements = 256;
// Half the edge of the cube that contains the placed hulls of radius 1: about one pair in three
// collides.
constexpr double kHalfRoom = 1.3;

void FillPlacement(const std::string& hull_id, Xoshiro256& random, v1::Placement* placement) {
  placement->set_hull_id(hull_id);
  RigidPose pose;
  for (double& number : pose) number = random.NextSigned();
  // Never zero.
  pose[0] += 1.5;
  for (size_t i = 4; i < 7; ++i) pose[i] *= kHalfRoom;
  *placement->mutable_pose() = PoseOf(pose);
}

// Returns a connection with linearizable reads, which include all hulls of the load.
ClientOptions Linearizable(ClientOptions connection) {
  connection.freshness.reset();
  return connection;
}

}  // namespace

// One client: its connection, its requests, and its stream.
class LoadSubjects::LoadClient {
 public:
  LoadClient(const LoadSubjects& subjects, int index)
      : settings_(subjects.settings_),
        client_(subjects.connection_),
        append_id_(absl::StrCat(settings_.prefix, "append-", index)),
        random_(static_cast<uint64_t>(index) + 1) {
    const auto hull = [&] { return subjects.HullId(random_.Next() % settings_.hulls); };
    if (Sends(LoadMode::kCheck)) {
      for (v1::CheckCollisionRequest& request : checks_) {
        FillPlacement(hull(), random_, request.mutable_a());
        FillPlacement(hull(), random_, request.mutable_b());
      }
    }
    if (Sends(LoadMode::kBatch)) {
      const uint64_t placements = std::min(kMaxPlacements, 2 * settings_.pairs);
      for (uint64_t i = 0; i < placements; ++i) {
        FillPlacement(hull(), random_, batch_.add_placements());
      }
      for (uint64_t i = 0; i < 2 * settings_.pairs; ++i) {
        batch_.add_pairs(static_cast<uint32_t>(random_.Next() % placements));
      }
    }
    if (Sends(LoadMode::kAppend)) {
      points_ = CloudPoints({Shape::kBall, settings_.points, static_cast<uint64_t>(index) + 1});
    }
  }

  absl::StatusOr<uint64_t> Send(uint64_t i) {
    switch (settings_.mode) {
      case LoadMode::kCheck:
        return Check(i);
      case LoadMode::kBatch:
        return Batch();
      case LoadMode::kAppend:
        return Append();
      case LoadMode::kMixed:
        break;
    }
    // Eight of ten requests are checks, one is a batch, and one is an append.
    if (i % 10 == 4) return Batch();
    if (i % 10 == 9) return Append();
    return Check(i);
  }

 private:
  bool Sends(LoadMode mode) const {
    return settings_.mode == mode || settings_.mode == LoadMode::kMixed;
  }

  absl::StatusOr<uint64_t> Check(uint64_t i) const {
    HULLD_ASSIGN_OR_RETURN(const auto response,
                           client_.CheckCollision(checks_[i % kDistinctRequests]));
    return 1;
  }

  absl::StatusOr<uint64_t> Batch() const {
    uint64_t answered = 0;
    HULLD_RETURN_IF_ERROR(client_.BatchCheckCollisions(
        batch_, [&answered](const v1::BatchCheckCollisionsResponse& part) {
          answered += static_cast<uint64_t>(part.columns().relations_size());
          return absl::OkStatus();
        }));
    return answered;
  }

  // Waits until the chunk is acknowledged.
  absl::StatusOr<uint64_t> Append() {
    if (appender_ == nullptr) {
      AppendOptions options;
      options.create_if_absent = true;
      options.max_in_flight_chunks = 1;
      HULLD_ASSIGN_OR_RETURN(appender_, client_.OpenAppend(append_id_, options));
    }
    const absl::Status status = appender_->Append(points_);
    if (status.ok()) return settings_.points;
    appender_ = nullptr;
    return status;
  }

  const LoadSettings& settings_;
  const Client client_;
  const std::string append_id_;
  Xoshiro256 random_;
  std::vector<v1::CheckCollisionRequest> checks_{kDistinctRequests};
  v1::BatchCheckCollisionsRequest batch_;
  v1::PointBlock points_;
  std::unique_ptr<Appender> appender_;
};

LoadSubjects::LoadSubjects(LoadSettings settings, ClientOptions connection)
    : settings_(std::move(settings)),
      connection_(std::move(connection)),
      client_(Linearizable(connection_)) {}

std::string LoadSubjects::HullId(uint64_t i) const {
  return absl::StrCat(settings_.prefix, "hull-", i);
}

absl::Status LoadSubjects::Create(const std::atomic<bool>& stop) {
  HULLD_ASSIGN_OR_RETURN(const auto there, client_.ListAllHulls(settings_.prefix, 1));
  if (there.hulls_size() > 0) {
    return absl::FailedPreconditionError(absl::StrCat(
        "hull \"", there.hulls(0).hull_id(), "\" already exists, and the load would delete it; ",
        "choose another --prefix"));
  }
  owns_prefix_ = true;
  if (settings_.mode == LoadMode::kAppend) return absl::OkStatus();
  for (uint64_t i = 0; i < settings_.hulls; ++i) {
    if (stop) return absl::CancelledError("interrupted");
    AppendOptions options;
    options.create_if_absent = true;
    HULLD_ASSIGN_OR_RETURN(auto appender, client_.OpenAppend(HullId(i), options));
    HULLD_RETURN_IF_ERROR(
        appender->Append(CloudPoints({Shape::kSphere, settings_.vertices, i + 1})));
    HULLD_RETURN_IF_ERROR(appender->Finish());
  }
  return absl::OkStatus();
}

std::vector<LoadRequest> LoadSubjects::MakeClients() {
  std::vector<LoadRequest> clients;
  for (int i = 0; i < settings_.clients; ++i) {
    const auto client = std::make_shared<LoadClient>(*this, i);
    clients.emplace_back([client](uint64_t request) { return client->Send(request); });
  }
  return clients;
}

absl::Status LoadSubjects::Delete() {
  if (!owns_prefix_) return absl::OkStatus();
  const auto hulls = client_.ListAllHulls(settings_.prefix);
  absl::Status first = hulls.status();
  if (!hulls.ok()) return first;
  for (const v1::HullInfo& hull : hulls->hulls()) {
    const absl::Status deleted = client_.DeleteHull(hull.hull_id()).status();
    if (!deleted.ok() && !absl::IsNotFound(deleted)) first.Update(deleted);
  }
  return first;
}

}  // namespace hulld
