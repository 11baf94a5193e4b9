// hullctl's commands against the real server: their output matches the server's answers.
#include <absl/strings/ascii.h>
#include <gmock/gmock.h>
#include <google/protobuf/struct.pb.h>
#include <google/protobuf/util/json_util.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <map>
#include <random>
#include <sstream>
#include <thread>

#include "client/client.h"
#include "client/hullctl/printing/json.h"
#include "client/verify/certificate_check.h"
#include "tests/client/formats/point_reading.h"
#include "tests/client/hullctl/hullctl_on_server.h"

namespace hulld {
namespace hullctl_server_test {

using ::google::protobuf::Struct;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

class HullctlQueries : public HullctlOnServer {
 protected:
  // Returns a recorded answer, as written by `check --record`.
  static std::string Recorded(const v1::CheckCollisionRequest& request,
                              const v1::CheckCollisionResponse& response) {
    return "{\"request\":" + MessageJson(request) + ",\"response\":" + MessageJson(response) + "}";
  }

  // Two cubes that share a face, with a certificate.
  std::pair<v1::CheckCollisionRequest, v1::CheckCollisionResponse> TouchingCubes() {
    v1::CheckCollisionRequest request;
    *request.mutable_a() = server::PlacementOf("cube");
    *request.mutable_b() = server::PlacementOf("cube", 1);
    v1::CheckCollisionResponse response = Check(request);
    v1::Certificate* const certificate = response.mutable_certificate();
    certificate->mutable_direction()->set_x(1);
    certificate->add_pairs()->set_index_a(4);
    return {request, response};
  }
};

TEST_F(HullctlQueries, ValuesFromAListTakeAnyLetterCase) {
  const TempFile file("points", "1 2 3\n4 5 6\n");
  for (const std::string& name : PointFormatNames()) {
    const Ran lower = Run({"append", name, file.path(), "--create", "--format", name});
    const Ran upper =
        Run({"append", name, file.path(), "--create", "--format", absl::AsciiStrToUpper(name)});
    EXPECT_EQ(upper.code, lower.code) << upper.err;
    EXPECT_THAT(upper.err, Not(HasSubstr("is none of")));
  }
  const Ran ran =
      Run({"append", "cloud", file.path(), "--create", "--format", "Xyz", "--output", "JSON"});
  EXPECT_EQ(ran.code, 0) << ran.err;
  EXPECT_THAT(ran.out, HasSubstr("\"opened\""));
}

// Commands without --format recommended it, too.
TEST_F(HullctlQueries, OnlyCommandsWithAFormatOptionRecommendIt) {
  Put("cube", server::Cube());
  const TempFile file("part.step", "ISO-10303-21;\n");
  EXPECT_THAT(Run({"append", "cube", file.path()}).err,
              HasSubstr("rgb; or set the format with --format\n"));
  const Ran cover = Run({"cover", "cube", file.path()});
  EXPECT_THAT(cover.err, HasSubstr("convert or rename the file; supported are obj, "));
  EXPECT_THAT(cover.err, Not(HasSubstr("--format")));
}

TEST_F(HullctlQueries, VerifyDistinguishesValidInvalidAndUncheckable) {
  Put("cube", server::Cube());
  auto [request, response] = TouchingCubes();
  const TempFile valid("valid.json", Recorded(request, response));
  Ran ran = Run({"verify", valid.path()});
  EXPECT_EQ(ran.code, 0) << ran.err;
  EXPECT_EQ(ran.out, "TOUCHING: valid\n");

  response.set_relation(v1::RELATION_SEPARATED);
  const TempFile wrong("wrong.json", Recorded(request, response));
  ran = Run({"verify", wrong.path(), "--output", "json"});
  EXPECT_EQ(ran.code, 5);
  EXPECT_THAT(ran.out, HasSubstr("\"verdict\":\"INVALID\""));
  EXPECT_THAT(ran.err, HasSubstr("does not prove the answer: the direction does not separate"));

  response.set_relation(v1::RELATION_WITHIN_TOLERANCE);
  const TempFile tolerant("tolerant.json", Recorded(request, response));
  EXPECT_EQ(Run({"verify", tolerant.path()}).code, 6);

  response.set_relation(v1::RELATION_TOUCHING);
  response.mutable_hull_a()->set_store_id("another");
  response.mutable_hull_b()->set_store_id("another");
  const TempFile elsewhere("elsewhere.json", Recorded(request, response));
  ran = Run({"verify", elsewhere.path()});
  EXPECT_EQ(ran.code, 6);
  EXPECT_THAT(ran.err, HasSubstr("the server's store is not the one"));

  server::Appender appender(*hulls_, "cube", "w");
  ASSERT_TRUE(appender.Append(1, {9, 9, 9}).has_value());
  ran = Run({"verify", valid.path()});
  EXPECT_EQ(ran.code, 6);
  EXPECT_THAT(ran.err, AllOf(HasSubstr("cannot be checked"), HasSubstr("is at revision")));
  ASSERT_TRUE(Delete("cube").ok());
  ran = Run({"verify", valid.path()});
  EXPECT_EQ(ran.code, 6);
  EXPECT_THAT(ran.err, HasSubstr("was deleted"));
}

TEST_F(HullctlQueries, MotionsShowTheirFirstContact) {
  Put("cube", server::Cube());
  const std::vector<std::string> meets = {"check", "cube",   "cube",  "--pose-b",
                                          "3,0,0", "--to-b", "-1,0,0"};
  const auto with = [&](std::vector<std::string> more) {
    more.insert(more.begin(), meets.begin(), meets.end());
    return more;
  };
  Ran ran = Run(meets);
  EXPECT_EQ(ran.code, 0) << ran.err;
  EXPECT_THAT(ran.out, HasSubstr("relation         OVERLAPPING\n"));
  EXPECT_THAT(ran.out, HasSubstr("separated until  0.5\nfirst contact    0.5\n"));
  EXPECT_THAT(Run(with({"--verify"})).out, HasSubstr("verified         valid"));
  EXPECT_EQ(Run(with({"--output", "name"})).out, "OVERLAPPING\n");
  EXPECT_THAT(RunJson(meets).out,
              HasSubstr("\"firstContact\":{\"separatedUntil\":0.5,\"intervals\":[],"
                        "\"contactTime\":0.5}"));
  ran = Run(with({"--separation"}));
  EXPECT_EQ(ran.code, 2);
  EXPECT_THAT(ran.err,
              HasSubstr("--separation applies to a pose, but --to-a and --to-b define a motion"));

  ran = Run({"check", "cube", "cube", "--pose-b", "3,0,0", "--to-b", "2,0,0"});
  EXPECT_THAT(ran.out, HasSubstr("relation         SEPARATED\n"));
  EXPECT_THAT(ran.out, HasSubstr("separated until  1\n"));
  EXPECT_THAT(ran.out, Not(HasSubstr("first contact")));
}

TEST_F(HullctlQueries, MotionsTakeTheShorterPath) {
  Put("cube", server::Cube());
  const auto end_of = [this](const std::string& from, const std::string& to) {
    const Ran ran = Run({"check", "cube", "cube", "--pose-a", from, "--to-a", to, "--record", "-"});
    EXPECT_EQ(ran.code, 0) << ran.err;
    v1::CheckCollisionRequest request;
    EXPECT_TRUE(ParseMember(ran.out, "request", &request).ok());
    const v1::Quaternion& q = request.a().end_pose().rotation();
    return std::vector<double>{q.w(), q.x(), q.y(), q.z()};
  };
  using Numbers = std::vector<double>;
  EXPECT_EQ(end_of("1,0,0,0,0,0,0", "-1,0,0,1,0,0,0"), (Numbers{1, 0, 0, -1}));
  EXPECT_EQ(end_of("1,0,0,0,0,0,0", "1,0,0,-1,0,0,0"), (Numbers{1, 0, 0, -1}));
  EXPECT_EQ(end_of("1e200,0,0,-1e200,0,0,0", "1e200,0,0,2e200,0,0,0"),
            (Numbers{-1e200, 0, 0, -2e200}));
  // A translation alone keeps the rotation.
  EXPECT_EQ(end_of("3,0,0,4,0,0,0", "5,0,0"), (Numbers{3, 0, 0, 4}));
}

TEST_F(HullctlQueries, RecordedMotionsAreVerified) {
  Put("cube", server::Cube());
  const Ran recorded = Run({"check", "cube", "cube", "--pose-b", "3,0.25,0.5", "--to-b",
                            "1,0,0,1,-1,0,0", "--max-time-error", "0.001", "--record", "-"});
  ASSERT_EQ(recorded.code, 0) << recorded.err;
  const TempFile valid("motion.json", recorded.out);
  EXPECT_EQ(Run({"verify", valid.path()}).out, "OVERLAPPING: valid\n");
  v1::CheckCollisionRequest request;
  v1::CheckCollisionResponse response;
  ASSERT_TRUE(ParseMember(recorded.out, "request", &request).ok());
  ASSERT_TRUE(ParseMember(recorded.out, "response", &response).ok());
  request.mutable_b()->mutable_end_pose()->mutable_translation()->set_x(-2);
  const TempFile other("other.json", Recorded(request, response));
  EXPECT_EQ(Run({"verify", other.path()}).code, 5);
  response.clear_first_contact();
  const TempFile none("none.json", Recorded(request, response));
  const Ran ran = Run({"verify", none.path()});
  EXPECT_EQ(ran.code, 5);
  EXPECT_THAT(ran.err, HasSubstr("has no first contact"));
}

TEST_F(HullctlQueries, CastListsHitsInOrderOfTime) {
  Put("near/cube", server::Cube());
  Put("far/wall", {4, -1, -1, 4, 2, -1, 4, -1, 2, 4, 2, 2});
  Put("far/behind", {-9, 0, 0});
  Put("near/point", {3, 0.5, 0.5});
  const std::string origin = "-1,0.5,0.5";
  Ran ran = Run({"cast", origin, "8,0,0"});
  EXPECT_EQ(ran.code, 0) << ran.err;
  EXPECT_EQ(ran.out,
            "HULL        TIME   POINT      NORMAL\n"
            "near/cube   0.125  0 0.5 0.5  -1 0 0\n"
            "near/point  0.5    3 0.5 0.5  -1 0 0\n"
            "far/wall    0.625  4 0.5 0.5  -1 0 0\n");
  EXPECT_EQ(Run({"cast", origin, "4,0,0", "--output", "name"}).out, "near/cube\nnear/point\n");
  EXPECT_EQ(Run({"cast", origin, "8,0,0", "far/", "--output", "name"}).out, "far/wall\n");
  EXPECT_EQ(RunJson({"cast", origin, "8,0,0", "near/c"}).out,
            "{\"hullId\":\"near/cube\",\"time\":0.125,\"point\":[0,0.5,0.5],"
            "\"normal\":[-1,0,0]}\n");
  // A ray that starts in a hull meets no facet of it; one along an edge grazes it.
  EXPECT_THAT(Run({"cast", "0.5,0.5,0.5", "0,0,1", "near/c"}).out,
              HasSubstr("near/cube  0     0.5 0.5 0.5  -\n"));
  EXPECT_THAT(Run({"cast", "-1,1,1", "8,0,0", "near/c"}).out, HasSubstr("near/cube  0.125"));
  EXPECT_EQ(Run({"cast", "-1,1,1.0000000000000002", "8,0,0", "near/c", "--output", "name"}).out,
            "");
  EXPECT_EQ(Run({"cast", "1,2", "8,0,0"}).code, 2);
  ran = Run({"cast", "1e308,0,0", "1e308,0,0"});
  EXPECT_EQ(ran.code, 2);
  EXPECT_THAT(ran.err, HasSubstr("ORIGIN + DIRECTION exceeds the largest double"));
  EXPECT_EQ(Run({"cast", origin, "8,0,0", "none/"}).out, "HULL  TIME  POINT  NORMAL\n");
}

TEST_F(HullctlQueries, VerifyRefusesOtherFiles) {
  const TempFile no_json("no.json", "relation SEPARATED\n");
  EXPECT_EQ(Run({"verify", no_json.path()}).code, 2);
  const TempFile no_request("bare.json", MessageJson(v1::CheckCollisionResponse()));
  const Ran ran = Run({"verify", no_request.path()});
  EXPECT_EQ(ran.code, 2);
  EXPECT_THAT(ran.err, AllOf(HasSubstr("no member \"request\""), HasSubstr("--record")));
  EXPECT_EQ(Run({"verify", "/no/such/file"}).code, 2);
}

TEST_F(HullctlQueries, CheckVerifiesAtOnceAndRecordsForLater) {
  Put("cube", server::Cube());
  for (const char* pose : {"0.5,0,0", "1,0,0", "1,1,1", "3,0,0", "1,1,0,0,0,0,1"}) {
    const Ran ran = Run({"check", "cube", "cube", "--pose-b", pose, "--verify"});
    EXPECT_EQ(ran.code, 0) << ran.err;
    EXPECT_THAT(ran.out, HasSubstr("verified     valid\n"));
    const Ran recorded = Run({"check", "cube", "cube", "--pose-b", pose, "--record", "-"});
    const TempFile file("answer.json", recorded.out);
    EXPECT_EQ(Run({"verify", file.path()}).code, 0) << recorded.out;
    const TempFile beside("beside.json", "");
    const Ran both =
        RunJson({"check", "cube", "cube", "--pose-b", pose, "--record", beside.path()});
    EXPECT_EQ(Run({"verify", beside.path()}).code, 0);
    const auto answers = MessagesIn<v1::CheckCollisionResponse>(both.out);
    ASSERT_EQ(answers.size(), 1U);
    EXPECT_TRUE(answers[0].has_certificate());
  }
  for (const char* option : {"--verify", "--certificate"}) {
    const Ran json = RunJson({"check", "cube", "cube", option});
    EXPECT_EQ(MessagesIn<v1::CheckCollisionResponse>(json.out).size(), 1U) << option;
  }
}

// Hulls of every dimension on a lattice, rotated by quaternions with squared norms 1, 2, 3, and 5.
std::string LatticeScene(uint32_t seed, int placements) {
  std::mt19937 random(seed);
  std::uniform_int_distribution<int> steps(-3, 3);
  constexpr const char* kHulls[] = {"cube", "ball", "square", "needle", "point", "empty"};
  constexpr const char* kTurns[] = {"1, 0, 0, 0", "1, 1, 0, 0", "1, 0, 1, 1", "2, 0, 0, 1"};
  std::ostringstream text;
  text << "place:\n";
  for (int i = 0; i < placements; ++i) {
    text << "  p" << i << ": {id: " << kHulls[i % 6] << ", at: [" << kTurns[random() % 4];
    for (int axis = 0; axis < 3; ++axis) text << ", " << 0.5 * steps(random);
    text << "]}\n";
  }
  return text.str();
}

TEST_F(HullctlQueries, EveryCertificateOfABatchIsValid) {
  Put("cube", server::Cube());
  Put("ball", server::Sphere(40));
  Put("square", {0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0});
  Put("needle", {-1, -1, -1, 1, 1, 1});
  Put("point", {0.5, 0.5, 0});
  Create("empty");
  constexpr uint32_t kSeed = 11;
  const TempFile file("scene", LatticeScene(kSeed, 90));
  for (const char* method : {"--axis", "--textbook"}) {
    const Ran ran = Run({"batch", file.path(), "--verify", method});
    ASSERT_EQ(ran.code, 0) << "seed " << kSeed << ": " << ran.err;
    std::istringstream lines(ran.out);
    std::map<std::string, int> counts;
    for (std::string line; std::getline(lines, line) && line[0] != '#';) {
      EXPECT_THAT(line, testing::EndsWith("\tvalid"));
      std::istringstream words(line);
      std::string a, b, relation;
      words >> a >> b >> relation;
      ++counts[relation];
    }
    int total = 0;
    for (const char* relation : {"SEPARATED", "TOUCHING", "OVERLAPPING"}) {
      EXPECT_GT(counts[relation], 40) << relation;
      total += counts[relation];
    }
    EXPECT_EQ(total, 90 * 89 / 2);
    // Given as API messages, the answers are equal.
    const Ran json = RunJson({"batch", file.path(), "--verify", method});
    ASSERT_EQ(json.code, 0) << json.err;
    uint64_t next = 0;
    for (const auto& part : MessagesIn<v1::BatchCheckCollisionsResponse>(json.out)) {
      if (part.columns().relations_size() == 0) continue;
      EXPECT_EQ(part.first_pair(), next);
      next += static_cast<uint64_t>(part.columns().relations_size());
    }
    EXPECT_EQ(next, uint64_t{90 * 89 / 2});
  }
}

TEST_F(HullctlQueries, CertificatesOfCachedAnswersAreValid) {
  Put("cube", server::Cube(-0.5, 1));
  Put("ball", server::Sphere(80));
  ClientOptions options;
  options.server = server_->address();
  const Client client(options);
  const auto cube = client.GetHullMesh("cube");
  const auto ball = client.GetHullMesh("ball");
  ASSERT_TRUE(cube.ok() && ball.ok());
  v1::CollisionStreamOpen open;
  open.add_placements()->set_hull_id("cube");
  open.add_placements()->set_hull_id("ball");
  open.add_pairs(0);
  open.add_pairs(1);
  open.mutable_wanted()->set_certificate(true);
  const auto stream = client.OpenCollisionStream();
  ASSERT_TRUE(stream->Open(open).ok());
  int cached = 0;
  for (int step = 0; step <= 400; ++step) {
    v1::Pose pose;
    pose.mutable_rotation()->set_w(1);
    pose.mutable_rotation()->set_z(0.001 * step);
    pose.mutable_translation()->set_x(0.01 * (step - 200));
    v1::CollisionStreamUpdate update;
    update.add_placements(1);
    for (const double number : {1.0, 0.0, 0.0, 0.001 * step, 0.01 * (step - 200), 0.0, 0.0}) {
      update.add_poses(number);
    }
    const auto answer = stream->Update(update);
    ASSERT_TRUE(answer.ok()) << answer.status().ToString();
    ASSERT_EQ(answer->columns().certificates_size(), 1);
    const absl::Status valid =
        CheckCertificate(answer->columns().relations(0), answer->columns().certificates(0),
                         {cube->xyz, v1::Pose()}, {ball->xyz, pose});
    ASSERT_TRUE(valid.ok()) << "step " << step << ": " << valid.ToString();
    cached += answer->columns().rungs(0) == v1::RUNG_CACHED ? 1 : 0;
  }
  EXPECT_GT(cached, 50);
  EXPECT_TRUE(stream->Close().ok());
}

TEST_F(HullctlQueries, SceneFindsCollisions) {
  Put("cube", server::Cube());
  const std::string placements =
      R"({"placements":[{"hullId":"cube"},{"hullId":"cube","pose":{"translation":{"x":1}}},
          {"hullId":"cube","pose":{"translation":{"x":2.25}}}])";
  const TempFile file("scene.json", placements + "}");
  Ran ran = Run({"scene", file.path()});
  EXPECT_EQ(ran.code, 0) << ran.err;
  EXPECT_EQ(ran.out, "0:cube\t1:cube\tTOUCHING\n# touching 1 overlapping 0 failed 0\n");
  ran = Run({"scene", file.path(), "--output", "json"});
  EXPECT_EQ(ran.code, 0) << ran.err;
  v1::FindCollisionsResponse all;
  for (const auto& part : MessagesIn<v1::FindCollisionsResponse>(ran.out)) all.MergeFrom(part);
  EXPECT_THAT(all.pairs(), testing::ElementsAre(0, 1));
  EXPECT_EQ(all.totals().touching(), 1U);
  const TempFile clear("clear.json", placements + R"(,"wanted":{"clearance":0.25}})");
  ran = Run({"scene", clear.path()});
  EXPECT_EQ(ran.code, 0) << ran.err;
  EXPECT_EQ(ran.out,
            "0:cube\t1:cube\tTOUCHING\twithin\n1:cube\t2:cube\tSEPARATED\twithin\n"
            "# touching 1 overlapping 0 separated 1 failed 0\n");
  const TempFile packed("packed.json",
                        R"({"packedPlacements":{"hullIds":["cube"],"hulls":[0,0],
                            "poses":[1,0,0,0, 0,0,0,  1,0,0,0, 1,0,0]}})");
  ran = Run({"scene", packed.path()});
  EXPECT_EQ(ran.code, 0) << ran.err;
  EXPECT_EQ(ran.out, "0:cube\t1:cube\tTOUCHING\n# touching 1 overlapping 0 failed 0\n");
  const TempFile typo("typo.json", R"({"placement":[]})");
  ran = Run({"scene", typo.path()});
  EXPECT_EQ(ran.code, 2);
  EXPECT_THAT(ran.err, HasSubstr("placement"));
  const TempFile groups("groups.json", placements + R"(,"groups":[1]})");
  ran = Run({"scene", groups.path()});
  EXPECT_EQ(ran.code, 1);
  EXPECT_THAT(ran.err, HasSubstr("groups has 1 groups for 3 placements"));
  const TempFile lost("lost.json", R"({"placements":[{"hullId":"nope"}]})");
  ran = Run({"scene", lost.path()});
  EXPECT_EQ(ran.code, 4);
  EXPECT_THAT(ran.err, HasSubstr("placement 0:nope: hull \"nope\" not found"));
}

TEST_F(HullctlQueries, StreamAnswersEachLineWithALine) {
  Put("cube", server::Cube());
  const TempFile file("poses.jsonl",
                      R"({"placements":[{"hullId":"cube"},{"hullId":"cube"}],"pairs":[0,1]})"
                      "\n\n"
                      R"({"placements":[1],"poses":[1,0,0,0,1,0,0]})"
                      "\n"
                      R"({"placements":[1],"poses":[2,0,0,0,1.5,0,0],"refreshHulls":true})"
                      "\n");
  Ran ran = Run({"stream", file.path()});
  EXPECT_EQ(ran.code, 0) << ran.err;
  EXPECT_EQ(ran.out,
            "0\t0:cube\t1:cube\tOVERLAPPING\n1\t0:cube\t1:cube\tTOUCHING\n"
            "2\t0:cube\t1:cube\tSEPARATED\n");
  ran = RunJson({"stream", file.path()});
  EXPECT_EQ(ran.code, 0) << ran.err;
  const auto answers = MessagesIn<v1::StreamCollisionsResponse>(ran.out);
  ASSERT_EQ(answers.size(), 3U);
  for (size_t i = 0; i < answers.size(); ++i) {
    EXPECT_EQ(answers[i].update(), i);
    EXPECT_TRUE(answers[i].last());
    EXPECT_THAT(answers[i].pairs(), testing::ElementsAre(0));
  }
  EXPECT_EQ(answers[2].columns().relations(0), v1::RELATION_SEPARATED);
}

TEST_F(HullctlQueries, EachCommandAcceptsEachSceneFormat) {
  Put("cube", server::Cube());
  const TempFile yaml("yaml",
                      "place:\n  a: {id: cube}\n  b: {id: cube, at: [1, 0, 0]}\n"
                      "  c: {id: cube, at: [1.5, 0, 0]}\n");
  const TempFile flow("flow", R"({"place": {"a": {"id": "cube"},
      "b": {"id": "cube", "at": [1, 0, 0]}, "c": {"id": "cube", "at": [1.5, 0, 0]}}})");
  const TempFile json("json", R"({"placements":[{"hullId":"cube"},
      {"hullId":"cube","pose":{"translation":{"x":1}}},
      {"hullId":"cube","pose":{"translation":{"x":1.5}}}]})");
  const TempFile packed("packed", R"({"packedPlacements":{"hullIds":["cube"],"hulls":[0,0,0],
      "poses":[1,0,0,0,0,0,0, 1,0,0,0,1,0,0, 1,0,0,0,1.5,0,0]}})");
  for (const TempFile* file : {&yaml, &flow, &json, &packed}) {
    Ran ran = Run({"batch", file->path(), "--verify"});
    EXPECT_EQ(ran.code, 0) << ran.err;
    EXPECT_THAT(ran.out, HasSubstr("# separated 1 touching 1 overlapping 1 failed 0\n"));
    EXPECT_EQ(RunJson({"batch", file->path(), "--verify"}).code, 0);
    ran = Run({"scene", file->path()});
    EXPECT_EQ(ran.code, 0) << ran.err;
    EXPECT_THAT(ran.out, HasSubstr("# touching 1 overlapping 1 failed 0\n"));
    ran = Run({"stream", file->path(), "--output", "name"});
    EXPECT_EQ(ran.code, 0) << ran.err;
    EXPECT_EQ(std::count(ran.out.begin(), ran.out.end(), '\n'), 3);
  }
  const TempFile pairs("pairs", "place: {a: {id: cube}, b: {id: cube}}\nask: {pairs: [[a, b]]}\n");
  const Ran ran = Run({"scene", pairs.path()});
  EXPECT_EQ(ran.code, 2);
  EXPECT_THAT(ran.err, HasSubstr("finds pairs itself, but the file names pairs"));
}

TEST_F(HullctlQueries, StreamErrorsNameTheLineOrTheField) {
  Put("cube", server::Cube());
  const std::string open = R"({"placements":[{"hullId":"cube"},{"hullId":"nope"}],"pairs":[0,1]})"
                           "\n";
  const TempFile typo("typo.jsonl", open + "{\"placement\":[1]}\n");
  Ran ran = Run({"stream", typo.path()});
  EXPECT_EQ(ran.code, 2);
  EXPECT_THAT(ran.err, AllOf(HasSubstr(":2: "), HasSubstr("placement")));
  EXPECT_THAT(ran.out, HasSubstr("FAILED\thull \"nope\" not found\n"));
  const TempFile range("range.jsonl", open + R"({"placements":[7],"poses":[1,0,0,0,1,0,0]})");
  ran = Run({"stream", range.path()});
  EXPECT_EQ(ran.code, 1);
  EXPECT_THAT(ran.err, HasSubstr("update 1: placements[0] is 7"));
  const TempFile empty("empty.jsonl", "\n");
  ran = Run({"stream", empty.path()});
  EXPECT_EQ(ran.code, 2);
  EXPECT_THAT(ran.err, HasSubstr("contains no scene"));
}

TEST_F(HullctlQueries, AMissingFileIsReportedAlongWithTheMissingHull) {
  Put("cube", server::Cube());
  for (const char* name : {"part.stl", "part"}) {
    const Ran ran = Run({"check", name, "cube"});
    EXPECT_EQ(ran.code, 1);
    EXPECT_EQ(ran.err, std::string("hullctl: hull \"") + name + "\" not found" +
                           (std::string(name) == "part" ? "" : ", and no such file") +
                           " (see 'hullctl list')\n");
  }
  const std::string step = "hulld_" + std::to_string(getpid()) + ".step";
  std::ofstream(step) << "ISO-10303-21;\n";
  const Ran ran = Run({"check", step, "cube"});
  std::filesystem::remove(step);
  EXPECT_THAT(ran.err, HasSubstr("\" not found; " + step + ": unknown file extension; convert"));
}

TEST_F(HullctlQueries, AMeshIsNotWrittenUnderTheNameOfAnotherFormat) {
  Put("cube", server::Cube());
  const std::string file = testing::TempDir() + "hulld_mesh.stl";
  const Ran ran = Run({"mesh", "cube", "-o", file});
  EXPECT_EQ(ran.code, 2);
  EXPECT_THAT(ran.err, HasSubstr("meshes are written as OBJ; choose a name that ends in .obj"));
  EXPECT_FALSE(std::filesystem::exists(file));
}

TEST_F(HullctlQueries, ConflictingOptionsAreExplained) {
  Put("cube", server::Cube());
  const auto usage = [this](std::vector<std::string> options, const std::string& problem) {
    options.insert(options.begin(), {"check", "cube", "cube"});
    const Ran ran = Run(options);
    EXPECT_EQ(ran.code, 2) << ran.err;
    EXPECT_THAT(ran.err, HasSubstr(problem));
  };
  usage({"--tolerance", "0.1", "--separation"},
        "--separation needs the exact relation; remove it or --tolerance");
  usage({"--tolerance", "0.1", "--verify"}, "--verify needs the exact relation");
  usage({"--to-b", "1,0,0", "--normal"},
        "--normal applies to a pose, but --to-a and --to-b define");
  usage({"--to-a", "1,0,0", "--max-error", "1"}, "--max-error applies to a pose");
  usage({"--max-time-error", "0.1"}, "--max-time-error applies to a motion; add --to-a or --to-b");
  usage({"--resolution", "0.1"}, "--resolution applies to a motion");
  usage({"--textbook", "--radius-b", "1"}, "--textbook does not support radii; remove it or --rad");
  EXPECT_EQ(Run({"check", "cube", "cube", "--tolerance", "0", "--separation"}).code, 0);
  Ran ran = Run({"check", "cube", "cube", "--tolerance", "-1"});
  EXPECT_EQ(ran.code, 2);
  EXPECT_THAT(ran.err, HasSubstr("--tolerance: \"-1\" is not a length of at least 0"));
  for (const char* option : {"--clearance", "--max-error"}) {
    EXPECT_EQ(Run({"check", "cube", "cube", option, "nan"}).code, 2);
    EXPECT_EQ(Run({"check", "cube", "cube", option, "1e999"}).code, 2);
  }
}

TEST_F(HullctlQueries, LoadReportsEveryModeAndLeavesNoHullBehind) {
  Put("cube", server::Cube());
  for (const char* mode : {"check", "batch", "append", "mixed"}) {
    const Ran ran = Run({"bench", "load", "--mode", mode, "--clients", "2", "--requests", "30",
                         "--pairs", "50", "--points", "40", "--hulls", "3", "--vertices", "20"});
    EXPECT_EQ(ran.code, 0) << mode << ": " << ran.err;
    EXPECT_THAT(ran.out, AllOf(HasSubstr("30, of which 0 failed"), HasSubstr("latency p99.9"),
                               HasSubstr("requests/s"), HasSubstr("#")))
        << mode;
    EXPECT_EQ(ran.err, "") << mode;
  }
  EXPECT_EQ(Run({"list"}).out, Run({"list", "cube"}).out);
}

TEST_F(HullctlQueries, LoadCountsItemsInJson) {
  const Ran ran = Run({"bench", "load", "--mode", "batch", "--requests", "5", "--pairs", "70",
                       "--rate", "1000", "--json"});
  EXPECT_EQ(ran.code, 0) << ran.err;
  Struct json;
  ASSERT_TRUE(google::protobuf::util::JsonStringToMessage(ran.out, &json).ok()) << ran.out;
  const auto& fields = json.fields();
  EXPECT_EQ(fields.at("mode").string_value(), "batch");
  EXPECT_EQ(fields.at("succeeded").string_value(), "5");
  EXPECT_EQ(fields.at("failed").string_value(), "0");
  EXPECT_EQ(fields.at("ratePerSecond").number_value(), 1000);
  EXPECT_FALSE(fields.at("interrupted").bool_value());
  EXPECT_NEAR(fields.at("itemsPerSecond").number_value(),
              70 * fields.at("requestsPerSecond").number_value(), 1e-6);
  const auto& latency = fields.at("latencySeconds").struct_value().fields();
  EXPECT_LE(latency.at("p50").number_value(), latency.at("p99.9").number_value());
  EXPECT_LE(latency.at("p99.9").number_value(), latency.at("max").number_value());
  double counted = 0;
  for (const auto& row : fields.at("histogram").list_value().values()) {
    counted += std::stod(row.struct_value().fields().at("count").string_value());
  }
  EXPECT_EQ(counted, 5);
}

TEST_F(HullctlQueries, LoadRefusesAPrefixThatIsInUse) {
  Put("mine/cube", server::Cube());
  const Ran ran = Run({"bench", "load", "--requests", "1", "--prefix", "mine"});
  EXPECT_EQ(ran.code, 1);
  EXPECT_THAT(ran.err, AllOf(HasSubstr("\"mine/cube\" already exists"), HasSubstr("--prefix")));
  EXPECT_EQ(Get("mine/cube").hull().vertex_count(), 8U);
}

TEST_F(HullctlQueries, LoadShowsErrorsByCode) {
  const Ran ran = Run({"bench", "load", "--mode", "append", "--requests", "2", "--timeout", "5s",
                       "--prefix", "a b"});
  EXPECT_EQ(ran.code, 1);
  EXPECT_THAT(ran.out, AllOf(HasSubstr("2, of which 2 failed"), HasSubstr("INVALID_ARGUMENT"),
                             HasSubstr("malformed")));
}

// The signal is sent after hulls of the load exist; the load itself would take minutes.
TEST_F(HullctlQueries, AnInterruptedLoadReportsAndDeletesItsHulls) {
  std::thread interrupter([this] {
    v1::ListHullsRequest request;
    request.set_prefix("short/append-");
    v1::ListHullsResponse response;
    while (response.hulls_size() == 0) {
      grpc::ClientContext context;
      if (!hulls_->ListHulls(&context, request, &response).ok()) break;
    }
    kill(getpid(), SIGINT);
  });
  const Ran ran = Run({"bench", "load", "--mode", "append", "--duration", "5m", "--points", "10",
                       "--prefix", "short/"});
  interrupter.join();
  EXPECT_EQ(ran.code, 0) << ran.err;
  EXPECT_THAT(ran.err, HasSubstr("interrupted; deleted the hulls of the load test"));
  EXPECT_THAT(ran.out, HasSubstr("requests/s"));
  v1::ListHullsResponse left;
  grpc::ClientContext context;
  ASSERT_TRUE(hulls_->ListHulls(&context, v1::ListHullsRequest(), &left).ok());
  EXPECT_EQ(left.hulls_size(), 0);
}

TEST_F(HullctlQueries, NonsensicalLoadOptionsAreExplained) {
  Ran ran = Run({"bench", "load", "--rate", "0"});
  EXPECT_EQ(ran.code, 2);
  EXPECT_THAT(ran.err, HasSubstr("--rate: \"0\" is not a number of requests per second"));
  ran = Run({"bench", "load", "--clients", "0"});
  EXPECT_EQ(ran.code, 2);
  EXPECT_THAT(ran.err, HasSubstr("whole number from 1 to 1000"));
  EXPECT_EQ(Run({"bench", "load", "--mode", "storm"}).code, 2);
  EXPECT_EQ(Run({"bench", "load", "--duration", "soon"}).code, 2);
  EXPECT_EQ(Run({"bench"}).code, 2);
}

}  // namespace hullctl_server_test
}  // namespace hulld
