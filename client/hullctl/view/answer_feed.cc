#include "client/hullctl/view/answer_feed.h"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <chrono>
#include <utility>

#include "client/base/status_macros.h"
#include "client/formats/text_number.h"
#include "client/hullctl/printing/answer_row.h"
#include "client/hullctl/printing/json.h"
#include "client/packed_placements.h"

namespace hulld {
namespace {

// During a drag, larger scenes are queried only at rest.
constexpr size_t kMaxObjectsInMotion = 3000;
constexpr std::chrono::seconds kPauseBetweenAttempts{1};
// Maximum number of colliding pairs that the page lists and highlights; totals count all.
constexpr size_t kMaxListedPairs = 5000;

v1::Wanted WantedOfPair(bool certificate) {
  v1::Wanted wanted;
  wanted.set_axis(true);
  wanted.set_certificate(certificate);
  wanted.set_separation(true);
  wanted.set_witness(true);
  return wanted;
}

int32_t IndexOf(bool has_piece, const v1::DecidingPiece& piece) {
  return has_piece ? static_cast<int32_t>(piece.index()) : -1;
}

// Returns the certificate of the deciding pieces; null if boxes settle them.
const v1::Certificate* CertificateOf(
    std::pair<int32_t, int32_t> pieces,
    const google::protobuf::RepeatedPtrField<v1::PieceCertificate>& certificates) {
  // A hull counts as its only piece.
  const auto a = static_cast<uint32_t>(std::max(pieces.first, 0));
  const auto b = static_cast<uint32_t>(std::max(pieces.second, 0));
  for (const v1::PieceCertificate& one : certificates) {
    if (one.piece_a() == a && one.piece_b() == b) return &one.certificate();
  }
  return nullptr;
}

std::string PairJson(std::pair<uint32_t, uint32_t> pair) {
  return absl::StrCat("[", pair.first, ",", pair.second, "]");
}

// Begins a message about a pair.
JsonObject PairMessage(const char* type, const ViewedPair& pair) {
  JsonObject message;
  message.Add("type", type)
      .AddJson("update", std::to_string(pair.update))
      .AddJson("pair", PairJson(pair.indices));
  return message;
}

std::string ProblemOfPair(const char* type, const ViewedPair& pair, const absl::Status& status) {
  return PairMessage(type, pair)
      .Add("problem", std::string_view(status.message().data(), status.message().size()))
      .Close();
}

std::string AnswerMessage(const ViewedPair& pair, bool rest, const v1::HullVersion& version_a,
                          const v1::HullVersion& version_b, const AnswerRow& row,
                          const std::string& tolerant_json = "") {
  JsonObject message = PairMessage("answer", pair);
  message.AddJson("rest", rest ? "true" : "false")
      .AddJson("poses", PosesJson({pair.a.pose, pair.b.pose}))
      .AddJson("hullA", MessageJson(version_a))
      .AddJson("hullB", MessageJson(version_b));
  AddRow(row, &message);
  if (!tolerant_json.empty()) message.AddJson("tolerant", tolerant_json);
  return message.Close();
}

// Collects the pairs of a FindCollisions call, or of a batch.
class SceneAnswer {
 public:
  explicit SceneAnswer(std::vector<uint32_t> objects) : objects_(std::move(objects)) {}

  absl::Status Take(const v1::FindCollisionsResponse& part) {
    TakeHead(part);
    if (part.has_totals()) totals_ = part.totals();
    const int count = part.pairs_size() / 2;
    if (!AreParallel(part.columns(), static_cast<size_t>(count))) {
      return absl::InternalError("the answer's columns and pairs disagree");
    }
    for (int i = 0; i < count; ++i) {
      const uint32_t a = part.pairs(2 * i);
      const uint32_t b = part.pairs(2 * i + 1);
      if (a >= objects_.size() || b >= objects_.size()) {
        return absl::InternalError("the answer refers to a placement that does not exist");
      }
      AddPair(a, b, part.columns().relations(i));
    }
    return absl::OkStatus();
  }

  // Keeps and counts the rows of named pairs that collide.
  absl::Status Take(const v1::BatchCheckCollisionsResponse& part,
                    const std::vector<uint32_t>& pairs) {
    TakeHead(part);
    const auto& relations = part.columns().relations();
    if (2 * (part.first_pair() + static_cast<uint64_t>(relations.size())) > pairs.size()) {
      return absl::InternalError("the answer has more rows than the request has pairs");
    }
    const uint32_t* pair = pairs.data() + 2 * part.first_pair();
    for (const int number : relations) {
      const auto relation = static_cast<v1::Relation>(number);
      totals_.set_touching(totals_.touching() + (relation == v1::RELATION_TOUCHING ? 1 : 0));
      totals_.set_overlapping(totals_.overlapping() +
                              (relation == v1::RELATION_OVERLAPPING ? 1 : 0));
      totals_.set_within_tolerance(totals_.within_tolerance() +
                                   (relation == v1::RELATION_WITHIN_TOLERANCE ? 1 : 0));
      if (relation != v1::RELATION_SEPARATED) {
        AddPair(std::min(pair[0], pair[1]), std::max(pair[0], pair[1]), relation);
      }
      pair += 2;
    }
    return absl::OkStatus();
  }

  bool has_pairs() const { return !pairs_.empty(); }

  std::string Json(uint64_t update) const {
    return TextMessage("collisions", {{"update", std::to_string(update)},
                                      {"revision", QuoteJson(std::to_string(revision_))},
                                      {"pairs", "[" + pairs_ + "]"},
                                      {"problems", "[" + problems_ + "]"},
                                      {"totals", MessageJson(totals_)}});
  }

 private:
  template <typename Response>
  void TakeHead(const Response& part) {
    if (part.has_header()) revision_ = part.header().revision();
    for (const v1::PlacementProblem& problem : part.placement_problems()) {
      AddProblem(problem.message());
    }
    for (const v1::PairProblem& problem : part.columns().pair_problems()) {
      AddProblem(problem.message());
    }
  }

  void AddPair(uint32_t a, uint32_t b, v1::Relation relation) {
    if (relation == v1::RELATION_UNSPECIFIED || shown_++ >= kMaxListedPairs) return;
    absl::StrAppend(&pairs_, pairs_.empty() ? "" : ",", "[", objects_[a], ",", objects_[b], ",",
                    QuoteJson(v1::Relation_Name(relation)), "]");
  }

  void AddProblem(const std::string& message) {
    constexpr int kMaxProblems = 20;
    if (problem_count_++ >= kMaxProblems) return;
    absl::StrAppend(&problems_, problems_.empty() ? "" : ",", QuoteJson(message));
  }

  // Object of each placement.
  std::vector<uint32_t> objects_;
  std::string pairs_;
  std::string problems_;
  size_t shown_ = 0;
  int problem_count_ = 0;
  uint64_t revision_ = 0;
  v1::SceneTotals totals_;
};

// Places the hull or body of an object, or the vertices of its file's hull.
v1::Placement PlacementOf(const ViewObject& object) {
  v1::Placement placement;
  if (object.hull == nullptr) {
    placement.set_hull_id(object.hull_id);
  } else {
    placement.mutable_points()->mutable_xyz()->Add(object.hull->xyz.begin(),
                                                   object.hull->xyz.end());
  }
  *placement.mutable_pose() = PoseOf(object.pose);
  placement.set_radius(object.radius);
  return placement;
}

// Like PlacementOf, from the start of a motion to its end.
v1::Placement MotionOf(const ViewObject& object) {
  v1::Placement placement = PlacementOf(object);
  if (!object.motion) return placement;
  *placement.mutable_pose() = PoseOf(object.motion->start);
  *placement.mutable_end_pose() = PoseOf(object.motion->end);
  return placement;
}

// Packs the objects that have a hull; `objects` receives their indices.
v1::PackedPlacements Pack(const std::vector<ViewObject>& from, std::vector<uint32_t>* objects) {
  google::protobuf::RepeatedPtrField<v1::Placement> placements;
  for (uint32_t i = 0; i < from.size(); ++i) {
    if (from[i].hull_id.empty()) continue;
    *placements.Add() = PlacementOf(from[i]);
    objects->push_back(i);
  }
  return PackPlacements(placements);
}

// Queries the named pairs, or all that the rules select.
absl::StatusOr<SceneAnswer> QueryScene(const Client& client, const v1::FindCollisionsRequest& rules,
                                       const std::optional<std::vector<uint32_t>>& pairs,
                                       const std::vector<ViewObject>& objects, double tolerance) {
  std::vector<uint32_t> placed;
  v1::PackedPlacements placements = Pack(objects, &placed);
  SceneAnswer answer(std::move(placed));
  if (placements.hulls_size() < 2 || (pairs && pairs->empty())) return answer;
  absl::Status status;
  if (pairs) {
    v1::BatchCheckCollisionsRequest request;
    *request.mutable_packed_placements() = std::move(placements);
    request.mutable_pairs()->Add(pairs->begin(), pairs->end());
    request.set_tolerance(tolerance);
    status = client.BatchCheckCollisions(
        request,
        [&](const v1::BatchCheckCollisionsResponse& part) { return answer.Take(part, *pairs); });
  } else {
    v1::FindCollisionsRequest request = rules;
    *request.mutable_packed_placements() = std::move(placements);
    if (tolerance > 0) request.set_tolerance(tolerance);
    status = client.FindCollisions(
        request, [&](const v1::FindCollisionsResponse& part) { return answer.Take(part); });
  }
  if (!status.ok()) return status;
  return answer;
}

}  // namespace

v1::CheckCollisionRequest PairRequest(const ViewObject& a, const ViewObject& b, bool certificate) {
  v1::CheckCollisionRequest request;
  *request.mutable_a() = PlacementOf(a);
  *request.mutable_b() = PlacementOf(b);
  *request.mutable_wanted() = WantedOfPair(certificate);
  return request;
}

std::string PairAnswerJson(const ViewedPair& pair, const v1::CheckCollisionResponse& response,
                           const std::string& tolerant_json) {
  AnswerRow row;
  row.relation = response.relation();
  row.rung = response.rung();
  if (response.has_axis()) row.axis = &response.axis();
  if (response.has_certificate()) row.certificate = &response.certificate();
  if (response.has_piece_a() || response.has_piece_b()) {
    row.pieces = {IndexOf(response.has_piece_a(), response.piece_a()),
                  IndexOf(response.has_piece_b(), response.piece_b())};
    row.certificate = CertificateOf(*row.pieces, response.piece_certificates());
  }
  if (response.has_separation()) row.separation = response.separation();
  if (response.has_witness()) row.witness = response.witness();
  return AnswerMessage(pair, /*rest=*/true, response.hull_a(), response.hull_b(), row,
                       tolerant_json);
}

std::optional<v1::CheckCollisionRequest> MotionRequest(const ViewObject& a, const ViewObject& b,
                                                       bool certificate) {
  if (a.hull_id.empty() || b.hull_id.empty() || !(a.motion || b.motion)) return std::nullopt;
  v1::CheckCollisionRequest request;
  *request.mutable_a() = MotionOf(a);
  *request.mutable_b() = MotionOf(b);
  request.mutable_wanted()->set_certificate(certificate);
  return request;
}

std::string MotionAnswerJson(const ViewedPair& pair,
                             const absl::StatusOr<v1::CheckCollisionResponse>& response) {
  if (!response.ok()) return ProblemOfPair("motion", pair, response.status());
  std::vector<std::string> hulls;
  for (const v1::HullVersion* version : {&response->hull_a(), &response->hull_b()}) {
    // An inline shape has none.
    if (!version->hull_id().empty()) hulls.push_back(MessageJson(*version));
  }
  for (const v1::HullVersion& version : response->piece_hulls()) {
    hulls.push_back(MessageJson(version));
  }
  std::vector<std::string> certificates;
  for (const v1::PieceCertificate& one : response->piece_certificates()) {
    certificates.push_back(MessageJson(one));
  }
  const auto start = [](const ViewObject& of) { return of.motion ? of.motion->start : of.pose; };
  JsonObject message = PairMessage("motion", pair);
  message.AddJson("poses", PosesJson({start(pair.a), start(pair.b)}))
      .AddJson("hulls", JsonArray(hulls))
      .Add("relation", v1::Relation_Name(response->relation()))
      .AddJson("firstContact", MessageJson(response->first_contact()))
      .AddJson("pieceCertificates", JsonArray(certificates));
  if (response->has_certificate()) {
    message.AddJson("certificate", MessageJson(response->certificate()));
  }
  return message.Close();
}

absl::StatusOr<std::string> SceneAnswerJson(const Client& client,
                                            const v1::FindCollisionsRequest& rules,
                                            const std::optional<std::vector<uint32_t>>& pairs,
                                            const std::vector<ViewObject>& objects,
                                            double tolerance, uint64_t update) {
  HULLD_ASSIGN_OR_RETURN(const auto answer, QueryScene(client, rules, pairs, objects, tolerance));
  return answer.Json(update);
}

absl::StatusOr<bool> AnyCollides(const Client& client, const v1::FindCollisionsRequest& rules,
                                 const std::optional<std::vector<uint32_t>>& pairs,
                                 const std::vector<ViewObject>& objects) {
  HULLD_ASSIGN_OR_RETURN(const auto answer, QueryScene(client, rules, pairs, objects, 0));
  return answer.has_pairs();
}

AnswerFeed::AnswerFeed(const Client& client, std::shared_ptr<PageChannel> page)
    : client_(client),
      page_(std::move(page)),
      thread_([this](const std::stop_token& stop) { Run(stop); }) {}

void AnswerFeed::Show(const ViewScene& scene, uint64_t number) {
  const std::lock_guard lock(mutex_);
  scene_ = number;
  query_ = Query();
  query_.objects = scene.objects;
  query_.rules = scene.rules;
  query_.pairs = scene.pairs;
  // The page sends a query after it receives the scene.
  is_requested_ = false;
}

void AnswerFeed::AddObjects(const std::vector<ViewObject>& objects, uint64_t scene) {
  const std::lock_guard lock(mutex_);
  if (scene != scene_) return;
  query_.objects.insert(query_.objects.end(), objects.begin(), objects.end());
}

void AnswerFeed::Request(const ViewQuery& query) {
  {
    const std::lock_guard lock(mutex_);
    if (query.scene != scene_) return;
    for (size_t i = 0; i < query.objects.size(); ++i) {
      if (query.objects[i] >= query_.objects.size()) continue;
      query_.objects[query.objects[i]].pose = query.poses[i];
    }
    query_.pair = query.pair;
    if (query.pair && std::max(query.pair->first, query.pair->second) >= query_.objects.size()) {
      query_.pair.reset();
    }
    query_.tolerance = query.tolerance;
    query_.certificate = query.certificate;
    query_.update = query.update;
    query_.rest = query.rest;
    is_requested_ = true;
  }
  changed_.notify_all();
}

void AnswerFeed::HullsChanged() {
  {
    const std::lock_guard lock(mutex_);
    query_.motion_is_stale = true;
    is_requested_ = true;
  }
  changed_.notify_all();
}

void AnswerFeed::Run(const std::stop_token& stop) {
  while (true) {
    Query query;
    {
      std::unique_lock lock(mutex_);
      const auto is_requested = [this] { return is_requested_; };
      if (is_unreachable_) {
        changed_.wait_for(lock, stop, kPauseBetweenAttempts, is_requested);
      } else {
        changed_.wait(lock, stop, is_requested);
      }
      if (stop.stop_requested()) return;
      query = query_;
      query.is_repeated = !is_requested_;
      is_requested_ = false;
      query_.motion_is_stale = false;
    }
    is_unreachable_ = false;
    if (query.pair && !AnswerPair(query)) return;
    if (!AnswerMotion(query)) return;
    if (!query.rest && query.objects.size() > kMaxObjectsInMotion) continue;
    if (!AnswerScene(query)) return;
  }
}

bool AnswerFeed::AnswerPair(const Query& query) {
  const ViewedPair pair = query.Viewed();
  if (pair.a.hull_id.empty() || pair.b.hull_id.empty()) return true;
  const auto answer = query.rest ? RestingAnswer(query) : MovingAnswer(pair, query.certificate);
  if (answer.ok()) return page_->SendText(*answer);
  stream_.reset();
  return SendError(query, answer.status(), ProblemOfPair("answer", pair, answer.status()));
}

bool AnswerFeed::SendError(const Query& query, const absl::Status& status,
                           const std::string& message) {
  const bool is_unreachable = absl::IsUnavailable(status);
  is_unreachable_ |= is_unreachable;
  return (is_unreachable && query.is_repeated) || page_->SendText(message);
}

absl::StatusOr<std::string> AnswerFeed::RestingAnswer(const Query& query) const {
  const ViewedPair pair = query.Viewed();
  HULLD_ASSIGN_OR_RETURN(const auto response,
                         client_.CheckCollision(PairRequest(pair.a, pair.b, query.certificate)));
  if (query.tolerance == 0) return PairAnswerJson(pair, response);
  HULLD_ASSIGN_OR_RETURN(const auto tolerant, TolerantAnswer(pair, query.tolerance));
  return PairAnswerJson(pair, response, tolerant);
}

absl::StatusOr<std::string> AnswerFeed::TolerantAnswer(const ViewedPair& pair,
                                                       double tolerance) const {
  v1::CheckCollisionRequest request = PairRequest(pair.a, pair.b, /*certificate=*/false);
  // A tolerance excludes wanted fields.
  request.clear_wanted();
  request.set_tolerance(tolerance);
  HULLD_ASSIGN_OR_RETURN(const auto response, client_.CheckCollision(request));
  return JsonObject()
      .AddJson("tolerance", ShortestText(tolerance))
      .Add("relation", v1::Relation_Name(response.relation()))
      .Add("rung", v1::Rung_Name(response.rung()))
      .Close();
}

absl::StatusOr<std::string> AnswerFeed::MovingAnswer(const ViewedPair& pair, bool certificate) {
  const ViewObject& a = pair.a;
  const ViewObject& b = pair.b;
  const std::pair<std::string, std::string> hulls(a.hull_id, b.hull_id);
  absl::StatusOr<v1::StreamCollisionsResponse> response;
  if (stream_ == nullptr || hulls != streamed_hulls_ || certificate != streamed_certificate_) {
    stream_ = client_.OpenCollisionStream();
    streamed_hulls_ = hulls;
    streamed_certificate_ = certificate;
    v1::CollisionStreamOpen open;
    const v1::CheckCollisionRequest request = PairRequest(a, b, certificate);
    *open.add_placements() = request.a();
    *open.add_placements() = request.b();
    open.add_pairs(0);
    open.add_pairs(1);
    *open.mutable_wanted() = request.wanted();
    response = stream_->Open(std::move(open));
  } else {
    v1::CollisionStreamUpdate update;
    update.add_placements(0);
    update.add_placements(1);
    update.mutable_poses()->Add(a.pose.begin(), a.pose.end());
    update.mutable_poses()->Add(b.pose.begin(), b.pose.end());
    // Costs one lookup for each of the two hulls.
    update.set_refresh_hulls(true);
    response = stream_->Update(std::move(update));
  }
  if (!response.ok()) return response.status();
  for (const v1::PlacementProblem& problem : response->placement_problems()) {
    return absl::NotFoundError(problem.message());
  }
  if (response->hulls_size() == 2) {
    streamed_version_a_ = response->hulls(0);
    streamed_version_b_ = response->hulls(1);
  }
  const v1::AnswerColumns& columns = response->columns();
  if (response->pairs_size() != 1 || !AreParallel(columns, 1)) {
    return absl::InternalError("the answer's columns and pairs disagree");
  }
  if (columns.pair_problems_size() > 0) {
    return absl::InternalError(columns.pair_problems(0).message());
  }
  return AnswerMessage(pair, /*rest=*/false, streamed_version_a_, streamed_version_b_,
                       RowAt(columns, 0));
}

bool AnswerFeed::AnswerMotion(const Query& query) {
  if (!query.pair) {
    queried_motion_.clear();
    return true;
  }
  const ViewedPair pair = query.Viewed();
  const auto request = MotionRequest(pair.a, pair.b, query.certificate);
  std::string motion =
      request ? absl::StrCat(PairJson(*query.pair), request->SerializeAsString()) : "";
  const bool is_known = motion == queried_motion_ && !query.motion_is_stale;
  queried_motion_ = std::move(motion);
  if (!request || is_known) return true;
  const auto response = client_.CheckCollision(*request);
  const std::string message = MotionAnswerJson(pair, response);
  if (response.ok()) return page_->SendText(message);
  queried_motion_.clear();
  return SendError(query, response.status(), message);
}

bool AnswerFeed::AnswerScene(const Query& query) {
  const auto answer = SceneAnswerJson(client_, query.rules, query.pairs, query.objects,
                                      query.tolerance, query.update);
  if (answer.ok()) return page_->SendText(*answer);
  return SendError(query, answer.status(),
                   ProblemMessage(absl::StrCat("Cannot determine the colliding pairs: ",
                                               answer.status().message())));
}

}  // namespace hulld
