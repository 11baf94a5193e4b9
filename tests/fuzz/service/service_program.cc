#include "tests/fuzz/service/service_program.h"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <chrono>
#include <set>
#include <utility>

#include "client/backup_file.h"
#include "client/verify/certificate_check.h"
#include "tests/fuzz/service/raw_call.h"

namespace hulld::fuzz {
namespace {

using server::Rpc;

constexpr int kMaxCalls = 24;
// Every call of a program is short; one that exceeds this has hung.
constexpr std::chrono::seconds kPatience(60);
constexpr int kMaxComparedPlacements = 7;

// A server stream with its context.
template <typename Response>
struct OpenReader {
  ~OpenReader() { context.TryCancel(); }
  grpc::ClientContext context;
  std::unique_ptr<grpc::ClientReader<Response>> reader;
};

const v1::ResponseHeader& HeaderOf(const v1::GetHullMeshResponse& part) {
  return part.header().header();
}
const v1::ResponseHeader& HeaderOf(const v1::SaveBackupResponse& part) {
  return part.begin().header();
}
template <typename Part>
const v1::ResponseHeader& HeaderOf(const Part& part) {
  return part.header();
}

}  // namespace

std::string Known(const v1::HullInfo& hull) {
  return absl::StrCat("created at ", hull.create_revision(), ", changed at ", hull.revision(),
                      ", vertices ", hull.vertex_count(), ", ", hull.counts().ShortDebugString());
}

bool ChangesHulls(Rpc rpc) {
  return rpc == Rpc::kCreateHull || rpc == Rpc::kAppendPoints || rpc == Rpc::kReplaceHull ||
         rpc == Rpc::kDeleteHull;
}

std::string ServiceProgram::Run() {
  for (int i = 0; i < kMaxCalls && !in_.empty() && finding_.empty(); ++i) Step();
  idle_.clear();
  return finding_;
}

void ServiceProgram::Step() {
  switch (in_.Below(28)) {
    case 0:
      return CreateHull();
    case 1:
    case 2:
      return AppendPoints();
    case 3:
      return GetHull();
    case 4:
      return GetHullMesh();
    case 5:
      return ListHulls();
    case 6:
      return DeleteHull();
    case 7:
    case 8:
      return CheckCollision();
    case 9:
    case 10:
      return BatchCheckCollisions();
    case 11:
    case 12:
      return StreamCollisions();
    case 13:
      return FindCollisions();
    case 14:
      return SendRaw();
    case 15:
    case 16:
    case 17:
      return ReplaceHull();
    case 18:
      return in_.OneOf(4) ? SaveBackup() : ReplaceHull();
    case 19:
    case 20:
      return WatchHulls();
    case 21:
    case 22:
      return WatchCollisions();
    case 23:
    case 24:
      return PutBody();
    case 25:
      return QueryBody();
    case 26:
      return in_.OneOf(2) ? GetBody() : in_.OneOf(2) ? DeleteBody() : ListBodies();
    default:
      return in_.OneOf(4) ? GetStatus() : AppendPoints();
  }
}

void ServiceProgram::Hurry(grpc::ClientContext& context, CallManner& manner) {
  manner.hurried = in_.OneOf(24);
  const auto now = std::chrono::system_clock::now();
  const std::chrono::microseconds hurry(200 * static_cast<int>(in_.Below(8)));
  context.set_deadline(now + (manner.hurried ? hurry : std::chrono::microseconds(kPatience)));
}

void ServiceProgram::Note(std::string finding) {
  if (finding_.empty()) finding_ = std::move(finding);
}

bool ServiceProgram::Ended(Rpc rpc, const CallManner& manner, const grpc::Status& status) {
  Note(CheckStatus(rpc, manner, status));
  Reach(absl::StrCat(manner.raw ? "raw " : "", server::RpcName(rpc), " ",
                     CodeName(status.error_code())));
  const std::string& message = status.error_message();
  if (const size_t flag = message.find("(--"); flag != std::string::npos) {
    Reach(message.substr(flag + 1, message.find(')', flag) - flag - 1));
  }
  if (manner.hurried || manner.cancelled) Settle();
  return status.ok();
}

void ServiceProgram::Settle() {
  idle_.clear();
  // It would not end by itself.
  if (watch_ != nullptr) watch_->TryCancel();
  watch_ = nullptr;
  if (!service_.server_->WaitIdle(kPatience)) Note("a call outlives its client");
}

void ServiceProgram::SeeStore(const v1::ResponseHeader& header) {
  if (service_.store_id_.empty()) service_.store_id_ = header.store_id();
  if (header.store_id() != service_.store_id_ || header.store_id().empty()) {
    Note("a reply names a different store");
  }
}

void ServiceProgram::SeeHeader(const v1::ResponseHeader& header) {
  SeeStore(header);
  if (header.revision() < service_.revision_) {
    Note(absl::StrCat("the revision fell from ", service_.revision_, " to ", header.revision()));
  }
  service_.revision_ = header.revision();
}

void ServiceProgram::SeeHull(const v1::HullInfo& hull) {
  revision_ = hull.revision();
  hulls_[hull.hull_id()] = hull;
}

void ServiceProgram::SeeKnownHull(const v1::HullInfo& hull) {
  const auto known = hulls_.find(hull.hull_id());
  if (!all_doubtful_ && doubtful_.count(hull.hull_id()) == 0 &&
      (known == hulls_.end() || Known(known->second) != Known(hull))) {
    Note(absl::StrCat("hull ", hull.hull_id(), " is ", Known(hull), "; acknowledged state: ",
                      known == hulls_.end() ? "none" : Known(known->second)));
  }
  SeeHull(hull);
}

uint64_t ServiceProgram::RevisionToExpect(const std::string& hull_id, uint64_t if_revision) const {
  const auto known = hulls_.find(hull_id);
  return if_revision == revision_ && known != hulls_.end() ? known->second.revision() : if_revision;
}

template <typename Stub, typename Request, typename Response>
bool ServiceProgram::ReadStream(Rpc rpc, Stub& stub,
                                std::unique_ptr<grpc::ClientReader<Response>> (Stub::*method)(
                                    grpc::ClientContext*, const Request&),
                                const Request& request, std::vector<Response>* parts) {
  const auto stream = std::make_shared<OpenReader<Response>>();
  CallManner manner;
  Hurry(stream->context, manner);
  const bool never_read = in_.OneOf(16);
  manner.cancelled = in_.OneOf(16);
  const size_t cancel_after = manner.cancelled ? in_.Below(2) : 0;
  stream->reader = (stub.*method)(&stream->context, request);
  if (never_read) {
    Reach(absl::StrCat(server::RpcName(rpc), " not read"));
    idle_.push_back(stream);
    return false;
  }
  if (manner.cancelled && cancel_after == 0) stream->context.TryCancel();
  Response part;
  while (stream->reader->Read(&part)) {
    parts->push_back(part);
    if (manner.cancelled && parts->size() >= cancel_after) stream->context.TryCancel();
  }
  if (!Ended(rpc, manner, stream->reader->Finish())) return false;
  if (parts->empty()) {
    Note(absl::StrCat(server::RpcName(rpc), " ended OK without a message"));
    return false;
  }
  SeeHeader(HeaderOf(parts->front()));
  return true;
}

void ServiceProgram::CreateHull() {
  v1::CreateHullRequest request;
  v1::CreateHullResponse response;
  FillMessage(in_, Hints(), &request);
  if (!Call(Rpc::kCreateHull, *service_.hulls_, &v1::HullService::Stub::CreateHull, request,
            &response)) {
    return;
  }
  Note(CheckHullInfo(response.hull()));
  if (response.created()) {
    SeeHull(response.hull());
  } else {
    SeeKnownHull(response.hull());
  }
}

void ServiceProgram::GetHull() {
  v1::GetHullRequest request;
  v1::GetHullResponse response;
  FillMessage(in_, Hints(), &request);
  if (!Call(Rpc::kGetHull, *service_.hulls_, &v1::HullService::Stub::GetHull, request, &response)) {
    return;
  }
  Note(CheckHull(request, response));
  SeeKnownHull(response.hull());
}

void ServiceProgram::GetHullMesh() {
  v1::GetHullMeshRequest request;
  std::vector<v1::GetHullMeshResponse> parts;
  FillMessage(in_, Hints(), &request);
  if (ReadStream(Rpc::kGetHullMesh, *service_.hulls_, &v1::HullService::Stub::GetHullMesh, request,
                 &parts)) {
    Note(CheckMesh(request, parts));
  }
}

// Follows the pages.
void ServiceProgram::ListHulls() {
  v1::ListHullsRequest request;
  FillMessage(in_, Hints(), &request);
  std::string before;
  do {
    v1::ListHullsResponse response;
    if (!Call(Rpc::kListHulls, *service_.hulls_, &v1::HullService::Stub::ListHulls, request,
              &response)) {
      return;
    }
    Note(CheckPage(request, response));
    if (response.hulls_size() > 0 && response.hulls(0).hull_id() <= before) {
      Note("pages overlap");
    }
    if (response.hulls().empty() && !response.next_page_token().empty())
      Note("an empty page is not the last one");
    for (const v1::HullInfo& hull : response.hulls()) before = hull.hull_id();
    request.set_page_token(response.next_page_token());
  } while (!request.page_token().empty() && finding_.empty());
}

void ServiceProgram::DeleteHull() {
  v1::DeleteHullRequest request;
  v1::DeleteHullResponse response;
  FillMessage(in_, Hints(), &request);
  if (request.has_if_revision()) {
    request.set_if_revision(RevisionToExpect(request.hull_id(), request.if_revision()));
  }
  if (Call(Rpc::kDeleteHull, *service_.hulls_, &v1::HullService::Stub::DeleteHull, request,
           &response)) {
    hulls_.erase(request.hull_id());
  }
}

void ServiceProgram::GetStatus() {
  v1::GetStatusRequest request;
  v1::GetStatusResponse response;
  FillMessage(in_, Hints(), &request);
  Call(Rpc::kGetStatus, *service_.status_, &v1::StatusService::Stub::GetStatus, request, &response);
}

v1::AppendPointsRequest ServiceProgram::NextAppendMessage(bool first, uint64_t* sequence) {
  v1::AppendPointsRequest request;
  const MessageHints hints = {revision_, *sequence, 0, service_.store_id_};
  if (in_.OneOf(24)) {
    FillMessage(in_, hints, &request);
  } else if (first) {
    FillMessage(in_, hints, request.mutable_open());
  } else {
    FillMessage(in_, hints, request.mutable_chunk());
  }
  if (request.chunk().sequence() == *sequence) ++*sequence;
  return request;
}

v1::ReplaceHullRequest ServiceProgram::NextReplaceMessage(bool first) {
  v1::ReplaceHullRequest request;
  if (in_.OneOf(24)) {
    FillMessage(in_, Hints(), &request);
  } else if (first) {
    v1::ReplaceOpen& open = *request.mutable_open();
    FillMessage(in_, Hints(), &open);
    if (open.has_if_revision()) {
      open.set_if_revision(RevisionToExpect(open.hull_id(), open.if_revision()));
    }
  } else {
    FillMessage(in_, Hints(), request.mutable_points());
  }
  return request;
}

void ServiceProgram::ReplaceHull() {
  grpc::ClientContext context;
  CallManner manner;
  Hurry(context, manner);
  v1::ReplaceHullResponse response;
  const auto stream = service_.hulls_->ReplaceHull(&context, &response);
  const size_t messages = in_.Below(5);
  const bool half_closes = !in_.OneOf(4);
  const size_t cancel_at = in_.OneOf(12) ? in_.Below(5) : ~size_t{0};
  ReplaceCheck check;
  bool going = true;
  const auto send = [&](const v1::ReplaceHullRequest& request) {
    check.Sent(request);
    going = going && stream->Write(request);
  };
  for (size_t i = 0; i < messages; ++i) {
    if (i == cancel_at) {
      manner.cancelled = true;
      context.TryCancel();
    }
    send(NextReplaceMessage(i == 0));
  }
  if (half_closes) {
    v1::ReplaceHullRequest end;
    end.mutable_points();
    send(end);
  }
  if (going) stream->WritesDone();
  const bool ok = Ended(Rpc::kReplaceHull, manner, stream->Finish());
  if (!ok && check.is_whole() && (manner.hurried || manner.cancelled)) Doubt(check.hull_id());
  if (check.is_cut_short()) Reach("ReplaceHull cut short");
  if (!ok) return;
  Note(check.EndedOk(response));
  SeeHeader(response.header());
  const bool is_new = hulls_.count(check.hull_id()) == 0;
  if (doubtful_.count(check.hull_id()) == 0 && !all_doubtful_ && response.created() != is_new) {
    Note("a replacement reports incorrectly whether a hull existed");
  }
  Reach(response.created() ? "ReplaceHull created" : "ReplaceHull replaced");
  SeeHull(response.hull());
}

void ServiceProgram::SaveBackup() {
  v1::SaveBackupRequest request;
  std::vector<v1::SaveBackupResponse> parts;
  FillMessage(in_, Hints(), &request);
  if (!ReadStream(Rpc::kSaveBackup, *service_.maintenance_,
                  &v1::MaintenanceService::Stub::SaveBackup, request, &parts)) {
    return;
  }
  BackupCheck check;
  for (const v1::SaveBackupResponse& part : parts) {
    if (const absl::Status taken = check.Take(part); !taken.ok()) {
      return Note("a backup: " + taken.ToString());
    }
  }
  if (!check.complete()) Note("a backup ends OK but is incomplete");
}

void ServiceProgram::AppendPoints() {
  grpc::ClientContext context;
  CallManner manner;
  Hurry(context, manner);
  const auto stream = service_.hulls_->AppendPoints(&context);
  const size_t messages = in_.Below(6);
  // Chunk by chunk or pipelined; sometimes the stream is abandoned in the middle.
  const bool stepwise = in_.OneOf(2);
  const size_t cancel_at = in_.OneOf(12) ? in_.Below(4) : ~size_t{0};
  AppendCheck check;
  std::string hull_id;
  v1::AppendPointsResponse response;
  const auto receive = [&] {
    Note(check.Received(response));
    if (response.has_opened()) hull_id = response.opened().hull().hull_id();
    if (check.is_open()) SeeHull(check.hull());
  };
  uint64_t sequence = 1;
  for (size_t i = 0; i < messages; ++i) {
    if (i == cancel_at) {
      manner.cancelled = true;
      context.TryCancel();
    }
    const v1::AppendPointsRequest request = NextAppendMessage(i == 0, &sequence);
    check.Sent(request);
    if (request.has_open() && hull_id.empty()) hull_id = request.open().hull_id();
    if (!stream->Write(request)) break;
    if (!stepwise && i > 0) continue;
    if (!stream->Read(&response)) break;
    receive();
    if (response.has_opened()) sequence = response.opened().last_sequence() + 1;
  }
  stream->WritesDone();
  while (stream->Read(&response)) receive();
  const bool ok = Ended(Rpc::kAppendPoints, manner, stream->Finish());
  const bool is_certain = doubtful_.count(hull_id) == 0 && !all_doubtful_;
  // A change overtaken by a refusal may be committed without an ack.
  if (!ok && (check.is_open() || manner.hurried || manner.cancelled)) Doubt(hull_id);
  Note(check.Ended(ok, is_certain));
  if (ok && check.is_open()) Reach("AppendPoints opened");
}

void ServiceProgram::CheckCollision() {
  v1::CheckCollisionRequest request;
  v1::CheckCollisionResponse response;
  FillMessage(in_, Hints(), &request);
  if (!Call(Rpc::kCheckCollision, *service_.collisions_,
            &v1::CollisionService::Stub::CheckCollision, request, &response)) {
    return;
  }
  Reach(v1::Relation_Name(response.relation()));
  Note(CheckPair(request, response));
  if (finding_.empty()) CheckCertificateOf(request, response);
}

std::vector<double> ServiceProgram::VerticesOf(const std::string& hull_id) {
  grpc::ClientContext context;
  v1::GetHullMeshRequest request;
  request.set_hull_id(hull_id);
  const auto reader = service_.hulls_->GetHullMesh(&context, request);
  std::vector<double> xyz;
  v1::GetHullMeshResponse part;
  while (reader->Read(&part)) {
    xyz.insert(xyz.end(), part.vertices().xyz().begin(), part.vertices().xyz().end());
  }
  const grpc::Status status = reader->Finish();
  if (!status.ok()) Note("a queried hull has no mesh: " + status.error_message());
  return xyz;
}

// Queries the same pair again for a proof of its relation.
void ServiceProgram::CheckCertificateOf(const v1::CheckCollisionRequest& query,
                                        const v1::CheckCollisionResponse& answer) {
  v1::CheckCollisionRequest request;
  *request.mutable_a() = query.a();
  *request.mutable_b() = query.b();
  request.mutable_wanted()->set_certificate(true);
  grpc::ClientContext context;
  v1::CheckCollisionResponse response;
  const grpc::Status status = service_.collisions_->CheckCollision(&context, request, &response);
  if (!status.ok()) return Note("no certificate: " + status.error_message());
  // A body has taken over the ID of a deleted hull.
  if (!response.piece_hulls().empty()) return;
  if (query.a().has_points() || query.b().has_points()) return;
  // The certificate of a motion applies at the time of contact.
  if (query.a().has_end_pose() || query.b().has_end_pose()) return;
  if (answer.relation() != v1::RELATION_WITHIN_TOLERANCE &&
      answer.relation() != response.relation()) {
    return Note(
        absl::StrCat("two answers to the same query: ", v1::Relation_Name(answer.relation()),
                     " and ", v1::Relation_Name(response.relation())));
  }
  const std::vector<double> a = VerticesOf(request.a().hull_id());
  const std::vector<double> b = VerticesOf(request.b().hull_id());
  const auto check = [&](const v1::CheckCollisionResponse& proven) {
    const absl::Status checked =
        hulld::CheckCertificate(proven.relation(), proven.certificate(),
                                {a, request.a().pose(), nullptr, false, {request.a().radius()}},
                                {b, request.b().pose(), nullptr, false, {request.b().radius()}});
    if (!checked.ok()) Note("the certificate is wrong: " + checked.ToString());
  };
  check(response);
  if (query.wanted().certificate()) check(answer);
  Reach("certificate");
}

void ServiceProgram::BatchCheckCollisions() {
  v1::BatchCheckCollisionsRequest request;
  std::vector<v1::BatchCheckCollisionsResponse> parts;
  FillMessage(in_, Hints(), &request);
  const std::optional<v1::BatchCheckCollisionsRequest> packed = MaybePacked(request);
  const v1::BatchCheckCollisionsRequest& sent = packed.has_value() ? *packed : request;
  if (!ReadStream(Rpc::kBatchCheckCollisions, *service_.collisions_,
                  &v1::CollisionService::Stub::BatchCheckCollisions, sent, &parts)) {
    return;
  }
  Note(CheckBatch(sent, parts));
  if (request.pairs_size() > 0) Reach("BatchCheckCollisions with pairs");
  if (!packed.has_value() || request.tolerance() != 0 || !finding_.empty()) return;
  Reach("BatchCheckCollisions compared with packed placements");
  if (QueryBatch(request) != RelationsOf(parts) && finding_.empty()) {
    Note("packed placements are answered differently");
  }
}

std::vector<v1::Relation> ServiceProgram::QueryBatch(
    const v1::BatchCheckCollisionsRequest& request) {
  grpc::ClientContext context;
  const auto reader = service_.collisions_->BatchCheckCollisions(&context, request);
  std::vector<v1::BatchCheckCollisionsResponse> parts;
  v1::BatchCheckCollisionsResponse part;
  while (reader->Read(&part)) parts.push_back(part);
  const grpc::Status status = reader->Finish();
  if (!status.ok()) Note("a batch fails that another RPC answered: " + status.error_message());
  return RelationsOf(parts);
}

v1::StreamCollisionsRequest ServiceProgram::NextCollisionMessage(bool first, size_t placements) {
  v1::StreamCollisionsRequest request;
  const MessageHints hints = {revision_, 1, placements, service_.store_id_};
  if (in_.OneOf(24)) {
    FillMessage(in_, hints, &request);
  } else if (first) {
    FillMessage(in_, hints, request.mutable_open());
  } else {
    FillMessage(in_, hints, request.mutable_update());
  }
  return request;
}

void ServiceProgram::StreamCollisions() {
  grpc::ClientContext context;
  CallManner manner;
  Hurry(context, manner);
  const auto stream = service_.collisions_->StreamCollisions(&context);
  const size_t messages = in_.Below(7);
  const bool stepwise = !in_.OneOf(4);
  const size_t cancel_at = in_.OneOf(12) ? in_.Below(4) : ~size_t{0};
  v1::StreamCollisionsRequest request = NextCollisionMessage(true, 0);
  const size_t placements = static_cast<size_t>(request.open().placements_size());
  CollisionStreamCheck check(request.open());
  if (request.has_open()) {
    if (auto packed = MaybePacked(request.open())) *request.mutable_open() = *std::move(packed);
  }
  v1::StreamCollisionsResponse response;
  for (size_t i = 0; i < messages; ++i) {
    if (i == cancel_at) {
      manner.cancelled = true;
      context.TryCancel();
    }
    if (i > 0) {
      request = NextCollisionMessage(false, placements);
      check.Sent(request.update());
    }
    if (!stream->Write(request)) break;
    if (!stepwise) continue;
    do {
      if (!stream->Read(&response)) break;
      Note(check.Received(response));
    } while (!response.last());
  }
  stream->WritesDone();
  while (stream->Read(&response)) Note(check.Received(response));
  if (!Ended(Rpc::kStreamCollisions, manner, stream->Finish()) || !finding_.empty()) return;
  if (messages == 0 || check.relations().empty() || check.has_tolerance()) return;
  Reach(messages > 1 ? "StreamCollisions compared after updates" : "StreamCollisions compared");
  if (QueryBatch(check.AsBatch()) != check.relations() && finding_.empty()) {
    Note("a stream and a batch disagree");
  }
}

void ServiceProgram::FindCollisions() {
  v1::FindCollisionsRequest request;
  std::vector<v1::FindCollisionsResponse> parts;
  FillMessage(in_, Hints(), &request);
  const std::optional<v1::FindCollisionsRequest> packed = MaybePacked(request);
  const v1::FindCollisionsRequest& sent = packed.has_value() ? *packed : request;
  if (!ReadStream(Rpc::kFindCollisions, *service_.collisions_,
                  &v1::CollisionService::Stub::FindCollisions, sent, &parts)) {
    return;
  }
  Note(CheckScene(sent, parts));
  const bool comparable =
      request.placements_size() > 1 && request.placements_size() <= kMaxComparedPlacements &&
      request.tolerance() == 0 && !request.wanted().has_clearance() && !request.first_only();
  if (comparable && finding_.empty()) CompareSceneWithBatch(request, parts);
}

void ServiceProgram::CompareSceneWithBatch(const v1::FindCollisionsRequest& request,
                                           std::span<const v1::FindCollisionsResponse> parts) {
  v1::BatchCheckCollisionsRequest batch;
  *batch.mutable_placements() = request.placements();
  for (int b = 0; b < request.placements_size(); ++b) {
    for (int a = 0; a < b; ++a) {
      if (!Selects(request, a, b)) continue;
      batch.add_pairs(static_cast<uint32_t>(a));
      batch.add_pairs(static_cast<uint32_t>(b));
    }
  }
  const std::vector<v1::Relation> relations = QueryBatch(batch);
  std::set<std::pair<uint32_t, uint32_t>> expected;
  for (size_t i = 0; i < relations.size(); ++i) {
    const int at = static_cast<int>(2 * i);
    if (IsCollision(relations[i])) expected.emplace(batch.pairs(at), batch.pairs(at + 1));
  }
  std::set<std::pair<uint32_t, uint32_t>> found;
  for (const v1::FindCollisionsResponse& part : parts) {
    for (int row = 0; row < part.columns().relations_size(); ++row) {
      if (IsCollision(part.columns().relations(row))) {
        found.emplace(part.pairs(2 * row), part.pairs(2 * row + 1));
      }
    }
  }
  Reach("FindCollisions compared");
  if (found != expected && finding_.empty()) Note("a scene and a batch disagree");
}

void ServiceProgram::SendRaw() {
  const RawCall call = DecodeRawCall(in_, Hints());
  grpc::ClientContext context;
  CallManner manner;
  manner.raw = true;
  manner.cancelled = LastsUntilCancelled(call.rpc);
  Hurry(context, manner);
  const grpc::Status status = MakeRawCall(*service_.generic_, context, call);
  if (Ended(call.rpc, manner, status) && call.malformed) {
    Note(absl::StrCat(server::RpcName(call.rpc), " accepts bytes that are not a message"));
  }
  if (call.malformed) Reach("malformed message");
  if (ChangesHulls(call.rpc)) all_doubtful_ = true;
  if (call.rpc == Rpc::kPutBody || call.rpc == Rpc::kDeleteBody) bodies_.clear();
}

std::string ServiceProgram::CheckAcknowledged() {
  if (all_doubtful_) return finding_;
  const std::map<std::string, v1::HullInfo> hulls = service_.Hulls();
  for (const auto& [hull_id, known] : hulls_) {
    if (doubtful_.count(hull_id) == 0 && hulls.count(hull_id) == 0) {
      Note(absl::StrCat("hull ", hull_id, " is lost; acknowledged state: ", Known(known)));
    }
  }
  for (const auto& [hull_id, hull] : hulls) SeeKnownHull(hull);
  Reach(doubtful_.empty() ? "all hulls as acknowledged" : "most hulls as acknowledged");
  return finding_;
}

std::string ServiceProgram::CheckGuards() {
  for (const double x : {0.5, 1.0, 2.0}) {
    v1::CheckCollisionRequest request;
    request.mutable_a()->set_hull_id("guard/a");
    request.mutable_b()->set_hull_id("guard/b");
    request.mutable_b()->mutable_pose()->mutable_translation()->set_x(x);
    grpc::ClientContext context;
    context.set_deadline(std::chrono::system_clock::now() + kPatience);
    v1::CheckCollisionResponse response;
    const grpc::Status status = service_.collisions_->CheckCollision(&context, request, &response);
    if (!status.ok()) return "the server no longer answers: " + status.error_message();
    const v1::Relation relation = x < 1    ? v1::RELATION_OVERLAPPING
                                  : x == 1 ? v1::RELATION_TOUCHING
                                           : v1::RELATION_SEPARATED;
    if (response.relation() != relation) return "the guard hulls have changed";
    SeeHeader(response.header());
  }
  grpc::ClientContext context;
  v1::GetStatusResponse response;
  const grpc::Status status = service_.status_->GetStatus(&context, {}, &response);
  if (!status.ok()) return "the server no longer reports its status: " + status.error_message();
  SeeHeader(response.header());
  return finding_;
}

}  // namespace hulld::fuzz
