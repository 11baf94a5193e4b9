#include "server/collisions/placed/placed_answer.h"

#include <utility>

#include "core/base/status_macros.h"
#include "server/collisions/placed/query_settings.h"
#include "server/settings/config.h"
#include "server/wire/answer_columns.h"
#include "server/wire/encode.h"

namespace hulld::server {
namespace {

// Two indices as varints.
constexpr size_t kPiecesBytes = 10;
// Tag and length of a proof within its message, and its row index.
constexpr size_t kProofBytes = 10;
// Steps of a search of bodies between two reads of the clock. A step for moving bodies takes at
// least a few microseconds.
constexpr uint64_t kStepsAtRest = 64;
constexpr uint64_t kStepsInMotion = 1;

// Returns true if a placement is a body. The query then takes about as long as many pairs of hulls.
bool HasBody(const PlacementTable& table, uint32_t a, uint32_t b) {
  return table.is_body(a) || table.is_body(b);
}

absl::StatusOr<Answer> QueryHulls(const PlacementTable& table, uint32_t a, uint32_t b,
                                  const QueryOptions& options, PairCache* cache) {
  std::optional<PlacedHull> made_a;
  std::optional<PlacedHull> made_b;
  return CheckCollision(table.PlacedAt(a, &made_a), table.PlacedAt(b, &made_b), options, cache);
}

// Adds the deciding pieces of a row in a call with bodies.
size_t AddPieces(const PlacementTable& table, uint32_t a, uint32_t b,
                 const std::optional<PiecePair>& pieces, v1::AnswerColumns* columns) {
  if (!table.has_bodies()) return 0;
  const auto index = [&](uint32_t placement, uint32_t piece) {
    return table.is_body(placement) ? static_cast<int32_t>(piece) : -1;
  };
  columns->add_pieces(pieces ? index(a, pieces->a) : -1);
  columns->add_pieces(pieces ? index(b, pieces->b) : -1);
  return kPiecesBytes;
}

// Adds the row of an answer, without its pieces and their certificates.
size_t AddRow(const PlacementTable& table, uint32_t a, uint32_t b, const PlacedAnswer& answer,
              const v1::Wanted& wanted, v1::AnswerColumns* columns) {
  const PiecePair pieces = answer.of_body.pieces.value_or(PiecePair{0, 0});
  const QueryHull& hull_a = table.HullOfPiece(a, pieces.a);
  const QueryHull& hull_b = table.HullOfPiece(b, pieces.b);
  if (answer.contact.has_value()) {
    return AddFirstContact(*answer.contact, hull_a, hull_b, wanted, columns);
  }
  const size_t bytes = AddAnswer(answer.answer, hull_a, hull_b, wanted, columns);
  return table.has_motions() ? bytes + AddNoTimes(columns) : bytes;
}

// Adds the row of a pair with a body and its certificates. Encodes the proof separately, because it
// may turn out to be too large.
size_t AddProvenAnswer(const PlacementTable& table, uint32_t a, uint32_t b,
                       const PlacedAnswer& answer, const v1::Wanted& wanted,
                       v1::AnswerColumns* columns) {
  v1::AnswerColumns row;
  size_t bytes = AddRow(table, a, b, answer, wanted, &row);
  v1::PieceProof* const proof = row.add_piece_proofs();
  bytes += kProofBytes + AddCertificates(table, a, b, answer.of_body.certificates,
                                         Config::kMaxRowProofBytes, proof->mutable_certificates());
  bool is_answered = row.pair_problems_size() == 0;
  if (is_answered && bytes > Config::kMaxRowProofBytes) {
    row.Clear();
    const absl::Status too_large =
        ProofTooLarge(answer.of_body.certificates.size(), Config::kMaxRowProofBytes);
    bytes = AddRow(table, a, b, {too_large}, wanted, &row);
    is_answered = false;
  }
  const auto number = static_cast<uint64_t>(columns->relations_size());
  if (is_answered) {
    proof->set_row(number);
  } else {
    row.clear_piece_proofs();
    row.mutable_pair_problems(0)->set_row(number);
  }
  columns->MergeFrom(row);
  return bytes +
         AddPieces(table, a, b, is_answered ? answer.of_body.pieces : std::nullopt, columns);
}

}  // namespace

absl::Status PairSearch::CheckMemory(Registry& registry) const {
  // About 400 bytes each.
  constexpr size_t kMaxVertices = 4096;
  if (options_.method != Method::kTextbookSat || HasBody(table_, a_, b_)) return absl::OkStatus();
  const size_t vertices =
      table_.placed()[a_].hull().vertices().size() + table_.placed()[b_].hull().vertices().size();
  return vertices > kMaxVertices ? registry.CheckMemory(MemoryUse::kReading) : absl::OkStatus();
}

bool PairSearch::Advance(Clock::time_point end) {
  absl::StatusOr<bool> is_known = false;
  if (std::holds_alternative<std::monostate>(search_)) is_known = Begin();
  if (is_known.ok() && !*is_known) is_known = Continue(end);
  if (is_known.ok() && !*is_known) return false;
  if (!is_known.ok()) answer_.answer = is_known.status();
  if (!answer_.answer.ok()) answer_.answer = NameLimit(answer_.answer.status(), options_);
  return true;
}

absl::StatusOr<bool> PairSearch::Begin() {
  if (HasBody(table_, a_, b_)) {
    if (table_.has_motions()) {
      search_.emplace<MovingBodies>(table_, a_, b_, motion_);
      return false;
    }
    HULLD_RETURN_IF_ERROR(ValidateForBodies(options_));
    search_.emplace<BodySearch>(table_.bodies()[a_], table_.bodies()[b_], options_);
    return false;
  }
  if (table_.has_motions()) {
    HULLD_ASSIGN_OR_RETURN(FirstContact contact,
                           FindFirstContact(table_.MovingAt(a_), table_.MovingAt(b_), motion_));
    Take(std::move(contact), {});
    return true;
  }
  if (options_.method == Method::kTextbookSat) {
    HULLD_ASSIGN_OR_RETURN(
        search_, TextbookCheck::Begin(table_.placed()[a_], table_.placed()[b_], options_));
    return false;
  }
  answer_.answer = QueryHulls(table_, a_, b_, options_, nullptr);
  return true;
}

absl::StatusOr<bool> PairSearch::Continue(Clock::time_point end) {
  if (auto* const check = std::get_if<TextbookCheck>(&search_)) {
    const absl::StatusOr<bool> is_known = check->Advance(end);
    if (is_known.ok() && *is_known) answer_.answer = check->Finish();
    return is_known;
  }
  auto* const at_rest = std::get_if<BodySearch>(&search_);
  absl::StatusOr<bool> has_ended = false;
  do {
    has_ended = at_rest != nullptr ? at_rest->Advance(kStepsAtRest)
                                   : std::get<MovingBodies>(search_).search.Advance(kStepsInMotion);
  } while (has_ended.ok() && !*has_ended && Clock::now() < end);
  if (!has_ended.ok() || !*has_ended) return has_ended;
  if (at_rest == nullptr) {
    BodyContact found = std::get<MovingBodies>(search_).search.Take();
    Take(std::move(found.contact), std::move(found.of_body));
    return true;
  }
  HULLD_ASSIGN_OR_RETURN(BodyAnswer found, at_rest->Take());
  answer_.answer = std::move(found.answer);
  answer_.of_body = PiecesAnswer(std::move(found));
  return true;
}

void PairSearch::Take(FirstContact contact, PiecesAnswer of_body) {
  answer_.answer.emplace().relation = contact.relation;
  answer_.of_body = std::move(of_body);
  answer_.contact = std::move(contact);
}

size_t PairSearch::MemoryBytes() const {
  const auto* const check = std::get_if<TextbookCheck>(&search_);
  return check == nullptr ? 0 : check->MemoryBytes();
}

PlacedAnswer QueryPlaced(const PlacementTable& table, uint32_t a, uint32_t b,
                         const QueryOptions& options, const MotionOptions& motion) {
  PairSearch search(table, a, b, options, motion);
  while (!search.Advance(PairSearch::Clock::time_point::max())) continue;
  return std::move(search.answer());
}

PlacedAnswer QueryAtRest(const PlacementTable& table, uint32_t a, uint32_t b,
                         const QueryOptions& options, PairCache* cache) {
  static const auto* const kNoMotion = new MotionOptions();
  if (HasBody(table, a, b)) return QueryPlaced(table, a, b, options, *kNoMotion);
  PlacedAnswer found = {QueryHulls(table, a, b, options, cache)};
  if (!found.answer.ok()) found.answer = NameLimit(found.answer.status(), options);
  return found;
}

size_t AddCertificates(const PlacementTable& table, uint32_t a, uint32_t b,
                       const std::vector<PieceCertificate>& certificates, size_t max_bytes,
                       google::protobuf::RepeatedPtrField<v1::PieceCertificate>* messages) {
  // Tag and length.
  constexpr size_t kEntryBytes = 4;
  size_t bytes = 0;
  for (const PieceCertificate& certificate : certificates) {
    v1::PieceCertificate* const message = messages->Add();
    EncodePieceCertificate(certificate, table.HullOfPiece(a, certificate.pieces.a).hull(),
                           table.HullOfPiece(b, certificate.pieces.b).hull(), message);
    bytes += kEntryBytes + message->ByteSizeLong();
    if (bytes > max_bytes) break;
  }
  return bytes;
}

size_t AddPlacedAnswer(const PlacementTable& table, uint32_t a, uint32_t b,
                       const PlacedAnswer& answer, const v1::Wanted& wanted,
                       v1::AnswerColumns* columns) {
  const bool is_proven = wanted.certificate() && answer.answer.ok() && HasBody(table, a, b);
  if (is_proven) return AddProvenAnswer(table, a, b, answer, wanted, columns);
  const size_t bytes = AddRow(table, a, b, answer, wanted, columns);
  // Without an answer, no pieces decided, although the relation alone may have been found.
  return bytes +
         AddPieces(table, a, b, answer.answer.ok() ? answer.of_body.pieces : std::nullopt, columns);
}

size_t AddUnansweredPair(const PlacementTable& table, const v1::Wanted& wanted,
                         v1::AnswerColumns* columns) {
  size_t bytes = AddUnanswered(wanted, columns);
  if (table.has_motions()) bytes += AddNoTimes(columns);
  return bytes + AddPieces(table, 0, 0, std::nullopt, columns);
}

}  // namespace hulld::server
