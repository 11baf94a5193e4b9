#include <absl/strings/str_cat.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <set>
#include <string>
#include <thread>

#include "tests/server/harness/test_server.h"

namespace hulld::server {
namespace hull_service_test {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

class HullCalls : public ServerTest {
 protected:
  grpc::Status TryCreate(const std::string& hull_id, bool if_absent,
                         v1::CreateHullResponse* response) {
    grpc::ClientContext context;
    v1::CreateHullRequest request;
    request.set_hull_id(hull_id);
    request.set_if_absent(if_absent);
    return hulls_->CreateHull(&context, request, response);
  }

  grpc::Status List(const v1::ListHullsRequest& request, v1::ListHullsResponse* response) {
    grpc::ClientContext context;
    return hulls_->ListHulls(&context, request, response);
  }

  // Returns the IDs of all pages.
  std::vector<std::string> ListAll(const std::string& prefix, uint32_t page_size) {
    std::vector<std::string> ids;
    v1::ListHullsRequest request;
    request.set_prefix(prefix);
    request.set_page_size(page_size);
    v1::ListHullsResponse response;
    do {
      response.Clear();
      const grpc::Status status = List(request, &response);
      EXPECT_TRUE(status.ok()) << status.error_message();
      if (!status.ok()) break;
      for (const v1::HullInfo& hull : response.hulls()) ids.push_back(hull.hull_id());
      request.set_page_token(response.next_page_token());
    } while (!response.next_page_token().empty());
    return ids;
  }

  struct Mesh {
    grpc::Status status;
    v1::MeshHeader header;
    Coordinates xyz;
    std::vector<uint32_t> sizes;
    std::vector<uint32_t> indices;
    size_t largest_message = 0;
    int messages = 0;
  };

  Mesh GetMesh(const std::string& hull_id) {
    v1::GetHullMeshRequest request;
    request.set_hull_id(hull_id);
    return GetMesh(request);
  }

  Mesh GetMesh(const v1::GetHullMeshRequest& request) {
    grpc::ClientContext context;
    auto stream = hulls_->GetHullMesh(&context, request);
    Mesh mesh;
    v1::GetHullMeshResponse part;
    while (stream->Read(&part)) {
      ++mesh.messages;
      mesh.largest_message = std::max(mesh.largest_message, part.ByteSizeLong());
      if (part.has_header()) mesh.header = part.header();
      const auto& xyz = part.vertices().xyz();
      mesh.xyz.insert(mesh.xyz.end(), xyz.begin(), xyz.end());
      const v1::MeshFacets& facets = part.facets();
      mesh.sizes.insert(mesh.sizes.end(), facets.sizes().begin(), facets.sizes().end());
      mesh.indices.insert(mesh.indices.end(), facets.indices().begin(), facets.indices().end());
    }
    mesh.status = stream->Finish();
    return mesh;
  }
};

TEST_F(HullCalls, CreateRegistersAnEmptyHull) {
  v1::CreateHullResponse response;
  ASSERT_TRUE(TryCreate("arm/3", false, &response).ok());
  EXPECT_TRUE(response.created());
  EXPECT_EQ(response.hull().dimension(), -1);
  EXPECT_EQ(response.hull().revision(), response.hull().create_revision());
  EXPECT_EQ(response.header().revision(), response.hull().revision());
  EXPECT_FALSE(response.header().store_id().empty());
}

TEST_F(HullCalls, CreateOfAnExistingHullFailsUnlessIfAbsent) {
  Put("cube", Cube());
  v1::CreateHullResponse response;
  const grpc::Status status = TryCreate("cube", false, &response);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::ALREADY_EXISTS);
  EXPECT_THAT(status.error_message(), HasSubstr("hull \"cube\" already exists"));
  ASSERT_TRUE(TryCreate("cube", true, &response).ok());
  EXPECT_FALSE(response.created());
  EXPECT_EQ(response.hull().vertex_count(), 8);
}

TEST_F(HullCalls, TheNumberOfHullsIsLimited) {
  Config config = TestConfig();
  config.limits.max_hulls = 2;
  Restart(config);
  Create("a");
  Create("b");
  v1::CreateHullResponse response;
  const grpc::Status status = TryCreate("c", false, &response);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_THAT(status.error_message(),
              HasSubstr("the store contains 2 hulls; the limit is 2 (--max-hulls)"));
  EXPECT_TRUE(TryCreate("b", true, &response).ok());
  ASSERT_TRUE(Delete("a").ok());
  EXPECT_TRUE(TryCreate("c", false, &response).ok());
}

TEST_F(HullCalls, GetReportsSizeBoxAndAudit) {
  Put("cube", Cube(-1, 3));
  grpc::ClientContext context;
  v1::GetHullRequest request;
  v1::GetHullResponse response;
  request.set_hull_id("cube");
  request.set_audit(true);
  ASSERT_TRUE(hulls_->GetHull(&context, request, &response).ok());
  EXPECT_EQ(response.hull().dimension(), 3);
  EXPECT_EQ(response.hull().vertex_count(), 8);
  EXPECT_EQ(response.edge_count(), 12);
  EXPECT_EQ(response.facet_count(), 6);
  EXPECT_EQ(response.box_min().x(), -1);
  EXPECT_EQ(response.box_max().z(), 2);
  EXPECT_TRUE(response.audit().ok()) << response.audit().finding();
}

TEST_F(HullCalls, GetReportsPropertiesWhenRequested) {
  Put("cube", Cube(-1, 3));
  Create("empty");
  v1::GetHullRequest request;
  request.set_hull_id("cube");
  request.set_properties(true);
  for (const bool without_facets : {false, true}) {
    grpc::ClientContext context;
    v1::GetHullResponse response;
    request.set_without_facets(without_facets);
    ASSERT_TRUE(hulls_->GetHull(&context, request, &response).ok());
    const v1::HullProperties& properties = response.properties();
    EXPECT_EQ(properties.volume().value(), 27);
    EXPECT_EQ(properties.volume().bound(), 0);
    EXPECT_EQ(properties.area().value(), 54);
    EXPECT_GT(properties.area().bound(), 0);
    EXPECT_LT(properties.area().bound(), 1e-13);
    EXPECT_EQ(properties.centroid().x(), 0.5);
    EXPECT_EQ(properties.centroid_bounds().z(), 0);
    EXPECT_EQ(properties.inertia().yy(), 40.5);
    EXPECT_EQ(properties.inertia().xz(), 0);
    EXPECT_EQ(properties.inertia_bounds().zz(), 0);
    EXPECT_EQ(response.facet_count(), without_facets ? 0 : 6);
  }
  EXPECT_FALSE(Get("cube").has_properties());
  grpc::ClientContext context;
  v1::GetHullResponse response;
  request.set_hull_id("empty");
  ASSERT_TRUE(hulls_->GetHull(&context, request, &response).ok());
  EXPECT_FALSE(response.has_properties());
}

TEST_F(HullCalls, GetWithoutFacetsReportsEverythingElse) {
  Put("cube", Cube(-1, 3));
  for (const bool audit : {false, true}) {
    grpc::ClientContext context;
    v1::GetHullRequest request;
    v1::GetHullResponse response;
    request.set_hull_id("cube");
    request.set_without_facets(true);
    request.set_audit(audit);
    ASSERT_TRUE(hulls_->GetHull(&context, request, &response).ok());
    EXPECT_EQ(response.has_audit(), audit);
    response.clear_audit();
    v1::GetHullResponse expected = Get("cube");
    expected.clear_edge_count();
    expected.clear_facet_count();
    EXPECT_EQ(response.DebugString(), expected.DebugString());
  }
}

TEST_F(HullCalls, AnEmptyHullHasNoBox) {
  Create("empty");
  const v1::GetHullResponse response = Get("empty");
  EXPECT_EQ(response.hull().dimension(), -1);
  EXPECT_FALSE(response.has_box_min());
  EXPECT_FALSE(response.has_audit());
}

TEST_F(HullCalls, MissingAndMalformedIdsAreNamed) {
  grpc::ClientContext missing;
  v1::GetHullRequest request;
  v1::GetHullResponse response;
  request.set_hull_id("arm/3");
  grpc::Status status = hulls_->GetHull(&missing, request, &response);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::NOT_FOUND);
  EXPECT_THAT(status.error_message(), HasSubstr("hull \"arm/3\" not found"));
  grpc::ClientContext malformed;
  request.set_hull_id("arm 3");
  status = hulls_->GetHull(&malformed, request, &response);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_THAT(status.error_message(), HasSubstr("hull_id \"arm 3\" is malformed at character 3"));
  EXPECT_EQ(GetMesh("arm/3").status.error_code(), grpc::StatusCode::NOT_FOUND);
  EXPECT_EQ(GetMesh("").status.error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_EQ(Delete("arm/3").error_code(), grpc::StatusCode::NOT_FOUND);
  EXPECT_EQ(Delete("/").error_code(), grpc::StatusCode::INVALID_ARGUMENT);
}

TEST_F(HullCalls, DeleteChecksTheRevision) {
  Put("cube", Cube());
  const v1::GetHullResponse hull = Get("cube");
  v1::DeleteHullRequest request;
  v1::DeleteHullResponse response;
  request.set_hull_id("cube");
  request.set_if_revision(hull.hull().create_revision());
  grpc::ClientContext wrong;
  EXPECT_EQ(hulls_->DeleteHull(&wrong, request, &response).error_code(), grpc::StatusCode::ABORTED);
  request.set_if_revision(hull.hull().revision());
  grpc::ClientContext right;
  ASSERT_TRUE(hulls_->DeleteHull(&right, request, &response).ok());
  EXPECT_EQ(response.header().revision(), hull.header().revision() + 1);
  EXPECT_GT(Create("cube").create_revision(), response.header().revision());
}

TEST_F(HullCalls, MeshOfACubeIsItsCanonicalSnapshot) {
  Put("cube", Cube());
  const Mesh mesh = GetMesh("cube");
  ASSERT_TRUE(mesh.status.ok());
  EXPECT_EQ(mesh.header.facet_count(), 6);
  EXPECT_EQ(mesh.header.hull().vertex_count(), 8);
  EXPECT_EQ(mesh.xyz.size(), 24);
  EXPECT_THAT(mesh.sizes, ElementsAre(4, 4, 4, 4, 4, 4));
  EXPECT_THAT(std::vector(mesh.indices.begin(), mesh.indices.begin() + 4), ElementsAre(0, 1, 3, 2));
}

TEST_F(HullCalls, SimplifiedMeshesAreWithinTheirErrorOfTheHull) {
  Put("ball", Sphere(500));
  v1::GetHullMeshRequest request;
  request.set_hull_id("ball");
  v1::Simplification& simplification = *request.mutable_simplification();
  EXPECT_EQ(GetMesh(request).status.error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  for (const auto side : {v1::SIMPLIFICATION_SIDE_INSIDE, v1::SIMPLIFICATION_SIDE_OUTSIDE}) {
    simplification.set_side(side);
    simplification.set_max_vertices(20);
    const Mesh mesh = GetMesh(request);
    ASSERT_TRUE(mesh.status.ok()) << mesh.status.error_message();
    EXPECT_EQ(mesh.header.hull().vertex_count(), 500);
    EXPECT_LE(mesh.header.vertex_count(), 20);
    EXPECT_EQ(mesh.xyz.size(), 3 * mesh.header.vertex_count());
    EXPECT_EQ(mesh.sizes.size(), mesh.header.facet_count());
    EXPECT_GT(mesh.header.error(), 0);
    EXPECT_LT(mesh.header.error(), 1);
  }
  simplification.set_max_vertices(2);
  EXPECT_THAT(GetMesh(request).status.error_message(), HasSubstr("must be at least 8"));
}

TEST_F(HullCalls, MeshOfAnEmptyHullIsItsHeader) {
  Create("empty");
  const Mesh mesh = GetMesh("empty");
  EXPECT_TRUE(mesh.status.ok());
  EXPECT_EQ(mesh.messages, 1);
  EXPECT_EQ(mesh.header.hull().dimension(), -1);
}

TEST_F(HullCalls, ALargeMeshIsSplitIntoMessagesOfAMebibyte) {
  constexpr int kVertices = 60'000;
  Put("ball", Sphere(kVertices));
  const Mesh mesh = GetMesh("ball");
  ASSERT_TRUE(mesh.status.ok()) << mesh.status.error_message();
  EXPECT_EQ(mesh.xyz.size(), 3 * kVertices);
  EXPECT_EQ(mesh.sizes.size(), mesh.header.facet_count());
  uint64_t sum = 0;
  for (const uint32_t size : mesh.sizes) sum += size;
  EXPECT_EQ(sum, mesh.indices.size());
  EXPECT_GE(mesh.messages, 5);
  EXPECT_LE(mesh.largest_message, (1 << 20) + 1024);
}

TEST_F(HullCalls, ListsInByteOrderByPrefixAndPage) {
  for (const char* id : {"b", "a/2", "a-1", "A", "a/10", "a"}) Create(id);
  EXPECT_THAT(ListAll("", 0), ElementsAre("A", "a", "a-1", "a/10", "a/2", "b"));
  EXPECT_THAT(ListAll("a/", 1), ElementsAre("a/10", "a/2"));
  EXPECT_THAT(ListAll("none", 0), ElementsAre());
  EXPECT_EQ(ListAll("", 2), ListAll("", 1000));
}

TEST_F(HullCalls, PagesHave100EntriesByDefaultAndAtMost1000) {
  for (int i = 0; i < 101; ++i) Create(absl::StrCat("h", i));
  v1::ListHullsRequest request;
  v1::ListHullsResponse response;
  ASSERT_TRUE(List(request, &response).ok());
  EXPECT_EQ(response.hulls_size(), 100);
  request.set_page_token(response.next_page_token());
  ASSERT_TRUE(List(request, &response).ok());
  EXPECT_EQ(response.hulls_size(), 1);
  EXPECT_EQ(response.next_page_token(), "");
  for (int i = 101; i < 1001; ++i) Create(absl::StrCat("h", i));
  request.clear_page_token();
  for (const uint32_t size : {1000u, 1001u, ~0u}) {
    request.set_page_size(size);
    ASSERT_TRUE(List(request, &response).ok());
    EXPECT_EQ(response.hulls_size(), 1000);
    EXPECT_NE(response.next_page_token(), "");
  }
}

TEST_F(HullCalls, APrefixLongerThanAnyIdIsRefusedAndNotEchoed) {
  v1::ListHullsRequest request;
  v1::ListHullsResponse response;
  request.set_prefix(std::string(100'000, 'x'));
  const grpc::Status status = List(request, &response);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_EQ(status.error_message(), "prefix has 100000 characters; the limit is 256");
}

TEST_F(HullCalls, ForeignPageTokensAreRefused) {
  for (const char* id : {"a/1", "a/2", "b/1"}) Create(id);
  v1::ListHullsRequest request;
  v1::ListHullsResponse response;
  request.set_page_size(1);
  request.set_prefix("a/");
  ASSERT_TRUE(List(request, &response).ok());
  request.set_prefix("b/");
  request.set_page_token(response.next_page_token());
  EXPECT_EQ(List(request, &response).error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  request.set_page_token("!");
  EXPECT_EQ(List(request, &response).error_code(), grpc::StatusCode::INVALID_ARGUMENT);
}

TEST_F(HullCalls, HullsPresentThroughoutAListingAppearExactlyOnce) {
  for (int i = 0; i < 300; ++i) Create(absl::StrCat("keep/", i));
  std::atomic<bool> listed = false;
  std::thread churn([&] {
    const auto stub = v1::HullService::NewStub(channel_);
    for (int i = 0; !listed; ++i) {
      const std::string id = absl::StrCat("keep/", i % 300, ".churn");
      grpc::ClientContext create;
      v1::CreateHullRequest request;
      v1::CreateHullResponse response;
      request.set_hull_id(id);
      request.set_if_absent(true);
      EXPECT_TRUE(stub->CreateHull(&create, request, &response).ok());
      if (i % 2 == 0) {
        EXPECT_TRUE(Delete(id).ok());
      }
    }
  });
  for (int round = 0; round < 20; ++round) {
    const std::vector<std::string> ids = ListAll("", 7);
    EXPECT_TRUE(std::is_sorted(ids.begin(), ids.end()));
    const std::set<std::string> distinct(ids.begin(), ids.end());
    EXPECT_EQ(distinct.size(), ids.size());
    for (int i = 0; i < 300; ++i) EXPECT_EQ(distinct.count(absl::StrCat("keep/", i)), 1);
  }
  listed = true;
  churn.join();
}

TEST_F(HullCalls, StatusCountsHullsAndVertices) {
  Put("cube", Cube());
  Put("gone", Cube());
  Put("ball", Sphere(20));
  ASSERT_TRUE(Delete("gone").ok());
  grpc::ClientContext context;
  v1::GetStatusResponse response;
  ASSERT_TRUE(status_->GetStatus(&context, {}, &response).ok());
  EXPECT_EQ(response.version(), HULLD_VERSION);
  EXPECT_EQ(response.store_kind(), "memory");
  EXPECT_EQ(response.hull_count(), 2);
  EXPECT_EQ(response.vertex_count(), 28);
  EXPECT_EQ(response.header().revision(), 7);
  EXPECT_EQ(response.limits().max_points_per_chunk(), 200'000);
  EXPECT_EQ(response.limits().max_textbook_axes(), 10'000'000);
  EXPECT_GT(response.started().seconds(), 1'500'000'000);
}

TEST_F(HullCalls, AnInMemoryStoreHasANewIdAfterARestart) {
  Create("h");
  const std::string before = Get("h").header().store_id();
  Restart(TestConfig());
  Create("h");
  EXPECT_NE(Get("h").header().store_id(), before);
}

}  // namespace hull_service_test
}  // namespace hulld::server
