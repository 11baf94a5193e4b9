#include "server/collisions/placed/placed_answer.h"

#include <utility>

#include "core/query/collision.h"
#include "core/query/motion/moving_body_search.h"
#include "server/collisions/placed/query_settings.h"
#include "server/settings/config.h"
#include "server/wire/answer_columns.h"
#include "server/wire/encode.h"

namespace hulld::server {
namespace {

// Two indices as varints.
constexpr size_t kPiecesBytes = 10;
// Tag and length of an entry within its message, and the row of a proof.
constexpr size_t kAnswerEntryBytes = 10;

size_t AddPieces(const PlacementTable& table, uint32_t a, uint32_t b,
                 const std::optional<PiecePair>& pieces, v1::AnswerColumns* columns) {
  const auto index = [&](uint32_t placement, uint32_t piece) {
    return table.is_body(placement) ? static_cast<int32_t>(piece) : -1;
  };
  columns->add_pieces(pieces ? index(a, pieces->a) : -1);
  columns->add_pieces(pieces ? index(b, pieces->b) : -1);
  return kPiecesBytes;
}

// Adds the row of an answer, without its pieces and their certificates.
size_t AddRow(const PlacementTable& table, const QueryHull& a, const QueryHull& b,
              const PlacedAnswer& answer, const v1::Wanted& wanted, v1::AnswerColumns* columns) {
  if (answer.contact.has_value()) return AddFirstContact(*answer.contact, a, b, wanted, columns);
  const size_t bytes = AddAnswer(answer.answer, a, b, wanted, columns);
  return table.has_motions() ? bytes + AddNoTimes(columns) : bytes;
}

// Encodes the proof of the answer; returns its bytes.
size_t EncodeProof(const PlacementTable& table, uint32_t a, uint32_t b,
                   const std::vector<PieceCertificate>& certificates, v1::PieceProof* proof) {
  size_t bytes = kAnswerEntryBytes;
  for (const PieceCertificate& certificate : certificates) {
    v1::PieceCertificate* const message = proof->add_certificates();
    EncodePieceCertificate(certificate, table.HullOfPiece(a, certificate.pieces.a).hull(),
                           table.HullOfPiece(b, certificate.pieces.b).hull(), message);
    bytes += kAnswerEntryBytes + message->ByteSizeLong();
    if (bytes > Config::kMaxRowProofBytes) break;
  }
  return bytes;
}

// Adds the row of a pair with a body and its certificates. The proof is encoded aside, because it
// may turn out too large.
size_t AddProvenAnswer(const PlacementTable& table, uint32_t a, uint32_t b,
                       const PlacedAnswer& answer, const v1::Wanted& wanted,
                       v1::AnswerColumns* columns) {
  const QueryHull& nothing = table.HullOfPiece(a, 0);
  const PiecePair pieces = answer.of_body.pieces.value_or(PiecePair{0, 0});
  v1::AnswerColumns row;
  size_t bytes = AddRow(table, table.HullOfPiece(a, pieces.a), table.HullOfPiece(b, pieces.b),
                        answer, wanted, &row);
  v1::PieceProof* const proof = row.add_piece_proofs();
  bytes += EncodeProof(table, a, b, answer.of_body.certificates, proof);
  bool is_answered = row.pair_problems_size() == 0;
  if (is_answered && bytes > Config::kMaxRowProofBytes) {
    row.Clear();
    const absl::Status too_large =
        ProofTooLarge(answer.of_body.certificates.size(), Config::kMaxRowProofBytes);
    bytes = AddRow(table, nothing, nothing, {too_large}, wanted, &row);
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

absl::Status NameLimit(const PlacementTable& table, uint32_t a, uint32_t b,
                       const absl::Status& status, const QueryOptions& options) {
  return IsLongToAsk(table, a, b) ? NameProofLimit(status, options.max_depth_bytes)
                                  : NameQueryLimit(status, options);
}

PlacedAnswer AskPlaced(const PlacementTable& table, uint32_t a, uint32_t b,
                       const QueryOptions& options, PairCache* cache) {
  if (!table.is_body(a) && !table.is_body(b)) {
    std::optional<PlacedHull> made_a;
    std::optional<PlacedHull> made_b;
    return {CheckCollision(table.PlacedAt(a, &made_a), table.PlacedAt(b, &made_b), options, cache)};
  }
  if (absl::Status s = ValidateForBodies(options); !s.ok()) return {s};
  absl::StatusOr<BodyAnswer> found = CheckBodies(table.bodies()[a], table.bodies()[b], options);
  if (!found.ok()) return {found.status()};
  return {std::move(found->answer), PiecesAnswer(*std::move(found))};
}

PlacedAnswer AskMoving(const PlacementTable& table, uint32_t a, uint32_t b,
                       const MotionOptions& options) {
  BodyContact found;
  if (table.is_body(a) || table.is_body(b)) {
    absl::StatusOr<BodyContact> of_bodies =
        FindFirstContact(table.MovingBodyAt(a), table.MovingBodyAt(b), options);
    if (!of_bodies.ok()) return {of_bodies.status()};
    found = *std::move(of_bodies);
  } else {
    absl::StatusOr<FirstContact> of_hulls =
        FindFirstContact(table.MovingAt(a), table.MovingAt(b), options);
    if (!of_hulls.ok()) return {of_hulls.status()};
    found.contact = *std::move(of_hulls);
  }
  Answer answer;
  answer.relation = found.contact.relation;
  return {std::move(answer), std::move(found.of_body), std::move(found.contact)};
}

size_t AddPlacedAnswer(const PlacementTable& table, uint32_t a, uint32_t b,
                       const PlacedAnswer& answer, const v1::Wanted& wanted,
                       v1::AnswerColumns* columns) {
  if (!table.has_bodies()) {
    return AddRow(table, table.HullAt(a), table.HullAt(b), answer, wanted, columns);
  }
  const bool is_proven =
      wanted.certificate() && answer.answer.ok() && (table.is_body(a) || table.is_body(b));
  if (is_proven) return AddProvenAnswer(table, a, b, answer, wanted, columns);
  const PiecePair pieces = answer.of_body.pieces.value_or(PiecePair{0, 0});
  const size_t bytes = AddRow(table, table.HullOfPiece(a, pieces.a), table.HullOfPiece(b, pieces.b),
                              answer, wanted, columns);
  // Without an answer no pieces decided, although the relation alone may have been found.
  return bytes +
         AddPieces(table, a, b, answer.answer.ok() ? answer.of_body.pieces : std::nullopt, columns);
}

size_t AddUnansweredPair(const PlacementTable& table, const v1::Wanted& wanted,
                         v1::AnswerColumns* columns) {
  size_t bytes = AddUnanswered(wanted, columns);
  if (table.has_motions()) bytes += AddNoTimes(columns);
  if (!table.has_bodies()) return bytes;
  return bytes + AddPieces(table, 0, 0, std::nullopt, columns);
}

}  // namespace hulld::server
