#include "server/collisions/pair_question.h"

#include <absl/strings/str_cat.h>

#include <set>
#include <string_view>
#include <utility>
#include <vector>

#include "server/collisions/placed/query_settings.h"
#include "server/contract/status_map.h"
#include "server/process/metrics.h"
#include "server/settings/config.h"
#include "server/wire/decode.h"
#include "server/wire/encode.h"

namespace hulld::server {
namespace {

// Steps between two reads of the clock.
constexpr uint64_t kStepsPerAdvance = 64;

// Returns the first error in `resolved`, or OK.
absl::Status FirstProblem(const absl::StatusOr<Resolved>& resolved) {
  if (!resolved.ok()) return resolved.status();
  for (const absl::StatusOr<HullView>& hull : resolved->hulls) {
    if (!hull.ok()) return hull.status();
  }
  return absl::OkStatus();
}

// Stand-in hull if no pair of pieces decided.
const QueryHull& NoHull() {
  static const Hull kNothing;
  static const QueryHull kNoHull(kNothing);
  return kNoHull;
}

// a, b: the deciding hulls; canonical if the answer names vertices.
absl::Status EncodeAnswer(const hulld::Answer& answer, const QueryHull& a, const QueryHull& b,
                          const v1::Wanted& wanted, v1::CheckCollisionResponse* response) {
  response->set_relation(EncodeRelation(answer.relation));
  response->set_rung(EncodeRung(answer.rung));
  if (answer.analysis) {
    EncodeAnalysis(*answer.analysis, a.hull(), b.hull(), response->mutable_analysis());
  }
  if (answer.certificate) {
    EncodeCertificate(*answer.certificate, a.hull(), b.hull(), response->mutable_certificate());
  }
  if (answer.separation) EncodeSeparation(*answer.separation, response->mutable_separation());
  if (answer.witness) EncodeWitness(*answer.witness, response->mutable_witness());
  if (answer.normal) EncodeNormal(*answer.normal, response->mutable_normal());
  if (answer.within_clearance) response->set_within_clearance(*answer.within_clearance);
  if (!wanted.axis() || !answer.axis.has_value()) return absl::OkStatus();
  return EncodeAxis(*answer.axis, a.hull(), b.hull(), response->mutable_axis());
}

void EncodePiece(const Store& store, const PairSide& side, uint32_t piece,
                 v1::DecidingPiece* message) {
  message->set_index(piece);
  EncodeVersion(store, side.view().body->hull_of(piece).record, message->mutable_hull());
}

// Encodes the hulls of all pieces, without duplicates; for a hull, itself; none for an inline
// shape.
void EncodeHulls(const Store& store, const PairSide& side, std::set<std::string_view>* known,
                 v1::CheckCollisionResponse* response) {
  const auto encode = [&](const HullView& view) {
    if (view.record.hull_id.empty()) return;
    if (!known->insert(view.record.hull_id).second) return;
    EncodeVersion(store, view.record, response->add_piece_hulls());
  };
  if (!side.is_body()) return encode(side.view());
  for (const HullView& view : side.view().body->hulls) encode(view);
}

// Encodes the proof of the relation of bodies. RESOURCE_EXHAUSTED: it is too large for a reply.
absl::Status EncodeProof(const Store& store, const std::vector<PieceCertificate>& certificates,
                         const PairSide& a, const PairSide& b,
                         v1::CheckCollisionResponse* response) {
  std::set<std::string_view> known;
  EncodeHulls(store, a, &known, response);
  EncodeHulls(store, b, &known, response);
  size_t bytes = response->ByteSizeLong();
  for (const PieceCertificate& certificate : certificates) {
    // Tag and length.
    constexpr size_t kEntryBytes = 4;
    v1::PieceCertificate* const message = response->add_piece_certificates();
    EncodePieceCertificate(certificate, a.HullOfPiece(certificate.pieces.a).hull(),
                           b.HullOfPiece(certificate.pieces.b).hull(), message);
    bytes += kEntryBytes + message->ByteSizeLong();
    if (bytes > Config::kMaxProofBytes) break;
  }
  if (bytes <= Config::kMaxProofBytes) return absl::OkStatus();
  return ProofTooLarge(certificates.size(), Config::kMaxProofBytes);
}

}  // namespace

PairSide::PairSide(HullView view, const Pose& X_W, double radius, bool canonical, bool as_body)
    : view_(std::move(view)) {
  if (is_body()) {
    body_.emplace(view_.body->query, X_W, radius);
    return;
  }
  const QueryHull& hull =
      canonical ? view_.served->canonical_query_hull() : view_.served->query_hull();
  if (as_body) {
    own_ = std::make_unique<const QueryBody>(hull);
    body_.emplace(*own_, X_W, radius);
  } else {
    hull_.emplace(hull, X_W, radius);
  }
}

absl::StatusOr<std::shared_ptr<PairQuestion>> PairQuestion::Read(Registry& registry,
                                                                 CheckCall* call) {
  std::shared_ptr<PairQuestion> question(new PairQuestion(registry, call));
  if (absl::Status s = question->ReadRequest(); !s.ok()) return s;
  return question;
}

absl::Status PairQuestion::ReadRequest() {
  const v1::CheckCollisionRequest& request = call_->request();
  const Call& call = call_->call();
  absl::StatusOr<QueryOptions> options = MakeQueryOptions(
      request.method(), request.wanted(), request.tolerance(), registry_.limits(), call.lifetime());
  if (!options.ok()) return options.status();
  options_ = *std::move(options);
  if (absl::Status s = ReadPlacement(0, request.has_a(), request.a()); !s.ok()) {
    return Prefixed("a", s);
  }
  if (absl::Status s = ReadPlacement(1, request.has_b(), request.b()); !s.ok()) {
    return Prefixed("b", s);
  }
  if (request.a().has_end_pose() || request.b().has_end_pose()) {
    if (absl::Status s = ReadMotion(); !s.ok()) return s;
  }
  const absl::StatusOr<Freshness> freshness =
      DecodeFreshness(request.freshness(), registry_.store(), call.arrival());
  if (!freshness.ok()) return freshness.status();
  lookup_.plan.freshness = *freshness;
  lookup_.canonical = options_.WantsCanonical();
  lookup_.prefix = call.caller().prefix;
  lookup_.shapes = &shapes_;
  return absl::OkStatus();
}

absl::Status PairQuestion::ReadPlacement(size_t side, bool present,
                                         const v1::Placement& placement) {
  if (!present) return absl::InvalidArgumentError(" is missing; give a hull ID or points");
  subjects_[side] = placement.has_points() ? shapes_.size() : ids_.size();
  const absl::Status named = CheckSubject(call_->call().caller(), placement, &shapes_);
  if (!named.ok()) return Prefixed(".", named);
  if (!placement.has_points()) ids_.push_back(placement.hull_id());
  const absl::StatusOr<Pose> pose = DecodePose(placement.pose());
  if (!pose.ok()) return Prefixed(".pose.", pose.status());
  X_W_[side] = *pose;
  radii_[side] = placement.radius();
  if (absl::Status s = ValidateRadius(radii_[side]); !s.ok()) return Prefixed(".radius", s);
  if (is_textbook() && radii_[side] > 0) {
    return absl::InvalidArgumentError(absl::StrCat(
        ".radius is ", radii_[side],
        ", but METHOD_TEXTBOOK_SAT applies to hulls without a radius; leave out one of "
        "them"));
  }
  return absl::OkStatus();
}

// Requires valid poses.
absl::Status PairQuestion::ReadMotion() {
  const v1::CheckCollisionRequest& request = call_->request();
  if (absl::Status s = ValidateForMotions(options_); !s.ok()) return s;
  const absl::StatusOr<Motion> a = DecodeMotion(X_W_[0], request.a());
  if (!a.ok()) return Prefixed("a.", a.status());
  const absl::StatusOr<Motion> b = DecodeMotion(X_W_[1], request.b());
  if (!b.ok()) return Prefixed("b.", b.status());
  motion_.emplace();
  motion_->X_W = {*a, *b};
  motion_->options = MakeMotionOptions(request.wanted(), options_);
  return absl::OkStatus();
}

void PairQuestion::Answer(absl::StatusOr<Resolved> resolved, TaskPool& pool) {
  absl::Status status = FirstProblem(resolved);
  if (status.ok()) status = Place(*std::move(resolved));
  if (!status.ok()) return call_->End(status);
  // Answers of a client with many calls take turns in the pool, because gRPC's threads take calls
  // in the order of arrival.
  if (IsQuick() && !call_->call().is_one_of_many()) return RunSlice(pool);
  pool.Submit([self = shared_from_this(), &pool] { self->RunSlice(pool); }, call_->call().client());
}

absl::Status PairQuestion::Place(Resolved resolved) {
  const v1::CheckCollisionRequest& request = call_->request();
  HullView& a = *resolved.hulls[subjects_[0] + (request.a().has_points() ? ids_.size() : 0)];
  HullView& b = *resolved.hulls[subjects_[1] + (request.b().has_points() ? ids_.size() : 0)];
  has_body_ = a.body != nullptr || b.body != nullptr;
  if (has_body_) {
    if (absl::Status s = ValidateForBodies(options_); !s.ok()) return s;
  }
  v1::CheckCollisionResponse& response = call_->response();
  EncodeHeader(registry_.store(), resolved.as_of(), response.mutable_header());
  EncodeVersion(registry_.store(), a.record, response.mutable_hull_a());
  EncodeVersion(registry_.store(), b.record, response.mutable_hull_b());
  a_.emplace(std::move(a), X_W_[0], radii_[0], lookup_.canonical, has_body_);
  b_.emplace(std::move(b), X_W_[1], radii_[1], lookup_.canonical, has_body_);
  return absl::OkStatus();
}

// True if the answer may be found on a thread of gRPC.
bool PairQuestion::IsQuick() const {
  return !has_body_ && !motion_.has_value() && !is_textbook() && options_.WantsRelationOnly() &&
         IsQuickToRelate(a_->hull().query_hull()) && IsQuickToRelate(b_->hull().query_hull());
}

void PairQuestion::RunSlice(TaskPool& pool) {
  const absl::StatusOr<bool> is_answered =
      Advance(std::chrono::steady_clock::now() + TaskPool::kSliceTime);
  if (!is_answered.ok()) return call_->End(is_answered.status());
  if (*is_answered) return call_->End(Encode());
  if (!lane_.has_value()) lane_.emplace(pool);
  lane_->Submit([self = shared_from_this(), &pool] { self->RunSlice(pool); },
                call_->call().client());
}

absl::StatusOr<bool> PairQuestion::Advance(std::chrono::steady_clock::time_point end) {
  if (motion_.has_value()) return has_body_ ? AdvanceMovingBodies(end) : AdvanceMotion();
  if (has_body_) return AdvanceBodies(end);
  if (is_textbook()) return AdvanceTextbook(end);
  absl::StatusOr<hulld::Answer> found = CheckCollision(a_->hull(), b_->hull(), options_);
  if (!found.ok()) return NameQueryLimit(found.status(), options_);
  answer_.answer = *std::move(found);
  return true;
}

absl::StatusOr<bool> PairQuestion::AdvanceMotion() {
  absl::StatusOr<FirstContact> found =
      FindFirstContact({a_->hull().query_hull(), motion_->X_W[0], radii_[0]},
                       {b_->hull().query_hull(), motion_->X_W[1], radii_[1]}, motion_->options);
  if (!found.ok()) return found.status();
  motion_->contact = *std::move(found);
  return true;
}

absl::StatusOr<bool> PairQuestion::AdvanceMovingBodies(std::chrono::steady_clock::time_point end) {
  MotionQuestion& motion = *motion_;
  if (motion.search == nullptr) {
    motion.bodies.reserve(2);
    motion.bodies.push_back({a_->body().body(), motion.X_W[0], radii_[0]});
    motion.bodies.push_back({b_->body().body(), motion.X_W[1], radii_[1]});
    motion.search =
        std::make_unique<MovingBodySearch>(motion.bodies[0], motion.bodies[1], motion.options);
  }
  do {
    // A step takes some microseconds at least.
    const absl::StatusOr<bool> has_ended = motion.search->Advance(1);
    if (!has_ended.ok()) {
      return NameProofLimit(has_ended.status(), registry_.limits().request_memory);
    }
    if (!*has_ended) continue;
    BodyContact found = motion.search->Take();
    motion.contact = std::move(found.contact);
    static_cast<PiecesAnswer&>(answer_) = std::move(found.of_body);
    return true;
  } while (std::chrono::steady_clock::now() < end);
  return false;
}

absl::StatusOr<bool> PairQuestion::AdvanceTextbook(std::chrono::steady_clock::time_point end) {
  if (!check_.has_value()) {
    if (HoldsMuchForTextbook(a_->hull(), b_->hull())) {
      if (absl::Status s = registry_.CheckMemory(MemoryUse::kReading); !s.ok()) return s;
    }
    absl::StatusOr<TextbookCheck> begun = TextbookCheck::Begin(a_->hull(), b_->hull(), options_);
    if (!begun.ok()) return NameQueryLimit(begun.status(), options_);
    check_ = *std::move(begun);
  }
  absl::StatusOr<bool> is_done = check_->Advance(end);
  charge_.Set(check_->MemoryBytes());
  if (!is_done.ok() || !*is_done) return is_done;
  absl::StatusOr<hulld::Answer> found = check_->Finish();
  if (!found.ok()) return NameQueryLimit(found.status(), options_);
  answer_.answer = *std::move(found);
  return true;
}

absl::StatusOr<bool> PairQuestion::AdvanceBodies(std::chrono::steady_clock::time_point end) {
  if (!search_.has_value()) search_.emplace(a_->body(), b_->body(), options_);
  do {
    const absl::StatusOr<bool> has_ended = search_->Advance(kStepsPerAdvance);
    if (!has_ended.ok())
      return NameProofLimit(has_ended.status(), registry_.limits().request_memory);
    if (!*has_ended) continue;
    absl::StatusOr<BodyAnswer> found = search_->Take();
    if (!found.ok()) return NameProofLimit(found.status(), registry_.limits().request_memory);
    answer_ = *std::move(found);
    return true;
  } while (std::chrono::steady_clock::now() < end);
  return false;
}

void PairQuestion::EncodePieces() {
  if (!answer_.pieces.has_value()) return;
  v1::CheckCollisionResponse& response = call_->response();
  const PiecePair pieces = *answer_.pieces;
  if (a_->is_body()) EncodePiece(registry_.store(), *a_, pieces.a, response.mutable_piece_a());
  if (b_->is_body()) EncodePiece(registry_.store(), *b_, pieces.b, response.mutable_piece_b());
}

absl::Status PairQuestion::EncodeMotion() {
  const FirstContact& contact = motion_->contact;
  v1::CheckCollisionResponse& response = call_->response();
  response.set_relation(EncodeRelation(contact.relation));
  EncodeFirstContact(contact, response.mutable_first_contact());
  if (has_body_) {
    EncodePieces();
    if (!motion_->options.want_certificate) return absl::OkStatus();
    return EncodeProof(registry_.store(), answer_.certificates, *a_, *b_, &response);
  }
  if (!contact.certificate.has_value()) return absl::OkStatus();
  EncodeCertificate(*contact.certificate, a_->hull().query_hull().hull(),
                    b_->hull().query_hull().hull(), response.mutable_certificate());
  return absl::OkStatus();
}

absl::Status PairQuestion::Encode() {
  if (motion_.has_value()) return EncodeMotion();
  RungCounts counts;
  counts.Add(answer_.answer.rung);
  call_->call().metrics().CountPairs(counts);
  const v1::Wanted& wanted = call_->request().wanted();
  v1::CheckCollisionResponse* const response = &call_->response();
  if (!has_body_) {
    return EncodeAnswer(answer_.answer, a_->hull().query_hull(), b_->hull().query_hull(), wanted,
                        response);
  }
  EncodePieces();
  const QueryHull* hull_a = &NoHull();
  const QueryHull* hull_b = &NoHull();
  if (answer_.pieces.has_value()) {
    hull_a = &a_->HullOfPiece(answer_.pieces->a);
    hull_b = &b_->HullOfPiece(answer_.pieces->b);
  }
  const absl::Status encoded = EncodeAnswer(answer_.answer, *hull_a, *hull_b, wanted, response);
  if (!encoded.ok() || !wanted.certificate()) return encoded;
  return EncodeProof(registry_.store(), answer_.certificates, *a_, *b_, response);
}

}  // namespace hulld::server
