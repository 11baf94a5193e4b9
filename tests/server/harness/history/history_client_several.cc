// Queries of history clients about several hulls and bodies.
#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "tests/server/harness/history/answers.h"
#include "tests/server/harness/history/history_client.h"

namespace hulld::server {
namespace {

using Kind = Operation::Kind;

constexpr int kProbes = 4;
// More pages than any list of a history's hulls has.
constexpr int kMaxPages = 20;

const double* PointAt(int point) { return HistoryCloud().data() + 3 * point; }

// Returns true if the server was available.
bool IsAnswered(const grpc::Status& status) {
  // Every revision requested comes from an earlier answer.
  EXPECT_NE(status.error_code(), grpc::StatusCode::FAILED_PRECONDITION) << status.error_message();
  return status.error_code() != grpc::StatusCode::UNAVAILABLE;
}

}  // namespace

// Hulls and bodies at the identity pose, with kProbeHull at each of these points of the cloud.
// Placements: hulls and bodies first, then probes.
struct HistoryClient::JointQuery {
  static JointQuery Make(const std::vector<std::string>& hulls,
                         const std::vector<std::string>& bodies, std::mt19937_64& random) {
    JointQuery query;
    query.ids = hulls;
    query.ids.insert(query.ids.end(), bodies.begin(), bodies.end());
    query.hulls = hulls.size();
    for (int i = 0; i < kProbes; ++i) {
      query.points.push_back(static_cast<int>(random() % kCloudSize));
    }
    return query;
  }
  template <typename Message>
  void AddPlacements(Message& message) const {
    for (const std::string& id : ids) *message.add_placements() = PlacementOf(id);
    for (const int point : points) {
      const double* at = PointAt(point);
      *message.add_placements() = PlacementOf(kProbeHull, at[0], at[1], at[2]);
    }
  }
  template <typename Message>
  void AddPairs(Message& message) const {
    for (uint32_t i = 0; i < ids.size(); ++i) {
      for (uint32_t k = 0; k < points.size(); ++k) {
        message.add_pairs(i);
        message.add_pairs(static_cast<uint32_t>(ids.size()) + k);
      }
    }
  }
  size_t pairs() const { return ids.size() * points.size(); }

  // Hulls first.
  std::vector<std::string> ids;
  size_t hulls = 0;
  std::vector<int> points;
};

// Answers received so far.
struct HistoryClient::JointAnswer {
  template <typename Message>
  void TakeTable(const Message& message) {
    if (message.has_header()) header = message.header();
    hulls.insert(hulls.end(), message.hulls().begin(), message.hulls().end());
    for (const v1::PlacementProblem& problem : message.placement_problems()) {
      problems[problem.placement()] = problem;
    }
  }
  void TakeRelation(size_t pair, v1::Relation relation) {
    touching[pair] = std::nullopt;
    if (relation != v1::RELATION_UNSPECIFIED) touching[pair] = relation == v1::RELATION_TOUCHING;
  }

  v1::ResponseHeader header;
  std::vector<v1::HullVersion> hulls;
  std::map<uint32_t, v1::PlacementProblem> problems;
  // By pair: true if it touches; nullopt if unanswered.
  std::vector<std::optional<bool>> touching;
};

struct HistoryClient::CollisionStream {
  std::unique_ptr<grpc::ClientContext> context;
  std::unique_ptr<
      grpc::ClientReaderWriter<v1::StreamCollisionsRequest, v1::StreamCollisionsResponse>>
      stream;
  JointQuery query;
  JointAnswer answer;
  v1::Freshness freshness;
  std::optional<uint64_t> max_staleness;
};

// One page of a list.
struct HistoryClient::Page {
  grpc::Status status;
  v1::ResponseHeader header;
  // Without store IDs.
  std::vector<Seen> rows;
  std::string next_token;
};

bool HistoryClient::CallSeveralAtRandom(const std::vector<std::string>& hulls,
                                        const std::vector<std::string>& bodies) {
  const int choice = Below(12);
  if (choice < 4) return Batch(hulls, bodies);
  if (choice < 5) return Scene(hulls, bodies);
  if (choice < 8) return QueryStream(hulls, bodies);
  return choice < 10 || bodies.empty() ? ListHulls(hulls) : ListBodies(bodies);
}

std::vector<Seen> HistoryClient::SeenIn(const JointQuery& query, const JointAnswer& answer,
                                        const v1::Freshness& freshness) {
  std::vector<Seen> all;
  for (uint32_t i = 0; i < query.ids.size(); ++i) {
    Seen seen{.hull_id = query.ids[i], .at_least_revision = freshness.at_least_revision()};
    const auto problem = answer.problems.find(i);
    if (problem != answer.problems.end()) {
      // A temporary read failure carries no information.
      if (problem->second.code() != static_cast<int>(grpc::StatusCode::NOT_FOUND)) continue;
      seen.missing_piece = MissingPiece(problem->second.message());
      seen.is_missing = seen.missing_piece.empty();
      seen.store_id = answer.header.store_id();
      seen.store_revision = answer.header.revision();
      all.push_back(seen);
      continue;
    }
    if (i >= answer.hulls.size()) {
      ADD_FAILURE() << "an answer does not mention placement " << i;
      return {};
    }
    TakeVersion(answer.hulls[i], answer.header, seen);
    for (size_t k = 0; k < query.points.size(); ++k) {
      const std::optional<bool> touching = answer.touching[i * query.points.size() + k];
      seen.lacks_answer |= !touching.has_value();
      const PointSet point = PointSet{1} << query.points[k];
      seen.probed |= point;
      if (touching.value_or(false)) seen.touched |= point;
    }
    all.push_back(seen);
  }
  return all;
}

void HistoryClient::RecordQuery(const Operation& operation, const JointQuery& query,
                                const JointAnswer& answer, const v1::Freshness& freshness) {
  RecordSeveral(operation, answer.header, SeenIn(query, answer, freshness));
}

void HistoryClient::RecordSeveral(Operation operation, const v1::ResponseHeader& header,
                                  std::vector<Seen> seen) {
  operation.outcome = Operation::Outcome::kOk;
  operation.returned = history_.Tick();
  if (seen.empty()) return;
  TakeHeader(header, operation);
  operation.at_least_revision = seen.front().at_least_revision;
  operation.others = std::move(seen);
  history_.Record(operation.others.front().hull_id, operation);
}

bool HistoryClient::Batch(const std::vector<std::string>& hulls,
                          const std::vector<std::string>& bodies) {
  const JointQuery query = JointQuery::Make(hulls, bodies, random_);
  Operation operation = Begin(Kind::kBatch);
  v1::BatchCheckCollisionsRequest request;
  query.AddPlacements(request);
  query.AddPairs(request);
  ChooseFreshnessOfSeveral(operation, *request.mutable_freshness());
  const std::unique_ptr<grpc::ClientContext> context = NewContext();
  const auto reader = collisions_->BatchCheckCollisions(context.get(), request);
  JointAnswer answer;
  answer.touching.resize(query.pairs());
  v1::BatchCheckCollisionsResponse message;
  while (reader->Read(&message)) {
    answer.TakeTable(message);
    for (int row = 0; row < message.columns().relations_size(); ++row) {
      answer.TakeRelation(message.first_pair() + row, message.columns().relations(row));
    }
  }
  const grpc::Status status = reader->Finish();
  if (!status.ok()) return IsAnswered(status);
  RecordQuery(operation, query, answer, request.freshness());
  return true;
}

bool HistoryClient::Scene(const std::vector<std::string>& hulls,
                          const std::vector<std::string>& bodies) {
  const JointQuery query = JointQuery::Make(hulls, bodies, random_);
  Operation operation = Begin(Kind::kBatch);
  v1::FindCollisionsRequest request;
  query.AddPlacements(request);
  for (int i = 0; i < request.placements_size(); ++i) {
    request.add_groups(i < static_cast<int>(query.ids.size()) ? 0 : 1);
  }
  request.set_ignore_same_group(true);
  ChooseFreshnessOfSeveral(operation, *request.mutable_freshness());
  const std::unique_ptr<grpc::ClientContext> context = NewContext();
  const auto reader = collisions_->FindCollisions(context.get(), request);
  JointAnswer answer;
  // Pairs not reported do not touch.
  answer.touching.assign(query.pairs(), false);
  v1::FindCollisionsResponse message;
  while (reader->Read(&message)) {
    answer.TakeTable(message);
    for (int row = 0; row < message.columns().relations_size(); ++row) {
      const size_t id = message.pairs(2 * row);
      const size_t probe = message.pairs(2 * row + 1) - query.ids.size();
      answer.TakeRelation(id * query.points.size() + probe, message.columns().relations(row));
    }
  }
  const grpc::Status status = reader->Finish();
  if (!status.ok()) return IsAnswered(status);
  RecordQuery(operation, query, answer, request.freshness());
  return true;
}

v1::StreamCollisionsRequest HistoryClient::NextMessage(const std::vector<std::string>& hulls,
                                                       const std::vector<std::string>& bodies,
                                                       Operation& operation) {
  v1::StreamCollisionsRequest request;
  if (collision_stream_ == nullptr) {
    collision_stream_ = std::make_shared<CollisionStream>();
    CollisionStream& stream = *collision_stream_;
    stream.query = JointQuery::Make(hulls, bodies, random_);
    stream.answer.touching.resize(stream.query.pairs());
    ChooseFreshnessOfSeveral(operation, stream.freshness);
    stream.max_staleness = operation.max_staleness;
    stream.query.AddPlacements(*request.mutable_open());
    stream.query.AddPairs(*request.mutable_open());
    *request.mutable_open()->mutable_freshness() = stream.freshness;
    stream.context = NewContext();
    stream.stream = collisions_->StreamCollisions(stream.context.get());
    return request;
  }
  CollisionStream& stream = *collision_stream_;
  v1::CollisionStreamUpdate& update = *request.mutable_update();
  update.set_refresh_hulls(true);
  if (Below(2) == 0) {
    const auto probe = static_cast<size_t>(Below(kProbes));
    stream.query.points[probe] = Below(kCloudSize);
    update.add_placements(static_cast<uint32_t>(stream.query.ids.size() + probe));
    const double* at = PointAt(stream.query.points[probe]);
    for (const double number : {1.0, 0.0, 0.0, 0.0, at[0], at[1], at[2]}) update.add_poses(number);
    // Its pairs will be answered again.
    for (size_t i = 0; i < stream.query.ids.size(); ++i) {
      stream.answer.touching[i * kProbes + probe] = std::nullopt;
    }
  }
  operation.max_staleness = stream.max_staleness;
  stream.answer.hulls.clear();
  stream.answer.problems.clear();
  return request;
}

bool HistoryClient::QueryStream(const std::vector<std::string>& hulls,
                                const std::vector<std::string>& bodies) {
  Operation operation = Begin(Kind::kBatch);
  const v1::StreamCollisionsRequest request = NextMessage(hulls, bodies, operation);
  CollisionStream& stream = *collision_stream_;
  stream.stream->Write(request);
  v1::StreamCollisionsResponse message;
  do {
    if (!stream.stream->Read(&message)) {
      const grpc::Status status = stream.stream->Finish();
      collision_stream_ = nullptr;
      return IsAnswered(status);
    }
    stream.answer.TakeTable(message);
    for (int row = 0; row < message.pairs_size(); ++row) {
      stream.answer.TakeRelation(message.pairs(row), message.columns().relations(row));
    }
  } while (!message.last());
  RecordQuery(operation, stream.query, stream.answer, stream.freshness);
  return true;
}

// A page covers all IDs after the previous page up to its own last ID; the last page covers the
// rest.
bool HistoryClient::List(
    std::vector<std::string> ids,
    const std::function<Page(const v1::Freshness&, int page_size, const std::string& token)>& ask) {
  std::ranges::sort(ids);
  v1::Freshness freshness;
  Operation chosen;
  ChooseFreshness(chosen, freshness);
  const int page_size = Below(2);
  std::string token;
  std::string after;
  for (int pages = 0; pages < kMaxPages; ++pages) {
    Operation operation = Begin(Kind::kBatch);
    operation.max_staleness = chosen.max_staleness;
    const Page page = ask(freshness, page_size, token);
    if (!page.status.ok()) return IsAnswered(page.status);
    const bool is_last = page.next_token.empty();
    std::vector<Seen> all;
    auto row = page.rows.begin();
    for (const std::string& id : ids) {
      if (id <= after) continue;
      if (!is_last && (page.rows.empty() || id > page.rows.back().hull_id)) break;
      Seen seen{.hull_id = id};
      if (row != page.rows.end() && row->hull_id == id) {
        seen = *row++;
      } else {
        seen.is_missing = true;
      }
      seen.at_least_revision = freshness.at_least_revision();
      seen.store_id = page.header.store_id();
      seen.store_revision = page.header.revision();
      all.push_back(seen);
    }
    EXPECT_TRUE(row == page.rows.end())
        << "a list after " << after << " contains " << row->hull_id << ", which is not next";
    RecordSeveral(operation, page.header, std::move(all));
    if (is_last) return true;
    token = page.next_token;
    if (!page.rows.empty()) after = page.rows.back().hull_id;
  }
  ADD_FAILURE() << "a list does not end after " << after;
  return true;
}

bool HistoryClient::ListHulls(const std::vector<std::string>& hulls) {
  return List(hulls, [&](const v1::Freshness& freshness, int page_size, const std::string& token) {
    v1::ListHullsRequest request;
    v1::ListHullsResponse response;
    request.set_prefix(hulls.front().substr(0, hulls.front().find('/') + 1));
    request.set_page_size(static_cast<uint32_t>(page_size));
    request.set_page_token(token);
    *request.mutable_freshness() = freshness;
    Page page;
    page.status = hulls_->ListHulls(NewContext().get(), request, &response);
    page.header = response.header();
    page.next_token = response.next_page_token();
    for (const v1::HullInfo& hull : response.hulls()) {
      page.rows.push_back({.hull_id = hull.hull_id(),
                           .create_revision = hull.create_revision(),
                           .revision = hull.revision(),
                           .size = hull.vertex_count()});
    }
    return page;
  });
}

bool HistoryClient::ListBodies(const std::vector<std::string>& bodies) {
  return List(bodies, [&](const v1::Freshness& freshness, int page_size, const std::string& token) {
    v1::ListBodiesRequest request;
    v1::ListBodiesResponse response;
    request.set_prefix(bodies.front().substr(0, bodies.front().find('/') + 1));
    request.set_page_size(static_cast<uint32_t>(page_size));
    request.set_page_token(token);
    *request.mutable_freshness() = freshness;
    Page page;
    page.status = bodies_->ListBodies(NewContext().get(), request, &response);
    page.header = response.header();
    page.next_token = response.next_page_token();
    for (const v1::BodyInfo& body : response.bodies()) {
      page.rows.push_back({.hull_id = body.body_id(),
                           .create_revision = body.create_revision(),
                           .revision = body.revision(),
                           .size = body.piece_count()});
    }
    return page;
  });
}

}  // namespace hulld::server
