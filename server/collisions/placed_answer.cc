#include "server/collisions/placed_answer.h"

#include "core/query/collision.h"
#include "server/collisions/query_settings.h"
#include "server/wire/answer_columns.h"

namespace hulld::server {
namespace {

// Two indices, as varints.
constexpr size_t kPiecesBytes = 10;

size_t AddPieces(const PlacementTable& table, uint32_t a, uint32_t b,
                 const std::optional<PiecePair>& pieces, v1::AnswerColumns* columns) {
  const auto index = [&](uint32_t placement, uint32_t piece) {
    return table.is_body(placement) ? static_cast<int32_t>(piece) : -1;
  };
  columns->add_pieces(pieces ? index(a, pieces->a) : -1);
  columns->add_pieces(pieces ? index(b, pieces->b) : -1);
  return kPiecesBytes;
}

}  // namespace

PlacedAnswer AskPlaced(const PlacementTable& table, uint32_t a, uint32_t b,
                       const QueryOptions& options, PairCache* cache) {
  if (!table.is_body(a) && !table.is_body(b)) {
    return {CheckCollision(table.placed()[a], table.placed()[b], options, cache), std::nullopt};
  }
  if (absl::Status s = ValidateForBodiesAmongMany(options); !s.ok()) return {s, std::nullopt};
  absl::StatusOr<BodyAnswer> found = CheckBodies(table.bodies()[a], table.bodies()[b], options);
  if (!found.ok()) return {found.status(), std::nullopt};
  return {std::move(found->answer), found->pieces};
}

size_t AddPlacedAnswer(const PlacementTable& table, uint32_t a, uint32_t b,
                       const PlacedAnswer& answer, const v1::Wanted& wanted,
                       v1::AnswerColumns* columns) {
  if (!table.has_bodies()) {
    return AddAnswer(answer.answer, table.placed()[a], table.placed()[b], wanted, columns);
  }
  const PiecePair pieces = answer.pieces.value_or(PiecePair{0, 0});
  const size_t bytes = AddAnswer(answer.answer, table.HullOfPiece(a, pieces.a),
                                 table.HullOfPiece(b, pieces.b), wanted, columns);
  return bytes + AddPieces(table, a, b, answer.pieces, columns);
}

size_t AddUnansweredPair(const PlacementTable& table, const v1::Wanted& wanted,
                         v1::AnswerColumns* columns) {
  const size_t bytes = AddUnanswered(wanted, columns);
  if (!table.has_bodies()) return bytes;
  return bytes + AddPieces(table, 0, 0, std::nullopt, columns);
}

}  // namespace hulld::server
