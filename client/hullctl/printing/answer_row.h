#ifndef HULLD_CLIENT_HULLCTL_PRINTING_ANSWER_ROW_H_
#define HULLD_CLIENT_HULLCTL_PRINTING_ANSWER_ROW_H_

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>

#include "client/hullctl/printing/json.h"
#include "client/hullctl/printing/painter.h"
#include "hulld/v1/collision.pb.h"

namespace hulld {

// One entry of each answer column; null or absent if the column is empty.
struct AnswerRow {
  v1::Relation relation = v1::RELATION_UNSPECIFIED;
  v1::Rung rung = v1::RUNG_UNSPECIFIED;
  const v1::Axis* axis = nullptr;
  const v1::Analysis* analysis = nullptr;
  const v1::Certificate* certificate = nullptr;
  // For a pair with a body, in place of the certificate.
  const v1::PieceProof* proof = nullptr;
  std::optional<v1::Separation> separation;
  std::optional<v1::Witness> witness;
  std::optional<v1::Normal> normal;
  std::optional<bool> within_clearance;
  // For a pair in motion that has an answer; has intervals if a certificate was requested.
  std::optional<v1::FirstContact> first_contact;
  // The deciding pieces of bodies, -1 if none decided; absent without bodies.
  std::optional<std::pair<int32_t, int32_t>> pieces;
};

// Returns true if each column is empty or has `count` entries.
bool AreParallel(const v1::AnswerColumns& columns, size_t count);

// Returns row i of the columns. Requires AreParallel(columns, count) and i < count; unchecked,
// because callers check AreParallel for all rows together.
AnswerRow RowAt(const v1::AnswerColumns& columns, int i);

// Returns the row for people, separated by tabs, the relation first. Pieces are shown by name, or
// by index if the names are empty.
std::string RowText(const AnswerRow& row, const Painter& paint,
                    const std::array<std::string, 2>& piece_names = {});

// Returns the deciding pieces of bodies, as in "pieces leg 3": by name, or by index if the names
// are empty, "-" for -1.
std::string PiecesText(std::pair<int32_t, int32_t> pieces,
                       const std::array<std::string, 2>& piece_names);

// Adds a member for each present field.
void AddRow(const AnswerRow& row, JsonObject* object);

}  // namespace hulld

#endif  // HULLD_CLIENT_HULLCTL_PRINTING_ANSWER_ROW_H_
