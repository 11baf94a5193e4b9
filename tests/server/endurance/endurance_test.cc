// One server, and clients that perform all operations for any length of time: they append, replace,
// delete, and query, send malformed requests, and disappear. The server is killed repeatedly, and
// its disk is sometimes full. Every answer is checked, and the server's resource use must not grow.
//
// HULLD_ENDURANCE_ROUNDS: number of rounds, for manual runs; a round takes a few seconds.

#include <absl/strings/str_cat.h>
#include <absl/strings/str_split.h>
#include <dirent.h>
#include <grpcpp/generic/generic_stub.h>
#include <gtest/gtest.h>
#include <sys/mount.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cmath>
#include <fstream>
#include <limits>
#include <map>
#include <mutex>
#include <random>
#include <thread>

#include "client/client.h"
#include "client/verify/answer_check.h"
#include "core/query/collision.h"
#include "tests/server/endurance/hull_model.h"
#include "tests/server/harness/restartable_server.h"
#include "tests/test_size.h"

namespace hulld::server {
namespace endurance_test {

using Outcome = HullModel::Outcome;

constexpr int kClients = 4;
constexpr int kHulls = 4;
constexpr int kSharedHulls = 3;
constexpr int kCallsPerRound = 120;
// The first rounds fill caches and pools.
constexpr int kWarmRounds = 2;
constexpr int kRounds = TestSize(12, 6);

int NumberIn(const char* name, int otherwise) {
  const char* const given = std::getenv(name);
  return given != nullptr ? std::atoi(given) : otherwise;
}

std::vector<Vector> VectorsOf(const v1::PointBlock& block) {
  std::vector<Vector> points;
  for (int i = 0; i + 2 < block.xyz_size(); i += 3) {
    points.emplace_back(block.xyz(i), block.xyz(i + 1), block.xyz(i + 2));
  }
  return points;
}

Pose PoseOf(const v1::Placement& placement) {
  const v1::Quaternion& q = placement.pose().rotation();
  const v1::Vector3& t = placement.pose().translation();
  return {{q.w(), q.x(), q.y(), q.z()}, Vector(t.x(), t.y(), t.z())};
}

v1::Relation TrueRelation(const Hull& a, const Pose& X_WA, const Hull& b, const Pose& X_WB) {
  const QueryHull query_a(a);
  const QueryHull query_b(b);
  const auto answer = CheckCollision(PlacedHull(query_a, X_WA), PlacedHull(query_b, X_WB), {});
  EXPECT_TRUE(answer.ok()) << answer.status();
  switch (answer.ok() ? answer->relation : Relation::kSeparated) {
    case Relation::kOverlapping:
      return v1::RELATION_OVERLAPPING;
    case Relation::kTouching:
      return v1::RELATION_TOUCHING;
    default:
      return v1::RELATION_SEPARATED;
  }
}

// Counts the calls of all clients by kind and outcome.
class Tally {
 public:
  void Count(const std::string& kind, const absl::Status& status) {
    const std::lock_guard lock(mutex_);
    ++counts_[kind][status.code()];
  }
  uint64_t Of(const std::string& kind, absl::StatusCode code) const {
    const std::lock_guard lock(mutex_);
    const auto kinds = counts_.find(kind);
    if (kinds == counts_.end()) return 0;
    const auto count = kinds->second.find(code);
    return count == kinds->second.end() ? 0 : count->second;
  }
  std::string Text() const {
    const std::lock_guard lock(mutex_);
    std::string text;
    for (const auto& [kind, codes] : counts_) {
      absl::StrAppend(&text, kind, ":");
      for (const auto& [code, count] : codes) {
        absl::StrAppend(&text, " ", count, " ", absl::StatusCodeToString(code));
      }
      text += "\n";
    }
    return text;
  }

 private:
  mutable std::mutex mutex_;
  std::map<std::string, std::map<absl::StatusCode, uint64_t>> counts_;
};

// A client with hulls that it alone changes, and some shared ones. Not thread-safe.
class MixedClient {
 public:
  MixedClient(int number, uint64_t seed, const std::shared_ptr<grpc::Channel>& channel,
              const ClientOptions& options, Tally& tally)
      : random_(seed), channel_(channel), client_(options, channel), tally_(tally) {
    for (int i = 0; i < kHulls; ++i) own_.emplace_back(absl::StrCat("own/", number, "/", i));
  }

  void CallAtRandom() {
    const std::array calls = {
        &MixedClient::Create,       &MixedClient::Append,       &MixedClient::Append,
        &MixedClient::Append,       &MixedClient::Replace,      &MixedClient::Delete,
        &MixedClient::AppendShared, &MixedClient::CheckOwn,     &MixedClient::CheckOwn,
        &MixedClient::CheckShared,  &MixedClient::Batch,        &MixedClient::Scene,
        &MixedClient::Stream,       &MixedClient::Simplify,     &MixedClient::List,
        &MixedClient::SendGarbage,  &MixedClient::SendNonsense, &MixedClient::Vanish};
    (this->*calls[Below(calls.size())])();
  }

  // Checks all of its hulls. Requires: the server is not killed concurrently.
  void LookAtAll() {
    for (HullModel& hull : own_) {
      EXPECT_TRUE(LookAt(&hull));
      EXPECT_TRUE(hull.is_known()) << hull.hull_id();
      const auto audited = client_.GetHull(hull.hull_id(), /*audit=*/true);
      if (audited.ok()) {
        EXPECT_TRUE(audited->audit().ok()) << audited->audit().finding();
      }
    }
  }

 private:
  size_t Below(size_t n) { return random_() % n; }
  HullModel& OwnAtRandom() { return own_[Below(own_.size())]; }
  std::string SharedAtRandom() { return absl::StrCat("shared/", Below(kSharedHulls)); }

  // On a lattice, so that points coincide, lie in planes, and hulls touch.
  double Coordinate() { return static_cast<double>(Below(17)) / 8 - 1; }
  v1::PointBlock SomePoints() {
    v1::PointBlock block;
    const size_t count = 1 + Below(Below(8) == 0 ? 400 : 20);
    for (size_t i = 0; i < 3 * count; ++i) block.add_xyz(Coordinate());
    return block;
  }
  v1::Placement Place(const std::string& hull_id) {
    v1::Placement placement;
    placement.set_hull_id(hull_id);
    v1::Quaternion* const q = placement.mutable_pose()->mutable_rotation();
    const bool is_turned = Below(2) == 0;
    q->set_w(1 + static_cast<double>(Below(3)));
    q->set_x(is_turned ? Coordinate() : 0);
    q->set_y(is_turned ? Coordinate() : 0);
    q->set_z(is_turned ? Coordinate() : 0);
    v1::Vector3* const t = placement.mutable_pose()->mutable_translation();
    t->set_x(2 * Coordinate());
    t->set_y(2 * Coordinate());
    t->set_z(2 * Coordinate());
    return placement;
  }

  Outcome Changed(const std::string& kind, const absl::Status& status) {
    tally_.Count(kind, status);
    return HullModel::OutcomeOf(status);
  }
  bool LookAt(HullModel* hull) {
    std::string problem;
    const bool is_right = hull->Look(client_, &problem);
    EXPECT_TRUE(is_right) << problem;
    return is_right;
  }
  // Returns true if the hull's state is known.
  bool Know(HullModel* hull) {
    if (!hull->is_known()) LookAt(hull);
    return hull->is_known();
  }

  // --- Changes ---

  void Create() {
    HullModel& hull = OwnAtRandom();
    hull.Create(Changed("create", client_.CreateHull(hull.hull_id(), true).status()));
  }
  absl::Status AppendTo(const std::string& hull_id, v1::PointBlock points, bool create) {
    AppendOptions options;
    options.create_if_absent = create;
    const auto appender = client_.OpenAppend(hull_id, options);
    if (!appender.ok()) return appender.status();
    const absl::Status status = (*appender)->Append(std::move(points));
    return status.ok() ? (*appender)->Finish() : status;
  }
  void Append() {
    HullModel& hull = OwnAtRandom();
    const v1::PointBlock points = SomePoints();
    hull.Append(VectorsOf(points),
                Changed("append", AppendTo(hull.hull_id(), points, /*create=*/false)));
    if (Below(4) == 0) LookAt(&hull);
  }
  void AppendShared() {
    Changed("append to a shared hull", AppendTo(SharedAtRandom(), SomePoints(), /*create=*/true));
  }
  void Replace() {
    HullModel& hull = OwnAtRandom();
    const v1::PointBlock points = SomePoints();
    v1::ReplaceOpen open;
    open.set_hull_id(hull.hull_id());
    open.set_create_if_absent(true);
    const auto replaced = client_.ReplaceHull(
        open, [&points](const Client::PointSink& sink) { return sink(points); });
    hull.Replace(VectorsOf(points), Changed("replace", replaced.status()));
  }
  void Delete() {
    HullModel& hull = OwnAtRandom();
    const absl::Status status = client_.DeleteHull(hull.hull_id()).status();
    hull.Delete(Changed("delete", status));
  }

  // --- Queries ---

  // Returns the hulls known to exist. Only this client changes them.
  std::vector<const HullModel*> Present() {
    std::vector<const HullModel*> present;
    for (HullModel& hull : own_) {
      if (Know(&hull) && hull.hull() != nullptr) present.push_back(&hull);
    }
    return present;
  }
  v1::Relation Truth(const HullModel& a, const v1::Placement& at_a, const HullModel& b,
                     const v1::Placement& at_b) {
    return TrueRelation(*a.hull(), PoseOf(at_a), *b.hull(), PoseOf(at_b));
  }

  void CheckOwn() {
    const auto present = Present();
    if (present.empty()) return;
    const HullModel& a = *present[Below(present.size())];
    const HullModel& b = *present[Below(present.size())];
    v1::CheckCollisionRequest request;
    *request.mutable_a() = Place(a.hull_id());
    *request.mutable_b() = Place(b.hull_id());
    request.mutable_wanted()->set_certificate(true);
    request.mutable_wanted()->set_separation(true);
    const auto verified = CheckCollisionVerified(client_, request);
    tally_.Count("check", verified.status());
    if (!verified.ok()) return;
    const v1::CheckCollisionResponse& response = verified->response;
    EXPECT_EQ(response.relation(), Truth(a, request.a(), b, request.b()))
        << request.ShortDebugString();
    const bool is_empty = a.hull()->vertices().empty() || b.hull()->vertices().empty();
    if (!is_empty) {
      EXPECT_EQ(verified->verification.verdict, Verdict::kValid) << verified->verification.reason;
    }
    ++verified_;
  }
  void CheckShared() {
    v1::CheckCollisionRequest request;
    *request.mutable_a() = Place(SharedAtRandom());
    *request.mutable_b() = Place(SharedAtRandom());
    request.mutable_wanted()->set_certificate(true);
    const auto verified = CheckCollisionVerified(client_, request);
    tally_.Count("check a growing hull", verified.status());
    if (verified.ok()) {
      EXPECT_NE(verified->verification.verdict, Verdict::kInvalid) << verified->verification.reason;
    }
  }
  void Batch() {
    const auto present = Present();
    if (present.empty()) return;
    v1::BatchCheckCollisionsRequest request;
    std::vector<v1::Relation> truth;
    for (uint32_t i = 0; i < 8; ++i) {
      const HullModel& a = *present[Below(present.size())];
      const HullModel& b = *present[Below(present.size())];
      *request.add_placements() = Place(a.hull_id());
      *request.add_placements() = Place(b.hull_id());
      request.add_pairs(2 * i);
      request.add_pairs(2 * i + 1);
      truth.push_back(Truth(a, request.placements(static_cast<int>(2 * i)), b,
                            request.placements(static_cast<int>(2 * i + 1))));
    }
    std::vector<v1::Relation> answered;
    const absl::Status status = client_.BatchCheckCollisions(
        request, [&answered](const v1::BatchCheckCollisionsResponse& part) {
          for (const int relation : part.columns().relations()) {
            answered.push_back(static_cast<v1::Relation>(relation));
          }
          return absl::OkStatus();
        });
    tally_.Count("batch", status);
    if (status.ok()) {
      EXPECT_EQ(answered, truth) << request.ShortDebugString();
    }
  }
  void Scene() {
    const auto present = Present();
    if (present.empty()) return;
    v1::FindCollisionsRequest request;
    std::vector<const HullModel*> placed;
    for (int i = 0; i < 10; ++i) {
      placed.push_back(present[Below(present.size())]);
      *request.add_placements() = Place(placed.back()->hull_id());
    }
    std::map<std::pair<uint32_t, uint32_t>, int> answered;
    const absl::Status status =
        client_.FindCollisions(request, [&answered](const v1::FindCollisionsResponse& part) {
          for (int i = 0; i + 1 < part.pairs_size(); i += 2) {
            answered[std::minmax(part.pairs(i), part.pairs(i + 1))] =
                part.columns().relations(i / 2);
          }
          return absl::OkStatus();
        });
    tally_.Count("scene", status);
    if (!status.ok()) return;
    for (uint32_t a = 0; a < placed.size(); ++a) {
      for (uint32_t b = a + 1; b < placed.size(); ++b) {
        const auto pair = answered.find({a, b});
        EXPECT_EQ(pair == answered.end() ? static_cast<int>(v1::RELATION_SEPARATED) : pair->second,
                  Truth(*placed[a], request.placements(static_cast<int>(a)), *placed[b],
                        request.placements(static_cast<int>(b))));
      }
    }
  }
  void Stream() {
    const auto present = Present();
    if (present.empty()) return;
    const HullModel& a = *present[Below(present.size())];
    const HullModel& b = *present[Below(present.size())];
    v1::CollisionStreamOpen open;
    *open.add_placements() = Place(a.hull_id());
    *open.add_placements() = Place(b.hull_id());
    open.add_pairs(0);
    open.add_pairs(1);
    v1::Placement moved = open.placements(1);
    const v1::Placement still = open.placements(0);
    const auto stream = client_.OpenCollisionStream();
    auto answer = stream->Open(open);
    for (int step = 0; answer.ok(); ++step) {
      ASSERT_EQ(answer->columns().relations_size(), 1);
      EXPECT_EQ(answer->columns().relations(0), Truth(a, still, b, moved));
      if (step == 4) break;
      moved = Place(b.hull_id());
      v1::CollisionStreamUpdate update;
      update.add_placements(1);
      const Pose pose = PoseOf(moved);
      for (const double number : pose.q) update.add_poses(number);
      for (const double number : pose.t) update.add_poses(number);
      answer = stream->Update(update);
    }
    tally_.Count("stream", answer.status());
  }
  void Simplify() {
    v1::GetHullMeshRequest request;
    request.set_hull_id(OwnAtRandom().hull_id());
    request.mutable_simplification()->set_side(v1::SIMPLIFICATION_SIDE_OUTSIDE);
    request.mutable_simplification()->set_max_vertices(12);
    tally_.Count("simplify", client_.GetHullMesh(request).status());
  }
  void List() {
    const auto listed = client_.ListAllHulls("");
    tally_.Count("list", listed.status());
    if (!listed.ok()) return;
    EXPECT_LE(listed->hulls_size(), kClients * kHulls + kSharedHulls + 1);
  }

  // --- Malformed requests ---

  // Sends bytes that are not a message to a random call.
  void SendGarbage() {
    const std::array methods = {"HullService/GetHull", "HullService/CreateHull",
                                "CollisionService/CheckCollision",
                                "CollisionService/BatchCheckCollisions"};
    std::string bytes(1 + Below(200), '\0');
    for (char& byte : bytes) byte = static_cast<char>(Below(256));
    // No field has the number 0.
    bytes[0] = '\x07';
    const grpc::Slice slice(bytes);
    grpc::ByteBuffer request(&slice, 1);
    grpc::ByteBuffer response;
    grpc::ClientContext context;
    grpc::CompletionQueue queue;
    grpc::GenericStub stub(channel_);
    const auto call = stub.PrepareUnaryCall(
        &context, absl::StrCat("/hulld.v1.", methods[Below(methods.size())]), request, &queue);
    grpc::Status status;
    call->StartCall();
    call->Finish(&response, &status, nullptr);
    void* tag = nullptr;
    bool ok = false;
    queue.Next(&tag, &ok);
    const auto code = static_cast<absl::StatusCode>(status.error_code());
    tally_.Count("garbage", absl::Status(code, ""));
    EXPECT_TRUE(code == absl::StatusCode::kInvalidArgument ||
                code == absl::StatusCode::kUnavailable || code == absl::StatusCode::kCancelled)
        << status.error_message();
  }
  // Sends well-formed but invalid requests: all are refused and change nothing.
  void SendNonsense() {
    HullModel& hull = OwnAtRandom();
    v1::PointBlock points = SomePoints();
    points.set_xyz(0, std::numeric_limits<double>::quiet_NaN());
    absl::Status status = AppendTo(hull.hull_id(), points, /*create=*/false);
    if (absl::IsNotFound(status)) {
      v1::CheckCollisionRequest request;
      *request.mutable_a() = Place("own/nobody's");
      *request.mutable_b() = Place(hull.hull_id());
      status = client_.CheckCollision(request).status();
    }
    tally_.Count("nonsense", status);
    EXPECT_FALSE(status.ok());
    EXPECT_FALSE(absl::IsInternal(status)) << status;
  }
  // Abandons calls in the middle.
  void Vanish() {
    const auto hulls = v1::HullService::NewStub(channel_);
    const auto collisions = v1::CollisionService::NewStub(channel_);
    grpc::ClientContext append_context;
    const auto append = hulls->AppendPoints(&append_context);
    v1::AppendPointsRequest request;
    request.mutable_open()->set_hull_id(SharedAtRandom());
    request.mutable_open()->set_writer_id("vanishes");
    append->Write(request);
    request.mutable_chunk()->set_sequence(1);
    *request.mutable_chunk()->mutable_points() = SomePoints();
    append->Write(request);
    grpc::ClientContext scene_context;
    v1::FindCollisionsRequest scene;
    for (int i = 0; i < 300; ++i) *scene.add_placements() = Place(SharedAtRandom());
    const auto answers = collisions->FindCollisions(&scene_context, scene);
    grpc::ClientContext watch_context;
    const auto watch = hulls->WatchHulls(&watch_context, {});
    append_context.TryCancel();
    scene_context.TryCancel();
    watch_context.TryCancel();
    append->Finish();
    answers->Finish();
    const grpc::Status status = watch->Finish();
    tally_.Count("vanish", absl::Status(static_cast<absl::StatusCode>(status.error_code()), ""));
  }

 public:
  // Answers with a verified certificate.
  uint64_t verified() const { return verified_; }

 private:
  std::mt19937_64 random_;
  const std::shared_ptr<grpc::Channel> channel_;
  const Client client_;
  Tally& tally_;
  std::vector<HullModel> own_;
  uint64_t verified_ = 0;
};

// Resources of a process.
struct Holdings {
  int64_t resident_kib = 0;
  int64_t threads = 0;
  // Sockets and other non-file descriptors: the number of files open depends on the store.
  int64_t descriptors = 0;
};

Holdings HoldingsOf(pid_t pid) {
  Holdings holdings;
  std::ifstream status(absl::StrCat("/proc/", pid, "/status"));
  for (std::string line; std::getline(status, line);) {
    const auto number = [&line] { return std::atoll(line.c_str() + line.find(':') + 1); };
    if (line.starts_with("VmRSS:")) holdings.resident_kib = number();
    if (line.starts_with("Threads:")) holdings.threads = number();
  }
  const std::string folder = absl::StrCat("/proc/", pid, "/fd");
  DIR* const directory = opendir(folder.c_str());
  if (directory == nullptr) return holdings;
  while (const dirent* const entry = readdir(directory)) {
    std::array<char, 256> target{};
    const auto length = readlink(absl::StrCat(folder, "/", entry->d_name).c_str(), target.data(),
                                 target.size() - 1);
    if (length > 0 && target[0] != '/') ++holdings.descriptors;
  }
  closedir(directory);
  return holdings;
}

class Endurance : public RestartableServer {
 protected:
  static constexpr int64_t kDiskBytes = int64_t{256} << 20;

  void SetUp() override {
    // A separate disk that can be filled, if this process may mount one.
    const std::string store = directory_.path() + "/store";
    mkdir(store.c_str(), 0700);
    has_disk_ =
        mount("none", store.c_str(), "tmpfs", 0, absl::StrCat("size=", kDiskBytes).c_str()) == 0;
    if (!has_disk_) std::printf("a full disk is left out: nothing may be mounted here\n");
    Start();
  }
  void TearDown() override {
    if (server_ != nullptr) Stop(SIGTERM);
    if (has_disk_) umount2((directory_.path() + "/store").c_str(), MNT_DETACH);
  }

  void Start() {
    StartServer({"--log-level", "error", "--drain-timeout", "5"});
    // Drains the server's output, so that the server never blocks on it.
    reader_ = std::thread([server = server_.get()] { server->ReadToEnd(); });
  }
  void Stop(int signal) {
    server_->Signal(signal);
    EXPECT_EQ(server_->Wait(), signal == SIGTERM ? 0 : -1);
    reader_.join();
    server_.reset();
  }
  std::string filler() const { return directory_.path() + "/store/filler"; }
  void FillDisk() {
    std::ofstream out(filler(), std::ios::binary);
    const std::string block(1 << 20, 'x');
    while (out.write(block.data(), static_cast<std::streamsize>(block.size())).flush()) {
    }
  }
  // Changes a hull until the disk is full: the store has reserved some space.
  absl::Status WriteUntilRefused(const Client& client) {
    v1::PointBlock sphere;
    for (int i = 0; i < 8000; ++i) {
      const double z = (2 * i + 1) / 8000. - 1;
      const double r = std::sqrt(1 - z * z);
      sphere.add_xyz(r * std::cos(2.4 * i));
      sphere.add_xyz(r * std::sin(2.4 * i));
      sphere.add_xyz(z);
    }
    v1::ReplaceOpen open;
    open.set_hull_id("large");
    open.set_create_if_absent(true);
    for (int64_t bytes = 0; bytes < kDiskBytes; bytes += 24 * 8000) {
      const auto replaced = client.ReplaceHull(
          open, [&sphere](const Client::PointSink& sink) { return sink(sphere); });
      if (!replaced.ok()) return replaced.status();
    }
    return absl::OkStatus();
  }

  bool has_disk_ = false;
  std::thread reader_;
};

TEST_F(Endurance, AllAnswersAreRightAndNoResourceLeaks) {
  const auto seed = static_cast<uint64_t>(NumberIn("HULLD_TEST_SEED", 1));
  const int rounds = NumberIn("HULLD_ENDURANCE_ROUNDS", kRounds);
  ClientOptions options;
  options.timeout = std::chrono::seconds(60);
  options.retry.max_attempts = 1000;
  options.retry.initial_backoff = std::chrono::milliseconds(5);
  options.retry.max_backoff = std::chrono::milliseconds(50);
  Tally tally;
  std::vector<std::unique_ptr<MixedClient>> clients;
  for (int i = 0; i < kClients; ++i) {
    clients.push_back(std::make_unique<MixedClient>(i, seed * kClients + static_cast<uint64_t>(i),
                                                    Channel(i), options, tally));
  }
  std::mt19937_64 random(seed);
  std::vector<Holdings> held;
  int kills = 0;
  int full_disks = 0;
  for (int round = 0; round < rounds && !HasFailure(); ++round) {
    // None, a kill, a full disk, or a kill while the disk is full.
    const bool is_killed = round % 2 == 1;
    const bool is_full = round % 4 >= 2 && has_disk_;
    if (is_full) {
      FillDisk();
      const absl::Status refused = WriteUntilRefused(Client(options, Channel(kClients)));
      EXPECT_FALSE(refused.ok()) << "the disk was never full";
      tally.Count("write to a full disk", refused);
    }
    std::atomic<int> calls = 0;
    std::vector<std::thread> threads;
    for (const auto& client : clients) {
      threads.emplace_back([&calls, &client = *client] {
        for (int i = 0; i < kCallsPerRound && !HasFailure(); ++i) {
          client.CallAtRandom();
          ++calls;
          calls.notify_all();
        }
        calls = kClients * kCallsPerRound;
        calls.notify_all();
      });
    }
    const auto wait_for = [&calls](int number) {
      for (int now = calls; now < number; now = calls) calls.wait(now);
    };
    const int at = kClients * kCallsPerRound / 4 + static_cast<int>(random() % 100);
    wait_for(at);
    if (is_killed) Stop(SIGKILL);
    if (is_full) unlink(filler().c_str());
    if (is_killed) Start();
    kills += is_killed;
    full_disks += is_full;
    for (std::thread& thread : threads) thread.join();
    for (const auto& client : clients) client->LookAtAll();
    // A freshly started server has fewer.
    if (round < kWarmRounds) continue;
    held.push_back(HoldingsOf(server_->pid()));
    std::printf("round %d: %lld KiB, %lld threads, %lld descriptors\n", round,
                static_cast<long long>(held.back().resident_kib),
                static_cast<long long>(held.back().threads),
                static_cast<long long>(held.back().descriptors));
    std::fflush(stdout);
  }
  uint64_t verified = 0;
  for (const auto& client : clients) verified += client->verified();
  std::printf("seed %llu: %d rounds, %d kills, full disks: %d, certificates checked: %llu\n%s",
              static_cast<unsigned long long>(seed), rounds, kills, full_disks,
              static_cast<unsigned long long>(verified), tally.Text().c_str());
  ASSERT_GE(held.size(), 2u);
  // The numbers of clients and hulls are constant; caches of the store and of memory may differ.
  const size_t half = held.size() / 2;
  const auto most = [&held](size_t from, size_t to, int64_t Holdings::*what) {
    int64_t value = 0;
    for (size_t i = from; i < to; ++i) value = std::max(value, held[i].*what);
    return value;
  };
  for (const auto what : {&Holdings::threads, &Holdings::descriptors}) {
    EXPECT_LE(most(half, held.size(), what), most(0, half, what) + 4);
  }
// AddressSanitizer retains freed memory for a while.
#ifndef HULLD_SANITIZED
  EXPECT_LE(most(half, held.size(), &Holdings::resident_kib),
            most(0, half, &Holdings::resident_kib) + (32 << 10));
#endif
  EXPECT_GT(verified, 0u);
  for (const char* const kind :
       {"create", "append", "append to a shared hull", "replace", "delete", "check",
        "check a growing hull", "batch", "scene", "stream", "simplify", "list"}) {
    EXPECT_GT(tally.Of(kind, absl::StatusCode::kOk), 0u) << kind;
  }
  EXPECT_GT(tally.Of("garbage", absl::StatusCode::kInvalidArgument), 0u);
}

}  // namespace endurance_test
}  // namespace hulld::server
