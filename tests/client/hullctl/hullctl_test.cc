// hullctl's commands, run within the test against a fake server.
#include <gmock/gmock.h>
#include <google/protobuf/struct.pb.h>
#include <google/protobuf/util/json_util.h>
#include <gtest/gtest.h>

#include <sstream>

#include "client/hullctl/printing/json.h"
#include "tests/client/fake_hulld.h"
#include "tests/client/formats/point_reading.h"
#include "tests/client/hullctl/hullctl_on_server.h"

namespace hulld {
namespace hullctl_test {

using google::protobuf::Struct;
using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::StartsWith;

// Returns the output as JSON; if malformed, fails the test and returns an empty object.
Struct Json(const Ran& ran) {
  Struct json;
  const auto status = google::protobuf::util::JsonStringToMessage(ran.out, &json);
  EXPECT_TRUE(status.ok()) << status.ToString() << "\n" << ran.out;
  return json;
}

class HullctlTest : public testing::Test {
 protected:
  Ran Run(std::vector<std::string> arguments) {
    arguments.insert(arguments.end(), {"--server", fake_.address()});
    return RunTool(arguments);
  }
  Ran RunJson(std::vector<std::string> arguments) {
    arguments.insert(arguments.end(), {"--output", "json"});
    return Run(arguments);
  }

  FakeHulld fake_;
};

TEST_F(HullctlTest, CreateGetListAndDelete) {
  EXPECT_EQ(Run({"create", "a/1"}).out, "a/1 created at revision 1\n");
  EXPECT_EQ(Run({"create", "a/1", "--if-absent"}).out, "a/1 already exists at revision 1\n");
  EXPECT_THAT(Run({"get", "a/1"}).out, HasSubstr("vertices    0\n"));
  EXPECT_THAT(Run({"list", "a"}).out, AllOf(StartsWith("HULL"), HasSubstr("\na/1 ")));
  const Ran wrong = Run({"delete", "a/1", "--if-revision", "9"});
  EXPECT_EQ(wrong.code, 1);
  EXPECT_THAT(wrong.err, HasSubstr("'hullctl get' shows the current revision"));
  EXPECT_EQ(Run({"delete", "a/1", "--if-revision", "1"}).code, 0);
  EXPECT_EQ(fake_.hull("a/1").create_revision, 0u);
}

TEST_F(HullctlTest, ErrorsNameARemedy) {
  const Ran missing = Run({"get", "x"});
  EXPECT_EQ(missing.code, 1);
  EXPECT_EQ(missing.err, "hullctl: hull \"x\" not found (see 'hullctl list')\n");
  const Ran unreachable = RunTool({"list", "--server", "127.0.0.1:1"});
  EXPECT_EQ(unreachable.code, 3);
  EXPECT_THAT(unreachable.err, StartsWith("hullctl: cannot reach hulld at 127.0.0.1:1; start it "
                                          "with 'hulld', or choose another with --server"));
  fake_.Hang("GetHull");
  const Ran late = Run({"get", "x", "--timeout", "50ms"});
  EXPECT_EQ(late.code, 3);
  EXPECT_THAT(late.err, HasSubstr("within 50 ms; raise --timeout"));
  fake_.FailNext("CreateHull", {HulldError(grpc::StatusCode::UNAVAILABLE, "draining",
                                           v1::ERROR_REASON_DRAINING)});
  const Ran draining = Run({"create", "x"});
  EXPECT_EQ(draining.code, 3);
  EXPECT_THAT(draining.err, HasSubstr("is unavailable: draining; try again later"));
  // The message text does not distinguish errors of gRPC from errors of hulld.
  fake_.FailNext("CreateHull", {HulldError(grpc::StatusCode::UNAVAILABLE, "cannot connect the disk",
                                           v1::ERROR_REASON_STORE_UNAVAILABLE)});
  EXPECT_THAT(Run({"create", "x"}).err, HasSubstr("is unavailable: cannot connect the disk"));
  fake_.FailNext("CreateHull", {{grpc::StatusCode::UNAVAILABLE, "no route"}});
  EXPECT_THAT(Run({"create", "x"}).err, StartsWith("hullctl: cannot reach hulld at "));
  fake_.FailNext("CreateHull", {HulldError(grpc::StatusCode::RESOURCE_EXHAUSTED, "many hulls",
                                           v1::ERROR_REASON_LIMIT_EXCEEDED)});
  EXPECT_EQ(Run({"create", "x"}).err, "hullctl: many hulls\n");
  fake_.FailNext("CreateHull", {{grpc::StatusCode::RESOURCE_EXHAUSTED, "too large"}});
  EXPECT_THAT(Run({"create", "x"}).err, HasSubstr("--max-message-bytes"));
}

TEST_F(HullctlTest, MistakesOnTheCommandLineExitWithTwo) {
  const std::vector<std::vector<std::string>> mistakes = {
      {},
      {"fly"},
      {"create"},
      {"create", "a", "b"},
      {"get", "a", "--output", "xml"},
      {"get", "a", "--timeout", "soon"},
      {"get", "a", "--server", "here"},
      {"check", "a", "b", "--pose-a", "1,2"},
      {"generate", "ball", "many"},
      {"generate", "blob", "3"},
      {"generate", "ball", "3", "--radius", "-1"},
      {"generate", "cube", "3", "--size", "1e308", "--center", "1.7e308,0,0"},
      {"append", "a", "no-such-file.xyz"},
      {"append", "a", "CMakeLists.unknown"},
      {"append", "a", "-", "--chunk-points", "0"},
      {"append", "a", "-", "--resume"},
      {"batch", "no-such-file"},
      {"delete", "a", "--if-revision", "-1"},
  };
  for (const auto& arguments : mistakes) {
    const Ran ran = RunTool(arguments);
    EXPECT_EQ(ran.code, 2) << testing::PrintToString(arguments);
    EXPECT_NE(ran.err, "") << testing::PrintToString(arguments);
    EXPECT_EQ(ran.out, "");
  }
}

// No message can contain them: protobuf printed an error, and the server refused the call.
TEST_F(HullctlTest, IdsMustBeUtf8) {
  for (const std::vector<std::string>& arguments :
       std::vector<std::vector<std::string>>{{"get", "caf\xE9"},
                                             {"create", "caf\xE9"},
                                             {"delete", "a", "caf\xE9"},
                                             {"list", "caf\xE9"},
                                             {"check", "a", "caf\xE9"},
                                             {"body", "put", "b", "caf\xE9"}}) {
    const Ran ran = Run(arguments);
    EXPECT_EQ(ran.code, 2) << testing::PrintToString(arguments);
    EXPECT_THAT(ran.err, HasSubstr("\"caf?\" is not UTF-8\n")) << testing::PrintToString(arguments);
  }
  const TempFile file("caf\xE9.xyz", "0 0 0\n");
  EXPECT_EQ(Run({"append", "a", file.path(), "--create"}).code, 0);
}

TEST_F(HullctlTest, AMistypedWordGetsASuggestion) {
  const auto error = [](const std::vector<std::string>& arguments) {
    const Ran ran = RunTool(arguments);
    EXPECT_EQ(ran.code, 2);
    EXPECT_EQ(ran.out, "");
    return ran.err.substr(0, ran.err.find('\n'));
  };
  EXPECT_EQ(error({"chek", "a", "b"}),
            "hullctl: 'hullctl' has no command \"chek\"; did you mean \"check\"?");
  EXPECT_EQ(error({"chekc", "a", "b"}),
            "hullctl: 'hullctl' has no command \"chekc\"; did you mean \"check\"?");
  EXPECT_EQ(error({"--output", "json", "del", "a", "--verify"}),
            "hullctl: 'hullctl' has no command \"del\"; did you mean \"delete\"?");
  EXPECT_EQ(error({"del", "a"}),
            "hullctl: 'hullctl' has no command \"del\"; did you mean \"delete\"?");
  EXPECT_EQ(error({"help", "del"}),
            "hullctl: 'hullctl' has no command \"del\"; did you mean \"delete\"?");
  EXPECT_EQ(error({"backup", "sav", "f"}),
            "hullctl: 'hullctl backup' has no command \"sav\"; did you mean \"save\"?");
  EXPECT_EQ(error({"backup", "x"}),
            "hullctl: 'hullctl backup' has no command \"x\"; commands: save, restore");
  EXPECT_EQ(error({"fly"}), "hullctl: 'hullctl' has no command \"fly\"");
  EXPECT_EQ(error({}), "hullctl: no command given; usage: hullctl COMMAND [OPTIONS]");
  EXPECT_EQ(error({"backup"}),
            "hullctl: no command given; usage: hullctl backup COMMAND [OPTIONS]");
  EXPECT_EQ(error({"check", "a"}),
            "hullctl: B is required: 'hullctl check A B', or 'hullctl check A --points FILE'");
  EXPECT_EQ(error({"create", "a", "b"}),
            "hullctl: unexpected argument \"b\"; usage: hullctl create ID [OPTIONS]");
  EXPECT_EQ(error({"scene", "chek", "a"}),
            "hullctl: unexpected argument \"a\"; commands: apply, diff, delete, check; usage: "
            "hullctl scene [COMMAND] [FILE] [OPTIONS]");
  EXPECT_EQ(error({"check", "a", "b", "--verfy"}),
            "hullctl: 'hullctl check' has no option \"--verfy\"; did you mean \"--verify\"?");
  EXPECT_EQ(error({"list", "--servr=x:1"}),
            "hullctl: 'hullctl list' has no option \"--servr\"; did you mean \"--server\"?");
  EXPECT_EQ(error({"list", "--output", "jsn"}),
            "hullctl: --output: \"jsn\" is not one of table, wide, name, json; did you mean "
            "\"json\"?");
  EXPECT_EQ(error({"list", "--limit"}), "hullctl: --limit needs a value: --limit N");
  EXPECT_EQ(error({"list", "--limit=", "3"}),
            "hullctl: --limit: \"\" is not a whole number from 1 to 1000000000");
  EXPECT_EQ(error({"list", "--limit", "1", "--limit", "2"}),
            "hullctl: --limit may be given only once");
  EXPECT_EQ(error({"create", "--", "a", "--if-absent"}),
            "hullctl: unexpected argument \"--if-absent\"; usage: hullctl create ID [OPTIONS]");
  EXPECT_EQ(error({"create", "--", "\xff"}), "hullctl: ID: \"?\" is not UTF-8");
}

TEST_F(HullctlTest, HelpGroupsCommandsByTaskAndEachHasExamples) {
  const std::string help = RunTool({"--help"}).out;
  size_t at = 0;
  for (const char* word : {"\nBuild hulls:\n", "\n  append ", "\nInspect hulls:\n", "\n  list ",
                           "\nCheck for collision:\n", "\n  check ", "\nRun a server:\n",
                           "\n  status ", "\nWork with hullctl:\n", "\n  context ",
                           "\nOptions of every command:\n", "\nExit codes:\n", "\nExamples:\n"}) {
    const size_t found = help.find(word, at);
    ASSERT_NE(found, std::string::npos) << word;
    at = found;
  }
  EXPECT_THAT(help, testing::Not(HasSubstr("__")));
  for (const char* command :
       {"create",      "append",      "replace",        "delete",     "list",
        "get",         "mesh",        "check",          "batch",      "scene",
        "stream",      "verify",      "status",         "bench load", "generate",
        "completion",  "backup save", "backup restore", "token new",  "context add",
        "context use", "robot check", "robot acm",      "cover",      "scene apply",
        "scene check", "scene diff",  "scene delete",   "cast"}) {
    std::vector<std::string> words = {"help"};
    std::istringstream names(command);
    for (std::string word; names >> word;) words.push_back(word);
    const std::string text = RunTool(words).out;
    EXPECT_THAT(text, HasSubstr(std::string("Usage: hullctl ") + command)) << command;
    EXPECT_THAT(text, HasSubstr("\nExamples:\n")) << command;
    std::istringstream lines(text);
    for (std::string line; std::getline(lines, line);) {
      EXPECT_LE(line.size(), 100U) << command << ": " << line;
    }
  }
}

TEST_F(HullctlTest, TheUsageOfCoverEndsWithItsFile) {
  const std::string help = RunTool({"cover", "--help"}).out;
  EXPECT_THAT(help, HasSubstr("Usage: hullctl cover ID... FILE [OPTIONS]\n"));
  EXPECT_THAT(help, HasSubstr("\n  ID... FILE  IDs of hulls or bodies, then the mesh"));
}

TEST_F(HullctlTest, HelpAndVersionExitWithZero) {
  const Ran help = RunTool({"--help"});
  EXPECT_EQ(help.code, 0);
  for (const char* word :
       {"create", "append", "get", "list", "delete", "mesh", "check", "batch", "scene", "stream",
        "verify", "generate", "status", "HULLCTL_SERVER", "Exit codes"}) {
    EXPECT_THAT(help.out, HasSubstr(word));
  }
  EXPECT_THAT(RunTool({"--version"}).out, StartsWith("hullctl "));
  EXPECT_THAT(RunTool({"batch", "--help"}).out, HasSubstr("right: {id: box, at: [2, 0, 0]}"));
}

TEST_F(HullctlTest, AppendSendsFilesInChunks) {
  const TempFile first("one.xyz", "1 2 3\n4 5 6\n7 8 9\n");
  const TempFile second("two.obj", "v 0.1 1e-310 -0\n");
  const Ran missing = Run({"append", "a", first.path()});
  EXPECT_EQ(missing.code, 1);
  EXPECT_THAT(missing.err, HasSubstr("--create"));
  const Ran ran =
      Run({"append", "a", first.path(), second.path(), "--create", "--chunk-points", "2"});
  EXPECT_EQ(ran.code, 0) << ran.err;
  EXPECT_THAT(ran.out, HasSubstr("points     4 appended in 3 chunks\n"));
  EXPECT_THAT(fake_.hull("a").xyz, ElementsAre(1, 2, 3, 4, 5, 6, 7, 8, 9, 0.1, 1e-310, -0.0));
}

TEST_F(HullctlTest, AppendCountsSkippedPoints) {
  const TempFile file("a.csv", "x,y,z\n1,2,3\nnan,0,0\n0,inf,0\n4,5,6\n");
  const Ran strict = Run({"append", "a", "--create", file.path()});
  EXPECT_EQ(strict.code, 2);
  EXPECT_THAT(strict.err,
              HasSubstr(".csv:3: point 2 has x = NaN; skip such points with --skip-nonfinite"));
  const Ran ran = Run({"append", "b", "--create", "--skip-nonfinite", file.path()});
  EXPECT_EQ(ran.code, 0) << ran.err;
  EXPECT_THAT(ran.out, HasSubstr("skipped    2 points with NaN or infinity\n"));
  EXPECT_THAT(fake_.hull("b").xyz, ElementsAre(1, 2, 3, 4, 5, 6));
}

TEST_F(HullctlTest, AppendAndReplaceCountPointsAtZero) {
  const TempFile file("a.xyz", "0 0 0\n1 2 3\n0 0 0\nnan 0 0\n4 5 6\n");
  Ran ran = Run({"append", "a", "--create", "--skip-zero", "--skip-nonfinite", file.path()});
  EXPECT_EQ(ran.code, 0) << ran.err;
  EXPECT_THAT(ran.out, HasSubstr("skipped    1 point with NaN or infinity\n"
                                 "skipped    2 points at (0, 0, 0)\n"));
  EXPECT_THAT(fake_.hull("a").xyz, ElementsAre(1, 2, 3, 4, 5, 6));
  ran = Run({"append", "b", "--create", "--skip-zero", "--skip-nonfinite", file.path(), "--output",
             "name"});
  EXPECT_EQ(ran.out, "b\n");
  EXPECT_THAT(ran.err, HasSubstr("hullctl: 2 points at (0, 0, 0) were skipped\n"));
}

TEST_F(HullctlTest, AnErrorInAFileLeavesTheChunksBeforeIt) {
  const TempFile file("a.csv", "1,2,3\n4,5,6\n7,abc,9\n");
  const Ran ran = Run({"append", "a", "--create", "--chunk-points", "1", file.path()});
  EXPECT_EQ(ran.code, 2);
  EXPECT_THAT(ran.err, HasSubstr("a.csv:3: \"abc\" is not a number"));
  EXPECT_THAT(ran.out, HasSubstr("2 appended in 2 chunks"));
  EXPECT_THAT(fake_.hull("a").xyz, ElementsAre(1, 2, 3, 4, 5, 6));
}

TEST_F(HullctlTest, AppendResumesWhereTheWriterStopped) {
  const TempFile file("a.xyz", "1 1 1\n2 2 2\n3 3 3\n");
  StreamScript script;
  script.refuse_sequence = 3;
  fake_.ScriptStreams({script});
  const std::vector<std::string> command = {"append",         "a", "--create", "--writer", "w",
                                            "--chunk-points", "1", file.path()};
  EXPECT_EQ(Run(command).code, 1);
  std::vector<std::string> again = command;
  again.push_back("--resume");
  const Ran resumed = Run(again);
  EXPECT_EQ(resumed.code, 0) << resumed.err;
  EXPECT_THAT(resumed.out, HasSubstr("2 points already committed"));
  EXPECT_THAT(fake_.hull("a").xyz, ElementsAre(1, 1, 1, 2, 2, 2, 3, 3, 3));
}

TEST_F(HullctlTest, CheckForwardsPosesAndOptions) {
  fake_.collision_answer.set_relation(v1::RELATION_SEPARATED);
  fake_.collision_answer.mutable_hull_a()->set_hull_id("a");
  fake_.collision_answer.mutable_axis()->set_kind(v1::AXIS_KIND_FACET_B);
  fake_.collision_answer.mutable_axis()->mutable_direction()->set_x(1);
  fake_.collision_answer.mutable_analysis()->set_axes_tested(17);
  fake_.collision_answer.mutable_analysis()->set_axes_total(99);
  fake_.collision_answer.mutable_analysis()->set_axis_index(16);
  fake_.collision_answer.mutable_analysis()->set_stage(v1::AXIS_KIND_EDGE_EDGE);
  fake_.collision_answer.mutable_analysis()->mutable_time()->set_nanos(1500000);
  fake_.collision_answer.mutable_analysis()->mutable_size_b()->set_edges(12);
  const Ran ran = Run({"check", "a", "b", "--pose-a", "-1,0,0", "--pose-b", "2,1,0,0,5,6,7",
                       "--textbook", "--axis", "--report"});
  EXPECT_EQ(ran.code, 0) << ran.err;
  const v1::CheckCollisionRequest request = fake_.last_collision_request();
  EXPECT_EQ(request.a().hull_id(), "a");
  EXPECT_EQ(request.a().pose().translation().x(), -1);
  EXPECT_EQ(request.b().pose().rotation().w(), 2);
  EXPECT_EQ(request.method(), v1::METHOD_TEXTBOOK_SAT);
  EXPECT_TRUE(request.wanted().axis());
  EXPECT_TRUE(request.wanted().analysis());
  EXPECT_THAT(ran.out, AllOf(HasSubstr("relation     SEPARATED\n"), HasSubstr("1 0 0  (FACET_B)"),
                             HasSubstr("1.5 ms"), HasSubstr("17 of 99"),
                             HasSubstr("EDGE_EDGE, axis 16"), HasSubstr("12 edges")));
}

TEST_F(HullctlTest, CheckShowsMeasuredValues) {
  v1::CheckCollisionResponse& answer = fake_.collision_answer;
  answer.set_relation(v1::RELATION_SEPARATED);
  answer.mutable_separation()->set_value(0.5);
  answer.mutable_separation()->set_bound(1e-16);
  answer.mutable_witness()->mutable_point_a()->set_x(1);
  answer.mutable_witness()->mutable_point_b()->set_x(1.5);
  answer.mutable_witness()->set_error(2e-16);
  answer.mutable_normal()->mutable_direction()->set_y(1);
  answer.mutable_normal()->set_angle_bound(1e-15);
  answer.set_within_clearance(true);
  answer.mutable_certificate()->mutable_integer_direction()->set_x(
      "123456789012345678901234567890");
  answer.mutable_certificate()->mutable_integer_direction()->set_y("-7");
  answer.mutable_certificate()->mutable_integer_direction()->set_z("0");
  answer.mutable_certificate()->add_pairs()->set_index_a(3);
  const Ran ran = Run({"check", "a", "b", "--max-error", "1e-3", "--witness", "--normal",
                       "--clearance", "0.75", "--certificate"});
  EXPECT_EQ(ran.code, 0) << ran.err;
  const v1::Wanted wanted = fake_.last_collision_request().wanted();
  EXPECT_TRUE(wanted.separation() && wanted.witness() && wanted.normal() && wanted.certificate());
  EXPECT_EQ(wanted.max_error(), 1e-3);
  EXPECT_EQ(wanted.clearance(), 0.75);
  EXPECT_FALSE(wanted.axis() || wanted.analysis());
  EXPECT_THAT(ran.out,
              AllOf(HasSubstr("separation     0.5 within 1e-16\n"),
                    HasSubstr("point of B     1.5 0 0\n"), HasSubstr("points within  2e-16\n"),
                    HasSubstr("normal         0 1 0 within 1e-15 rad\n"),
                    HasSubstr("clearance      within 0.75\n"),
                    HasSubstr("n = 12345678...(30 digits) -7 0; A 3 with B 0\n")));
  EXPECT_EQ(Run({"check", "a", "b", "--tolerance", "0.25"}).code, 0);
  EXPECT_EQ(fake_.last_collision_request().tolerance(), 0.25);
  EXPECT_FALSE(fake_.last_collision_request().wanted().has_clearance());
}

TEST_F(HullctlTest, ACollisionIsNotAnError) {
  fake_.collision_answer.set_relation(v1::RELATION_OVERLAPPING);
  EXPECT_EQ(Run({"check", "a", "b"}).code, 0);
}

TEST_F(HullctlTest, BatchPrintsEachPairAndExitsWithFourWhenSomeFail) {
  fake_.PutHull("box", {});
  const TempFile good(
      "good",
      "place: {a: {id: box}, b: {id: box, at: [1, 2, 3]}}\nask: {pairs: [[a, b], [b, a]]}\n");
  const Ran fine = Run({"batch", good.path()});
  EXPECT_EQ(fine.code, 0) << fine.err;
  EXPECT_EQ(fine.out,
            "a\tb\tTOUCHING\nb\ta\tTOUCHING\n# separated 0 touching 2 overlapping 0 failed 0\n");
  const TempFile mixed("mixed", "place: {a: {id: box}, b: {id: box}, c: {id: nope}}\n");
  const Ran some = Run({"batch", mixed.path()});
  EXPECT_EQ(some.code, 4);
  EXPECT_THAT(some.out, HasSubstr("a\tc\tFAILED\thull \"nope\" not found\n"));
  EXPECT_THAT(some.err, HasSubstr("2 of 3 pairs failed"));
  const Ran json = RunJson({"batch", mixed.path(), "--axis", "--report"});
  EXPECT_EQ(json.code, 4);
  v1::BatchCheckCollisionsResponse all;
  for (const auto& part : MessagesIn<v1::BatchCheckCollisionsResponse>(json.out)) {
    all.MergeFrom(part);
  }
  ASSERT_EQ(all.columns().relations_size(), 3);
  EXPECT_EQ(all.columns().relations(1), v1::RELATION_UNSPECIFIED);
  ASSERT_EQ(all.placement_problems_size(), 1);
  EXPECT_EQ(all.placement_problems(0).placement(), 2u);
  EXPECT_EQ(all.placement_problems(0).code(), grpc::StatusCode::NOT_FOUND);
  EXPECT_EQ(all.columns().axes(0).kind(), v1::AXIS_KIND_EDGE_EDGE);
  const Ran unclear = RunJson({"batch", mixed.path(), "--colliding"});
  EXPECT_EQ(unclear.code, 2);
  EXPECT_THAT(unclear.err, HasSubstr("use 'hullctl scene' to find colliding pairs"));
}

TEST_F(HullctlTest, LargeBatchesAreSplitIntoCompleteCalls) {
  fake_.PutHull("box", {});
  std::string text = "place:\n  extra: {id: box}\n";
  for (int i = 0; i < 500; ++i) text += "  p" + std::to_string(i) + ": {id: box}\n";
  const TempFile file("big", text);
  const Ran ran = Run({"batch", file.path()});
  EXPECT_EQ(ran.code, 0) << ran.err;
  EXPECT_THAT(ran.out, HasSubstr("# separated 0 touching 125250 overlapping 0 failed 0\n"));
  const auto requests = fake_.batch_requests();
  ASSERT_EQ(requests.size(), 2u);
  EXPECT_EQ(requests[0].pairs_size() + requests[1].pairs_size(), 2 * 125250);
  EXPECT_LT(requests[1].placements_size(), 501);
  // API messages identify placements by index in the file, with consecutive pair numbers.
  uint64_t next = 0;
  for (const auto& part :
       MessagesIn<v1::BatchCheckCollisionsResponse>(RunJson({"batch", file.path()}).out)) {
    if (part.columns().relations_size() == 0) continue;
    EXPECT_EQ(part.first_pair(), next);
    next += static_cast<uint64_t>(part.columns().relations_size());
  }
  EXPECT_EQ(next, 125250U);
  EXPECT_EQ(fake_.batch_requests().back().placements_size(), 501);
}

TEST_F(HullctlTest, AnInconsistentBatchIsRefused) {
  const TempFile file("pairs",
                      "place: {a: {id: box}, b: {id: box}}\nask: {pairs: [[a, b], [b, a]]}\n");
  v1::BatchCheckCollisionsResponse late;
  late.set_first_pair(1);
  late.mutable_columns()->add_relations(v1::RELATION_TOUCHING);
  v1::BatchCheckCollisionsResponse few;
  few.mutable_columns()->add_relations(v1::RELATION_TOUCHING);
  v1::BatchCheckCollisionsResponse many;
  for (int i = 0; i < 3; ++i) many.mutable_columns()->add_relations(v1::RELATION_TOUCHING);
  v1::BatchCheckCollisionsResponse ragged;
  for (int i = 0; i < 2; ++i) ragged.mutable_columns()->add_relations(v1::RELATION_TOUCHING);
  ragged.mutable_columns()->add_axes();
  v1::BatchCheckCollisionsResponse half;
  for (int i = 0; i < 2; ++i) half.mutable_columns()->add_relations(v1::RELATION_TOUCHING);
  for (int i = 0; i < 2; ++i) half.mutable_columns()->add_separations(1);
  for (const auto& answer : {late, few, many, ragged, half}) {
    fake_.batch_answers = {answer};
    EXPECT_EQ(Run({"batch", file.path()}).code, 1);
  }
}

TEST_F(HullctlTest, EveryJsonOutputIsValid) {
  const TempFile points("a.xyz", "1 2 3\n");
  const auto appended =
      MessagesIn<v1::AppendPointsResponse>(RunJson({"append", "a", "--create", points.path()}).out);
  ASSERT_EQ(appended.size(), 2u);
  EXPECT_EQ(appended[0].opened().hull().hull_id(), "a");
  EXPECT_EQ(appended[1].ack().sequence(), 1u);
  EXPECT_EQ(appended[1].ack().counts().received(), 1u);
  Json(RunJson({"create", "b"}));
  Json(RunJson({"get", "a", "--audit"}));
  EXPECT_EQ(Json(RunJson({"list"})).fields().at("hulls").list_value().values_size(), 2);
  Json(RunJson({"check", "a", "b", "--axis", "--report"}));
  EXPECT_EQ(MessagesIn<v1::GetStatusResponse>(RunJson({"status"}).out).size(), 1u);
  Json(RunJson({"delete", "b"}));
  EXPECT_EQ(QuoteJson("a\"b\\c\n\x01"), "\"a\\\"b\\\\c\\u000a\\u0001\"");
  // A name in Latin-1 made the output invalid.
  EXPECT_EQ(QuoteJson("caf\xE9 \xE2\x82\xAC"), "\"caf\xEF\xBF\xBD \xE2\x82\xAC\"");
}

TEST_F(HullctlTest, GetShowsProperties) {
  fake_.PutHull("a", {});
  EXPECT_THAT(Run({"get", "a"}).out, testing::Not(HasSubstr("volume")));
  const Ran ran = Run({"get", "a", "--properties"});
  EXPECT_EQ(ran.code, 0) << ran.err;
  EXPECT_THAT(ran.out, AllOf(HasSubstr("volume            8 within 0\n"),
                             HasSubstr("area              24 within 4e-15\n"),
                             HasSubstr("centroid          0 0.5 0 within 1e-17\n"),
                             HasSubstr("inertia xx yy zz  0 0 3 within 2e-16\n"),
                             HasSubstr("inertia xy xz yz  -0.25 0 0 within 0\n")));
}

TEST_F(HullctlTest, AnAuditWithAFindingFails) {
  fake_.PutHull("a", {});
  EXPECT_EQ(Run({"get", "a", "--audit"}).code, 0);
  fake_.audit_finding = "edge 3 is not convex";
  const Ran ran = Run({"get", "a", "--audit"});
  EXPECT_EQ(ran.code, 1);
  EXPECT_THAT(ran.err, HasSubstr("edge 3 is not convex"));
}

TEST_F(HullctlTest, StatusFailsIfTheServerIsNotServing) {
  EXPECT_THAT(Run({"status"}).out, HasSubstr("SERVING"));
  fake_.SetServing(false);
  const Ran ran = Run({"status"});
  EXPECT_EQ(ran.code, 1);
  EXPECT_THAT(ran.out, HasSubstr("NOT_SERVING"));
  EXPECT_EQ(RunTool({"status", "--server", "127.0.0.1:1"}).code, 3);
}

// A tetrahedron with coordinates that need 17 digits.
std::vector<v1::GetHullMeshResponse> Tetrahedron() {
  std::vector<v1::GetHullMeshResponse> parts(3);
  v1::MeshHeader& header = *parts[0].mutable_header();
  header.mutable_hull()->set_hull_id("a");
  header.mutable_hull()->set_vertex_count(4);
  header.set_vertex_count(4);
  header.mutable_hull()->set_dimension(3);
  header.set_facet_count(4);
  for (const double x : {0.1, 1e-310, 0.0, 1.0 / 3, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1e308}) {
    parts[1].mutable_vertices()->add_xyz(x);
  }
  for (int i = 0; i < 4; ++i) parts[2].mutable_facets()->add_sizes(3);
  for (const uint32_t i : {0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3}) {
    parts[2].mutable_facets()->add_indices(i);
  }
  return parts;
}

TEST_F(HullctlTest, MeshWritesObjThatReadsBackExactly) {
  fake_.mesh_parts = Tetrahedron();
  const TempFile file("a.obj", "");
  ASSERT_EQ(Run({"mesh", "a", "-o", file.path()}).code, 0);
  EXPECT_THAT(ReadFile(file.path(), PointFormat::kObj).xyz(),
              ElementsAre(0.1, 1e-310, 0.0, 1.0 / 3, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1e308));
  const Ran printed = Run({"mesh", "a"});
  EXPECT_THAT(printed.out, HasSubstr("f 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"));
  EXPECT_EQ(Run({"mesh", "a", "-o", "/no/such/folder/a.obj"}).code, 2);
}

TEST_F(HullctlTest, CheckQueriesAgainIfAHullChangesBeforeVerification) {
  fake_.mesh_parts = Tetrahedron();
  fake_.mesh_parts[0].mutable_header()->mutable_hull()->set_revision(7);
  v1::CheckCollisionResponse& answer = fake_.collision_answer;
  answer.set_relation(v1::RELATION_TOUCHING);
  answer.mutable_hull_a()->set_hull_id("a");
  answer.mutable_hull_b()->set_hull_id("a");
  answer.mutable_certificate()->add_pairs();
  answer.mutable_certificate()->mutable_direction()->set_x(1);
  answer.mutable_hull_a()->set_revision(6);
  const Ran moved = Run({"check", "a", "a", "--verify"});
  EXPECT_EQ(moved.code, 6);
  EXPECT_THAT(moved.err, HasSubstr("hull a is at revision 7; the answer is from revision 6"));
  EXPECT_EQ(fake_.calls("CheckCollision"), 5);
  answer.mutable_hull_a()->set_revision(7);
  answer.mutable_hull_b()->set_revision(7);
  const Ran wrong = Run({"check", "a", "a", "--verify"});
  EXPECT_EQ(wrong.code, 5);
  EXPECT_EQ(fake_.calls("CheckCollision"), 6);
  EXPECT_THAT(wrong.err, HasSubstr("does not prove the answer"));
}

TEST_F(HullctlTest, SimplifiedMeshStatesItsError) {
  fake_.mesh_parts = Tetrahedron();
  v1::MeshHeader& header = *fake_.mesh_parts[0].mutable_header();
  header.mutable_hull()->set_vertex_count(72);
  header.set_error(0.25);
  EXPECT_THAT(Run({"mesh", "a", "--max-vertices", "8", "--outside"}).out,
              HasSubstr("4 vertices, 4 facets, simplified from 72 vertices within 0.25\n"));
  EXPECT_EQ(fake_.last_mesh_request.simplification().side(), v1::SIMPLIFICATION_SIDE_OUTSIDE);
  EXPECT_EQ(fake_.last_mesh_request.simplification().max_vertices(), 8u);
  const Ran unclear = Run({"mesh", "a", "--outside"});
  EXPECT_EQ(unclear.code, 2);
  EXPECT_THAT(unclear.err, HasSubstr("--max-vertices"));
  EXPECT_EQ(Run({"mesh", "a", "--max-error", "-1"}).code, 2);
}

TEST_F(HullctlTest, AFalseSimplificationIsNotWritten) {
  fake_.mesh_parts = Tetrahedron();
  fake_.mesh_parts[0].mutable_header()->set_error(0);
  const TempFile file("a.obj", "");
  const std::vector<std::string> verify = {"mesh",     "a",  "--max-vertices", "4",
                                           "--verify", "-o", file.path()};
  const Ran valid = Run(verify);
  EXPECT_EQ(valid.code, 0);
  EXPECT_THAT(valid.err, HasSubstr("simplified from 4 vertices within 0, verified\n"));
  const Ran many = Run({"mesh", "a", "--max-vertices", "3", "--verify"});
  EXPECT_EQ(many.code, 5);
  EXPECT_EQ(many.out, "");
  EXPECT_THAT(many.err, HasSubstr("is invalid; nothing was written: the simplification "
                                  "has 4 vertices; at most 3 were requested"));
  const Ran whole = Run({"mesh", "a", "--verify"});
  EXPECT_EQ(whole.code, 2);
  EXPECT_THAT(whole.err, HasSubstr("--max-vertices"));
}

TEST_F(HullctlTest, MeshWritesSegmentsAndPoints) {
  v1::GetHullMeshResponse header;
  header.mutable_header()->mutable_hull()->set_vertex_count(2);
  header.mutable_header()->set_vertex_count(2);
  v1::GetHullMeshResponse vertices;
  for (int i = 0; i < 6; ++i) vertices.mutable_vertices()->add_xyz(i);
  fake_.mesh_parts = {header, vertices};
  EXPECT_THAT(Run({"mesh", "a"}).out, HasSubstr("v 0 1 2\nv 3 4 5\nl 1 2\n"));
}

TEST_F(HullctlTest, GenerateWritesTheSamePointsEachTime) {
  const Ran first = RunTool({"generate", "sphere", "100", "--seed", "5"});
  EXPECT_EQ(first.code, 0);
  EXPECT_EQ(RunTool({"generate", "sphere", "100", "--seed", "5"}).out, first.out);
  EXPECT_NE(RunTool({"generate", "sphere", "100", "--seed", "6"}).out, first.out);
  EXPECT_EQ(RunTool({"generate", "lattice", "3", "--size", "0.1", "--center", "-1,0,0"}).out,
            "-1 0 0\n-0.9 0 0\n-1 0.1 0\n");
}

TEST_F(HullctlTest, NamesArePrintedOnePerLine) {
  const TempFile points("a.xyz", "1 2 3\n");
  const auto names = [this](std::vector<std::string> arguments) {
    arguments.insert(arguments.end(), {"--output", "name", "--color", "always"});
    return Run(arguments).out;
  };
  EXPECT_EQ(names({"create", "b"}), "b\n");
  EXPECT_EQ(names({"append", "a", "--create", points.path()}), "a\n");
  EXPECT_EQ(names({"get", "a"}), "a\n");
  EXPECT_EQ(names({"list"}), "a\nb\n");
  EXPECT_EQ(names({"list", "--count"}), "2\n");
  EXPECT_EQ(names({"status"}), "SERVING\n");
  fake_.collision_answer.set_relation(v1::RELATION_TOUCHING);
  EXPECT_EQ(names({"check", "a", "b"}), "TOUCHING\n");
  const TempFile scene("scene", "place: {x: {id: a}, y: {id: nope}, z: {id: b}}\n");
  EXPECT_EQ(names({"batch", scene.path()}), "x\ty\tFAILED\nx\tz\tTOUCHING\ny\tz\tFAILED\n");
  EXPECT_EQ(names({"delete", "b"}), "b\n");
}

TEST_F(HullctlTest, ColorsAreForTerminalsUnlessRequested) {
  fake_.collision_answer.set_relation(v1::RELATION_OVERLAPPING);
  constexpr char kPainted[] = "\x1b[31mOVERLAPPING\x1b[0m";
  EXPECT_THAT(Run({"check", "a", "b"}).out, testing::Not(HasSubstr("\x1b")));
  EXPECT_THAT(Run({"check", "a", "b", "--color", "never"}).out, testing::Not(HasSubstr("\x1b")));
  EXPECT_THAT(Run({"check", "a", "b", "--color", "always"}).out, HasSubstr(kPainted));
  EXPECT_THAT(RunJson({"check", "a", "b", "--color", "always"}).out,
              testing::Not(HasSubstr("\x1b")));
  // Column widths count visible characters only.
  fake_.PutHull("long-name", {});
  const Ran list = Run({"list", "--color", "always"});
  EXPECT_THAT(list.out, HasSubstr("\x1b[1mHULL\x1b[0m       \x1b[1mDIMENSION"));
}

}  // namespace hullctl_test
}  // namespace hulld
