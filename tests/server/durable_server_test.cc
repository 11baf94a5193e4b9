// API tests of a server on a durable store: restarts, replacement, backups, and the doctor.

#include <gmock/gmock.h>
#include <prometheus/text_serializer.h>
#include <rocksdb/env.h>
#include <sys/stat.h>

#include <filesystem>
#include <fstream>
#include <sstream>

#include "client/backup_file.h"
#include "client/client.h"
#include "hulld/v1/body.grpc.pb.h"
#include "server/admin/doctor.h"
#include "tests/server/harness/faulty_file_system.h"
#include "tests/server/harness/test_server.h"

namespace hulld::server {
namespace durable_server_test {

using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::UnorderedElementsAre;

class DurableServer : public ServerTest {
 protected:
  DurableServer() {
    std::string name = ::testing::TempDir() + "hulld_server_XXXXXX";
    directory_ = mkdtemp(name.data());
  }
  ~DurableServer() override { std::filesystem::remove_all(directory_); }

  Config DurableConfig(const std::string& name = "data") {
    Config config = TestConfig();
    config.store = "rocksdb";
    config.data_dir = directory_ + "/" + name;
    return config;
  }
  void SetUp() override { Restart(DurableConfig()); }

  Client MakeClient() {
    ClientOptions options;
    options.server = server_->address();
    return Client(options);
  }
  absl::StatusOr<v1::ReplaceHullResponse> Replace(const v1::ReplaceOpen& open,
                                                  const Coordinates& xyz) {
    return MakeClient().ReplaceHull(open, [&](const Client::PointSink& sink) {
      v1::PointBlock block;
      block.mutable_xyz()->Assign(xyz.begin(), xyz.end());
      return sink(block);
    });
  }

  void SaveBackup(const std::string& file) {
    BackupWriter writer(file);
    ASSERT_TRUE(writer.Open().ok());
    const absl::Status saved = MakeClient().SaveBackup(
        [&](const v1::SaveBackupResponse& part) { return writer.Write(part); });
    ASSERT_TRUE(saved.ok()) << saved;
    ASSERT_TRUE(writer.Finish().ok());
  }

  std::string directory_;
};

TEST_F(DurableServer, FailuresOfTheStoreShowInMetrics) {
  const auto files = std::make_shared<FaultyFileSystem>();
  const std::unique_ptr<rocksdb::Env> env = rocksdb::NewCompositeEnv(files);
  Config config = DurableConfig("faulty");
  config.store_env = env.get();
  Restart(config);
  // Larger than the block with the records, which is read when the store opens.
  Put("h", Sphere(1000));
  Restart(config);
  const auto failures = [this] {
    std::istringstream lines(prometheus::TextSerializer().Serialize(server_->metrics().Collect()));
    std::vector<std::string> found;
    for (std::string line; std::getline(lines, line);) {
      if (line.starts_with("hulld_store_failures_total{")) found.push_back(line.substr(27));
    }
    return found;
  };
  EXPECT_THAT(failures(), UnorderedElementsAre("operation=\"write\"} 0", "operation=\"sync\"} 0",
                                               "operation=\"read\"} 0"));
  files->SetFault(FaultyFileSystem::Fault::kReadError);
  grpc::ClientContext context;
  v1::GetHullRequest request;
  v1::GetHullResponse response;
  request.set_hull_id("h");
  EXPECT_EQ(hulls_->GetHull(&context, request, &response).error_code(),
            grpc::StatusCode::UNAVAILABLE);
  EXPECT_THAT(failures(), Contains("operation=\"read\"} 1"));
  files->SetFault(FaultyFileSystem::Fault::kSyncError);
  EXPECT_EQ(Delete("h").error_code(), grpc::StatusCode::UNAVAILABLE);
  EXPECT_THAT(failures(), UnorderedElementsAre("operation=\"write\"} 0", "operation=\"sync\"} 1",
                                               "operation=\"read\"} 1"));
  files->SetFault(FaultyFileSystem::Fault::kIoError);
  EXPECT_EQ(Delete("h").error_code(), grpc::StatusCode::UNAVAILABLE);
  EXPECT_THAT(failures(), Contains("operation=\"write\"} 1"));
  files->SetFault(FaultyFileSystem::Fault::kNone);
  EXPECT_TRUE(Delete("h").ok());
  // Before the file system is destroyed.
  TearDown();
}

TEST_F(DurableServer, AcksStateThatTheChunkIsOnDisk) {
  Appender appender(*hulls_, "h", "w", true);
  EXPECT_EQ(appender.Append(1, Cube())->durability(), v1::DURABILITY_SYNC);
  EXPECT_TRUE(appender.Finish().ok());
  Config relaxed = DurableConfig();
  relaxed.durability = "relaxed";
  Restart(relaxed);
  Appender next(*hulls_, "h", "w");
  EXPECT_EQ(next.opened().last_sequence(), 1);
  EXPECT_EQ(next.Append(2, {3, 3, 3})->durability(), v1::DURABILITY_RELAXED);
}

TEST_F(DurableServer, ARestartKeepsAcknowledgedChanges) {
  Put("a/sphere", Sphere(300));
  Put("cube", Cube());
  const v1::GetHullResponse before = Get("a/sphere");
  Restart(DurableConfig());
  const v1::GetHullResponse after = Get("a/sphere");
  EXPECT_EQ(after.SerializeAsString(), before.SerializeAsString());
  v1::CheckCollisionRequest request;
  *request.mutable_a() = PlacementOf("a/sphere");
  *request.mutable_b() = PlacementOf("cube", 5, 0, 0);
  EXPECT_EQ(Check(request).relation(), v1::RELATION_SEPARATED);
}

TEST_F(DurableServer, AReplacementIsAtomic) {
  Put("h", Sphere(100));
  const uint64_t revision = Get("h").hull().revision();
  v1::ReplaceOpen open;
  open.set_hull_id("h");
  open.set_if_revision(revision);
  const auto replaced = Replace(open, Cube());
  ASSERT_TRUE(replaced.ok()) << replaced.status();
  EXPECT_FALSE(replaced->created());
  EXPECT_EQ(replaced->durability(), v1::DURABILITY_SYNC);
  EXPECT_EQ(Get("h").hull().SerializeAsString(), replaced->hull().SerializeAsString());
  EXPECT_EQ(Replace(open, Cube()).status().code(), absl::StatusCode::kAborted);
  Restart(DurableConfig());
  EXPECT_EQ(Get("h").hull().vertex_count(), 8);
  EXPECT_EQ(Get("h").hull().counts().received(), 8);
}

TEST_F(DurableServer, AReplacementThatFailsChangesNothing) {
  Put("h", Sphere(100));
  const std::string before = Get("h").hull().SerializeAsString();
  v1::ReplaceOpen open;
  open.set_hull_id("h");
  const auto nan = Replace(open, {0, 0, std::nan("")});
  EXPECT_EQ(nan.status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(nan.status().message()), HasSubstr("message 2: points[0].z is NaN"));
  const auto broken = MakeClient().ReplaceHull(open, [&](const Client::PointSink& sink) {
    v1::PointBlock block;
    for (const double x : Cube()) block.add_xyz(x);
    EXPECT_TRUE(sink(block).ok());
    return absl::InvalidArgumentError("the file ends early");
  });
  EXPECT_THAT(std::string(broken.status().message()), HasSubstr("the file ends early"));
  EXPECT_EQ(Get("h").hull().SerializeAsString(), before);
  // A severed stream differs from one ended by its client only by the missing last message.
  grpc::ClientContext context;
  v1::ReplaceHullResponse response;
  const auto writer = hulls_->ReplaceHull(&context, &response);
  v1::ReplaceHullRequest request;
  *request.mutable_open() = open;
  ASSERT_TRUE(writer->Write(request));
  for (const double x : Cube()) request.mutable_points()->add_xyz(x);
  ASSERT_TRUE(writer->Write(request));
  writer->WritesDone();
  EXPECT_EQ(writer->Finish().error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_EQ(Get("h").hull().SerializeAsString(), before);
  open.set_hull_id("none");
  EXPECT_EQ(Replace(open, Cube()).status().code(), absl::StatusCode::kNotFound);
  open.set_create_if_absent(true);
  EXPECT_TRUE(Replace(open, Cube())->created());
}

// Their duration grows with the data, so the default deadline of other calls does not apply.
TEST_F(DurableServer, ReplaceAndSaveHaveADeadlineOnlyIfRequested) {
  Put("h", Cube());
  // A deadline that has already passed.
  constexpr std::chrono::milliseconds kPassed = std::chrono::hours(-1);
  ClientOptions options;
  options.server = server_->address();
  options.timeout = kPassed;
  const Client client(options);
  v1::ReplaceOpen open;
  open.set_hull_id("h");
  const auto feed = [](const Client::PointSink&) { return absl::OkStatus(); };
  const auto receive = [](const v1::SaveBackupResponse&) { return absl::OkStatus(); };
  EXPECT_TRUE(absl::IsDeadlineExceeded(client.GetStatus().status()));
  EXPECT_TRUE(absl::IsDeadlineExceeded(client.ReplaceHull(open, feed, kPassed).status()));
  EXPECT_TRUE(absl::IsDeadlineExceeded(client.SaveBackup(receive, kPassed)));
  EXPECT_TRUE(client.ReplaceHull(open, feed).ok());
  EXPECT_TRUE(client.SaveBackup(receive).ok());
}

TEST_F(DurableServer, ReplacingEndsTheStreamsThatAppend) {
  Appender appender(*hulls_, "h", "w", true);
  ASSERT_TRUE(appender.Append(1, Sphere(50)).has_value());
  v1::ReplaceOpen open;
  open.set_hull_id("h");
  ASSERT_TRUE(Replace(open, Cube()).ok());
  EXPECT_FALSE(appender.ReadAck().has_value());
  const grpc::Status status = appender.Finish();
  EXPECT_EQ(status.error_code(), grpc::StatusCode::FAILED_PRECONDITION);
  EXPECT_THAT(status.error_message(), HasSubstr("was replaced"));
  Appender again(*hulls_, "h", "w");
  EXPECT_EQ(again.opened().last_sequence(), 0);
}

TEST_F(DurableServer, ABackupBecomesASeparateStore) {
  Put("sphere", Sphere(300));
  const v1::GetHullResponse before = Get("sphere");
  const std::string file = directory_ + "/backup";
  SaveBackup(file);
  // The server continues, and later changes are not in the backup.
  ASSERT_TRUE(Delete("sphere").ok());
  const auto restored = RestoreBackup(file, directory_ + "/restored");
  ASSERT_TRUE(restored.ok()) << restored.status();
  EXPECT_EQ(RestoreBackup(file, directory_ + "/restored").status().code(),
            absl::StatusCode::kFailedPrecondition);
  Restart(DurableConfig("restored"));
  const v1::GetHullResponse after = Get("sphere");
  EXPECT_EQ(after.hull().SerializeAsString(), before.hull().SerializeAsString());
  EXPECT_EQ(after.header().revision(), before.header().revision());
  // From here on both may assign the same revision to different changes.
  EXPECT_NE(after.header().store_id(), before.header().store_id());
  Restart(DurableConfig("restored"));
  EXPECT_EQ(Get("sphere").header().store_id(), after.header().store_id());
}

TEST_F(DurableServer, ABackupContainsBodies) {
  Put("cube", Cube());
  v1::PutBodyRequest put;
  put.set_body_id("two-cubes");
  for (const double x : {0.0, 0.1}) {
    v1::Placement& piece = *put.add_pieces();
    piece.set_hull_id("cube");
    piece.mutable_pose()->mutable_rotation()->set_w(1);
    piece.mutable_pose()->mutable_rotation()->set_z(x);
    piece.mutable_pose()->mutable_translation()->set_x(x);
  }
  const auto get = [this] {
    v1::GetBodyRequest request;
    request.set_body_id("two-cubes");
    v1::GetBodyResponse response;
    grpc::ClientContext context;
    const grpc::Status status =
        v1::BodyService::NewStub(channel_)->GetBody(&context, request, &response);
    EXPECT_TRUE(status.ok()) << status.error_message();
    return response;
  };
  {
    v1::PutBodyResponse response;
    grpc::ClientContext context;
    ASSERT_TRUE(v1::BodyService::NewStub(channel_)->PutBody(&context, put, &response).ok());
  }
  const v1::GetBodyResponse before = get();
  const std::string file = directory_ + "/backup";
  SaveBackup(file);
  ASSERT_TRUE(RestoreBackup(file, directory_ + "/restored").ok());
  Restart(DurableConfig("restored"));
  const v1::GetBodyResponse after = get();
  ASSERT_EQ(after.pieces_size(), 2);
  for (int i = 0; i < 2; ++i) {
    EXPECT_EQ(after.pieces(i).SerializeAsString(), put.pieces(i).SerializeAsString());
  }
  EXPECT_EQ(after.body().SerializeAsString(), before.body().SerializeAsString());
}

TEST_F(DurableServer, ADamagedOrTruncatedBackupIsRefused) {
  Put("sphere", Sphere(300));
  const std::string file = directory_ + "/backup";
  SaveBackup(file);
  const auto size = std::filesystem::file_size(file);
  const std::string copy = directory_ + "/copy";
  for (const uintmax_t at : {uintmax_t{20}, size / 3, size / 2, size - 3}) {
    std::filesystem::copy_file(file, copy, std::filesystem::copy_options::overwrite_existing);
    std::fstream bytes(copy, std::ios::in | std::ios::out | std::ios::binary);
    bytes.seekg(static_cast<std::streamoff>(at));
    const char flipped = static_cast<char>(bytes.get() ^ 1);
    bytes.seekp(static_cast<std::streamoff>(at));
    bytes.put(flipped);
    bytes.close();
    EXPECT_FALSE(RestoreBackup(copy, directory_ + "/restored").ok()) << at;
    std::filesystem::resize_file(copy, at);
    EXPECT_FALSE(RestoreBackup(copy, directory_ + "/restored").ok()) << at;
    EXPECT_FALSE(std::filesystem::exists(directory_ + "/restored"));
  }
}

TEST_F(DurableServer, ABackupIsRestoredIntoAnExistingDirectory) {
  Put("sphere", Sphere(300));
  const v1::GetHullResponse before = Get("sphere");
  const std::string file = directory_ + "/backup";
  SaveBackup(file);
  // A mount point cannot be replaced, and a user who owns only the mount point cannot create
  // siblings of it.
  const std::string target = directory_ + "/mounted";
  std::filesystem::create_directories(target + "/lost+found");
  // Remains of a killed restore.
  std::filesystem::create_directories(target + "/restoring/rocksdb");
  std::ofstream(target + "/restoring/rocksdb/CURRENT") << "half";
  std::ofstream(target + "/restored").close();
  // Belongs to another user.
  std::filesystem::create_directories(target + ".restoring/mine");
  const auto inode = [&target] {
    struct stat status = {};
    EXPECT_EQ(stat(target.c_str(), &status), 0);
    return status.st_ino;
  };
  const ino_t inode_before = inode();
  const auto restored = RestoreBackup(file, target);
  ASSERT_TRUE(restored.ok()) << restored.status();
  EXPECT_EQ(inode(), inode_before);
  EXPECT_TRUE(std::filesystem::exists(target + ".restoring/mine"));
  EXPECT_FALSE(std::filesystem::exists(target + "/restoring"));
  Restart(DurableConfig("mounted"));
  EXPECT_EQ(Get("sphere").hull().SerializeAsString(), before.hull().SerializeAsString());
  EXPECT_NE(Get("sphere").header().store_id(), before.header().store_id());
}

TEST_F(DurableServer, AFailedRestoreLeavesTheDirectoryEmpty) {
  Put("sphere", Sphere(300));
  const std::string file = directory_ + "/backup";
  SaveBackup(file);
  std::filesystem::resize_file(file, std::filesystem::file_size(file) - 3);
  const std::string target = directory_ + "/mounted";
  std::filesystem::create_directory(target);
  EXPECT_FALSE(RestoreBackup(file, target).ok());
  EXPECT_TRUE(std::filesystem::is_empty(target));
}

TEST_F(DurableServer, TheDoctorChecksAStoreThatIsNotOpen) {
  Put("sphere", Sphere(300));
  Put("cube", Cube());
  TearDown();
  EXPECT_EQ(RunDoctor({"--data-dir", directory_ + "/data"}), 0);
  EXPECT_EQ(RunDoctor({"--data-dir", directory_ + "/data", "--json"}), 0);
  EXPECT_EQ(RunDoctor({"--data-dir", directory_ + "/none"}), 2);
  EXPECT_EQ(RunDoctor({}), 2);
}

TEST_F(ServerTest, AStoreInMemoryHasNoBackup) {
  grpc::ClientContext context;
  const auto stub = v1::MaintenanceService::NewStub(channel_);
  const auto reader = stub->SaveBackup(&context, v1::SaveBackupRequest());
  v1::SaveBackupResponse part;
  EXPECT_FALSE(reader->Read(&part));
  const grpc::Status status = reader->Finish();
  EXPECT_EQ(status.error_code(), grpc::StatusCode::FAILED_PRECONDITION);
  EXPECT_THAT(status.error_message(), HasSubstr("--store=memory"));
}

}  // namespace durable_server_test
}  // namespace hulld::server
