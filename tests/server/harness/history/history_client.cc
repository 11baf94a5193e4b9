#include "tests/server/harness/history/history_client.h"

#include <algorithm>
#include <utility>

#include "tests/server/harness/history/answers.h"
#include "tests/server/harness/history/hull_specification.h"

namespace hulld::server {
namespace {

using Kind = Operation::Kind;
using Outcome = Operation::Outcome;

Outcome OutcomeOf(const grpc::Status& status) {
  switch (status.error_code()) {
    case grpc::StatusCode::OK:
      return Outcome::kOk;
    case grpc::StatusCode::NOT_FOUND:
      return Outcome::kNotFound;
    case grpc::StatusCode::ALREADY_EXISTS:
      return Outcome::kAlreadyExists;
    case grpc::StatusCode::ABORTED:
      return Outcome::kAborted;
    default:
      return Outcome::kUnknown;
  }
}

void TakeRecord(const v1::HullInfo& hull, Operation& operation) {
  operation.create_revision = hull.create_revision();
  operation.revision = hull.revision();
  operation.vertex_count = hull.vertex_count();
  operation.received = hull.counts().received();
  operation.outside = hull.counts().outside();
  operation.duplicate = hull.counts().duplicate();
}

void TakeAck(const v1::AppendAck& ack, Operation& operation) {
  operation.already_applied = ack.outcome() == v1::APPEND_OUTCOME_ALREADY_APPLIED;
  operation.revision = ack.hull_revision();
  operation.vertex_count = ack.vertex_count();
  operation.received = ack.counts().received();
  operation.outside = ack.counts().outside();
  operation.duplicate = ack.counts().duplicate();
}

// Returns the number of this point in the cloud, or -1.
int NumberOf(const double* xyz) {
  const Coordinates& cloud = HistoryCloud();
  for (int i = 0; i < kCloudSize; ++i) {
    if (std::equal(xyz, xyz + 3, cloud.data() + 3 * i)) return i;
  }
  return -1;
}

}  // namespace

const Coordinates& HistoryCloud() {
  static const Coordinates cloud = Sphere(kCloudSize);
  return cloud;
}

HistoryClient::HistoryClient(const std::shared_ptr<grpc::Channel>& channel, HullHistory& history,
                             std::string name, uint64_t seed)
    : history_(history), name_(std::move(name)), random_(seed) {
  Connect(channel);
}

void HistoryClient::Connect(const std::shared_ptr<grpc::Channel>& channel) {
  streams_.clear();
  collision_stream_ = nullptr;
  hulls_ = v1::HullService::NewStub(channel);
  bodies_ = v1::BodyService::NewStub(channel);
  collisions_ = v1::CollisionService::NewStub(channel);
}

void HistoryClient::MakeProbe() {
  Appender appender(*hulls_, kProbeHull, "probe", true);
  if (appender.opened().last_sequence() == 0) {
    ASSERT_TRUE(appender.Append(1, {0, 0, 0}).has_value());
  }
  const grpc::Status status = appender.Finish();
  ASSERT_TRUE(status.ok()) << status.error_message();
}

bool HistoryClient::CallAtRandom(const std::string& hull_id) {
  return Below(100) < 45 ? ChangeAtRandom(hull_id) : ReadAtRandom(hull_id);
}

bool HistoryClient::ChangeAtRandom(const std::string& hull_id) {
  const int choice = Below(45);
  if (choice < 5) return Create(hull_id, Below(2) == 0);
  if (choice < 8) return Delete(hull_id, Below(2) == 0);
  if (choice < 14) return Replace(hull_id);
  if (choice < 20) return AppendAtOnce(hull_id);
  return Append(hull_id);
}

bool HistoryClient::ReadAtRandom(const std::string& hull_id) {
  const int choice = Below(55);
  if (choice < 20) return Get(hull_id);
  if (choice < 35) return Mesh(hull_id);
  return Probe(hull_id);
}

Operation HistoryClient::Begin(Kind kind) {
  Operation operation;
  operation.kind = kind;
  operation.writer = name_;
  operation.invoked = history_.Tick();
  return operation;
}

bool HistoryClient::End(const std::string& hull_id, Operation& operation,
                        const grpc::Status& status) {
  operation.outcome = OutcomeOf(status);
  const bool read = IsRead(operation);
  if (operation.outcome == Outcome::kUnknown) {
    // The incarnation is gone: all its effects precede this answer.
    const bool gone = status.error_code() == grpc::StatusCode::FAILED_PRECONDITION;
    if (gone) operation.returned = history_.Tick();
    // Every revision requested comes from an earlier answer.
    EXPECT_FALSE(read && gone) << "hull " << hull_id << ": " << status.error_message();
    // An unanswered read carries no information.
    if (!read) history_.Record(hull_id, operation);
    return status.error_code() != grpc::StatusCode::UNAVAILABLE;
  }
  operation.returned = history_.Tick();
  history_.Record(hull_id, operation);
  if (operation.outcome == Outcome::kOk) revisions_[hull_id] = operation.revision;
  return true;
}

void HistoryClient::ChooseFreshness(Operation& operation, v1::Freshness& freshness) {
  constexpr int kMaxMilliseconds = 50;
  if (!any_freshness_) return;
  const bool is_at_least = Below(2) == 0 && last_header_.revision() > 0;
  const bool is_bounded = Below(2) == 0;
  if (is_at_least) {
    freshness.set_at_least_revision(last_header_.revision());
    freshness.set_store_id(last_header_.store_id());
    operation.at_least_revision = last_header_.revision();
  }
  if (is_bounded) {
    const int nanos = 1'000'000 * (1 + Below(kMaxMilliseconds));
    freshness.mutable_max_staleness()->set_nanos(nanos);
    operation.max_staleness = nanos;
  } else if (is_at_least) {
    operation.max_staleness = std::nullopt;
  }
}

void HistoryClient::ChooseFreshnessOfSeveral(Operation& operation, v1::Freshness& freshness) {
  if (any_freshness_ && Below(2) == 0) ChooseFreshness(operation, freshness);
}

void HistoryClient::TakeHeader(const v1::ResponseHeader& header, Operation& operation) {
  operation.store_revision = header.revision();
  operation.store_id = header.store_id();
  operation.staleness = static_cast<uint64_t>(1'000'000'000 * header.staleness().seconds() +
                                              header.staleness().nanos());
  if (header.revision() > 0) last_header_ = header;
}

std::optional<uint64_t> HistoryClient::SomeRevision(const std::string& hull_id) {
  const auto known = revisions_.find(hull_id);
  if (known == revisions_.end() || Below(4) != 0) return std::nullopt;
  return known->second;
}

bool HistoryClient::Create(const std::string& hull_id, bool if_absent) {
  Operation operation = Begin(Kind::kCreate);
  operation.if_absent = if_absent;
  v1::CreateHullRequest request;
  v1::CreateHullResponse response;
  request.set_hull_id(hull_id);
  request.set_if_absent(if_absent);
  const grpc::Status status = hulls_->CreateHull(NewContext().get(), request, &response);
  TakeRecord(response.hull(), operation);
  operation.created = response.created();
  TakeHeader(response.header(), operation);
  return End(hull_id, operation, status);
}

Coordinates HistoryClient::SomePoints(int count, Operation& operation) {
  Coordinates xyz;
  for (int i = 0; i < count; ++i) {
    const int point = Below(kCloudSize);
    operation.points |= PointSet{1} << point;
    const double* from = HistoryCloud().data() + 3 * point;
    xyz.insert(xyz.end(), from, from + 3);
  }
  operation.sent += static_cast<uint64_t>(count);
  return xyz;
}

HistoryClient::Stream* HistoryClient::OpenStream(const std::string& hull_id, bool* answered) {
  Operation operation = Begin(Kind::kOpen);
  operation.if_absent = Below(2) == 0;
  Stream stream;
  stream.appender = std::make_unique<Appender>(*hulls_, hull_id, name_, operation.if_absent);
  if (!stream.appender->is_open()) {
    *answered = End(hull_id, operation, stream.appender->Finish());
    return nullptr;
  }
  const v1::AppendOpened& opened = stream.appender->opened();
  TakeRecord(opened.hull(), operation);
  operation.last_sequence = opened.last_sequence();
  TakeHeader(opened.header(), operation);
  stream.incarnation = operation.create_revision;
  stream.next_sequence = operation.last_sequence + 1;
  *answered = End(hull_id, operation, grpc::Status::OK);
  return &(streams_[hull_id] = std::move(stream));
}

bool HistoryClient::Append(const std::string& hull_id) {
  const auto open = streams_.find(hull_id);
  bool answered = true;
  Stream* stream = open != streams_.end() ? &open->second : OpenStream(hull_id, &answered);
  if (stream == nullptr) return answered;

  Operation operation = Begin(Kind::kAppend);
  operation.incarnation = stream->incarnation;
  operation.sequence = stream->next_sequence;
  operation.if_revision = SomeRevision(hull_id);
  const Coordinates xyz = SomePoints(1 + Below(3), operation);
  // Occasionally resends a chunk, like a client that lost an ack.
  if (operation.sequence > 1 && Below(8) == 0) --operation.sequence;
  const std::optional<v1::AppendAck> ack =
      stream->appender->Append(operation.sequence, xyz, operation.if_revision);
  if (!ack.has_value()) {
    answered = End(hull_id, operation, stream->appender->Finish());
    streams_.erase(hull_id);
    return answered;
  }
  stream->next_sequence = operation.sequence + 1;
  TakeHeader(ack->header(), operation);
  TakeAck(*ack, operation);
  return End(hull_id, operation, grpc::Status::OK);
}

bool HistoryClient::AppendAtOnce(const std::string& hull_id) {
  const auto open = streams_.find(hull_id);
  bool answered = true;
  Stream* stream = open != streams_.end() ? &open->second : OpenStream(hull_id, &answered);
  if (stream == nullptr) return answered;

  std::vector<Operation> sent;
  for (int chunks = 2 + Below(3); chunks > 0; --chunks) {
    Operation operation = Begin(Kind::kAppend);
    operation.incarnation = stream->incarnation;
    operation.sequence = stream->next_sequence++;
    const Coordinates xyz = SomePoints(1 + Below(3), operation);
    sent.push_back(operation);
    stream->appender->Send(ChunkMessage(operation.sequence, xyz));
  }
  size_t next = 0;
  while (next < sent.size()) {
    const std::optional<v1::AppendAck> ack = stream->appender->ReadAck();
    if (!ack.has_value()) {
      const grpc::Status status = stream->appender->Finish();
      streams_.erase(hull_id);
      for (; next < sent.size(); ++next) answered = End(hull_id, sent[next], status);
      return answered;
    }
    // One ack may cover several chunks.
    const size_t first = next;
    while (next < sent.size() && sent[next].sequence <= ack->sequence()) ++next;
    if (next == first) {
      ADD_FAILURE() << "sequence " << ack->sequence() << " of " << hull_id << " occurs twice";
      streams_.erase(hull_id);
      return true;
    }
    for (size_t i = first; i + 1 < next; ++i) {
      TakeHeader(ack->header(), sent[i]);
      sent[i].shares_later_ack = true;
      sent[i].outcome = Outcome::kOk;
      sent[i].returned = history_.Tick();
      history_.Record(hull_id, sent[i]);
    }
    Operation& last = sent[next - 1];
    TakeHeader(ack->header(), last);
    TakeAck(*ack, last);
    last.covers_earlier_chunks = next - first > 1;
    End(hull_id, last, grpc::Status::OK);
  }
  return true;
}

bool HistoryClient::Replace(const std::string& hull_id) {
  Operation operation = Begin(Kind::kReplace);
  operation.if_absent = Below(2) == 0;
  operation.if_revision = SomeRevision(hull_id);
  if (!operation.if_revision && Below(8) == 0) operation.if_revision = 0;
  const bool cut_short = Below(6) == 0;
  const bool cancelled = !cut_short && Below(12) == 0;

  const std::unique_ptr<grpc::ClientContext> context = NewContext();
  v1::ReplaceHullResponse response;
  const auto writer = hulls_->ReplaceHull(context.get(), &response);
  v1::ReplaceHullRequest request;
  request.mutable_open()->set_hull_id(hull_id);
  request.mutable_open()->set_create_if_absent(operation.if_absent);
  if (operation.if_revision) request.mutable_open()->set_if_revision(*operation.if_revision);
  bool going = writer->Write(request);
  for (int blocks = 1 + Below(3); blocks > 0; --blocks) {
    const Coordinates xyz = SomePoints(1 + Below(4), operation);
    request.mutable_points()->mutable_xyz()->Assign(xyz.begin(), xyz.end());
    going = going && writer->Write(request);
  }
  request.mutable_points()->clear_xyz();
  if (!cut_short) going = going && writer->Write(request);
  if (going) writer->WritesDone();
  if (cancelled) context->TryCancel();
  const grpc::Status status = writer->Finish();
  if (cut_short) {
    // Not recorded: any effect would be visible and unexplained.
    EXPECT_FALSE(status.ok()) << "a stream that was cut short replaced hull " << hull_id;
    return status.error_code() != grpc::StatusCode::UNAVAILABLE;
  }
  TakeRecord(response.hull(), operation);
  operation.created = response.created();
  TakeHeader(response.header(), operation);
  return End(hull_id, operation, status);
}

template <typename Response, typename Request, typename Call>
bool HistoryClient::DeleteAs(const std::string& id, bool if_known_revision, Request request,
                             const Call& call) {
  Operation operation = Begin(Kind::kDelete);
  const auto known = revisions_.find(id);
  if (if_known_revision && known != revisions_.end()) operation.if_revision = known->second;
  if (operation.if_revision) request.set_if_revision(*operation.if_revision);
  Response response;
  const grpc::Status status = call(NewContext().get(), request, &response);
  TakeHeader(response.header(), operation);
  operation.revision = operation.store_revision;
  return End(id, operation, status);
}

bool HistoryClient::Delete(const std::string& hull_id, bool if_known_revision) {
  v1::DeleteHullRequest request;
  request.set_hull_id(hull_id);
  return DeleteAs<v1::DeleteHullResponse>(
      hull_id, if_known_revision, request,
      [this](auto... arguments) { return hulls_->DeleteHull(arguments...); });
}

bool HistoryClient::Get(const std::string& hull_id) {
  Operation operation = Begin(Kind::kGet);
  v1::GetHullRequest request;
  v1::GetHullResponse response;
  request.set_hull_id(hull_id);
  ChooseFreshness(operation, *request.mutable_freshness());
  const grpc::Status status = hulls_->GetHull(NewContext().get(), request, &response);
  TakeRecord(response.hull(), operation);
  TakeHeader(response.header(), operation);
  return End(hull_id, operation, status);
}

bool HistoryClient::Mesh(const std::string& hull_id) {
  Operation operation = Begin(Kind::kMesh);
  v1::GetHullMeshRequest request;
  request.set_hull_id(hull_id);
  ChooseFreshness(operation, *request.mutable_freshness());
  const std::unique_ptr<grpc::ClientContext> context = NewContext();
  const auto reader = hulls_->GetHullMesh(context.get(), request);
  v1::GetHullMeshResponse part;
  while (reader->Read(&part)) {
    if (part.has_header()) {
      TakeRecord(part.header().hull(), operation);
      TakeHeader(part.header().header(), operation);
    }
    const auto& xyz = part.vertices().xyz();
    for (int i = 0; i + 2 < xyz.size(); i += 3) {
      const int point = NumberOf(xyz.data() + i);
      EXPECT_GE(point, 0) << "hull " << hull_id << " has a vertex that no client sent";
      operation.points |= PointSet{1} << point;
    }
  }
  return End(hull_id, operation, reader->Finish());
}

bool HistoryClient::Probe(const std::string& hull_id) {
  Operation operation = Begin(Kind::kProbe);
  operation.probe = Below(kCloudSize);
  const double* at = HistoryCloud().data() + 3 * operation.probe;
  v1::CheckCollisionRequest request;
  v1::CheckCollisionResponse response;
  *request.mutable_a() = PlacementOf(hull_id);
  *request.mutable_b() = PlacementOf(kProbeHull, at[0], at[1], at[2]);
  ChooseFreshness(operation, *request.mutable_freshness());
  const grpc::Status status = collisions_->CheckCollision(NewContext().get(), request, &response);
  operation.revision = response.hull_a().revision();
  TakeHeader(response.header(), operation);
  operation.touching = response.relation() == v1::RELATION_TOUCHING;
  return End(hull_id, operation, status);
}

bool HistoryClient::Pair(const std::string& hull_id, const std::string& other) {
  Operation operation = Begin(Kind::kPair);
  v1::CheckCollisionRequest request;
  v1::CheckCollisionResponse response;
  *request.mutable_a() = PlacementOf(hull_id);
  *request.mutable_b() = PlacementOf(other);
  ChooseFreshnessOfSeveral(operation, *request.mutable_freshness());
  Seen seen{.hull_id = other, .at_least_revision = request.freshness().at_least_revision()};
  const grpc::Status status = collisions_->CheckCollision(NewContext().get(), request, &response);
  operation.create_revision = response.hull_a().create_revision();
  operation.revision = response.hull_a().revision();
  TakeHeader(response.header(), operation);
  TakeVersion(response.hull_b(), response.header(), seen);
  operation.others = {seen};
  return End(hull_id, operation, status);
}

bool HistoryClient::CallBodyAtRandom(const std::string& body_id,
                                     const std::vector<std::string>& hulls) {
  const int choice = Below(20);
  if (choice < 5) return PutBody(body_id, hulls);
  if (choice < 6) return DeleteBody(body_id, Below(2) == 0);
  if (choice < 9) return GetBody(body_id);
  return QueryBody(body_id);
}

bool HistoryClient::PutBody(const std::string& body_id, const std::vector<std::string>& hulls) {
  Operation operation = Begin(Kind::kPut);
  operation.if_revision = SomeRevision(body_id);
  if (!operation.if_revision && Below(8) == 0) operation.if_revision = 0;
  v1::PutBodyRequest request;
  v1::PutBodyResponse response;
  request.set_body_id(body_id);
  if (operation.if_revision) request.set_if_revision(*operation.if_revision);
  const int chosen = 1 + Below((1 << hulls.size()) - 1);
  for (size_t i = 0; i < hulls.size(); ++i) {
    if ((chosen >> i & 1) == 0) continue;
    operation.pieces.push_back(hulls[i]);
    *request.add_pieces() = PlacementOf(hulls[i]);
  }
  const grpc::Status status = bodies_->PutBody(NewContext().get(), request, &response);
  operation.create_revision = response.body().create_revision();
  operation.revision = response.body().revision();
  operation.created = response.created();
  TakeHeader(response.header(), operation);
  return End(body_id, operation, status);
}

bool HistoryClient::DeleteBody(const std::string& body_id, bool if_known_revision) {
  v1::DeleteBodyRequest request;
  request.set_body_id(body_id);
  return DeleteAs<v1::DeleteBodyResponse>(
      body_id, if_known_revision, request,
      [this](auto... arguments) { return bodies_->DeleteBody(arguments...); });
}

bool HistoryClient::GetBody(const std::string& body_id) {
  Operation operation = Begin(Kind::kGetBody);
  v1::GetBodyRequest request;
  v1::GetBodyResponse response;
  request.set_body_id(body_id);
  ChooseFreshness(operation, *request.mutable_freshness());
  const grpc::Status status = bodies_->GetBody(NewContext().get(), request, &response);
  operation.create_revision = response.body().create_revision();
  operation.revision = response.body().revision();
  for (const v1::Placement& piece : response.pieces()) operation.pieces.push_back(piece.hull_id());
  TakeHeader(response.header(), operation);
  return End(body_id, operation, status);
}

bool HistoryClient::QueryBody(const std::string& body_id) {
  Operation operation = Begin(Kind::kBodyQuery);
  operation.probe = Below(kCloudSize);
  const double* at = HistoryCloud().data() + 3 * operation.probe;
  v1::CheckCollisionRequest request;
  v1::CheckCollisionResponse response;
  *request.mutable_a() = PlacementOf(body_id);
  *request.mutable_b() = PlacementOf(kProbeHull, at[0], at[1], at[2]);
  ChooseFreshnessOfSeveral(operation, *request.mutable_freshness());
  // A certificate names the hulls of all pieces; without one, the server looks them up differently.
  operation.lists_pieces = Below(2) == 0;
  request.mutable_wanted()->set_certificate(operation.lists_pieces);
  const grpc::Status status = collisions_->CheckCollision(NewContext().get(), request, &response);
  operation.create_revision = response.hull_a().create_revision();
  operation.revision = response.hull_a().revision();
  operation.touching = response.relation() == v1::RELATION_TOUCHING;
  TakeHeader(response.header(), operation);
  if (operation.touching) operation.deciding = response.piece_a().hull().hull_id();
  const auto take = [&](const v1::HullVersion& version) {
    Seen seen{.hull_id = version.hull_id(),
              .at_least_revision = request.freshness().at_least_revision()};
    TakeVersion(version, response.header(), seen);
    operation.others.push_back(seen);
  };
  if (operation.lists_pieces) {
    for (const v1::HullVersion& version : response.piece_hulls()) {
      if (version.hull_id() == kProbeHull) continue;
      operation.pieces.push_back(version.hull_id());
      take(version);
    }
  } else if (operation.touching) {
    take(response.piece_a().hull());
  }
  if (status.error_code() == grpc::StatusCode::NOT_FOUND) {
    operation.missing = MissingPiece(status.error_message());
  }
  return End(body_id, operation, status);
}

}  // namespace hulld::server
