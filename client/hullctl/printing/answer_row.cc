#include "client/hullctl/printing/answer_row.h"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_join.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "client/formats/text_number.h"
#include "client/hullctl/printing/answer_text.h"

namespace hulld {
namespace {

constexpr int kWitnessNumbers = 6;
constexpr int kNormalNumbers = 3;

v1::Vector3 VectorOf(const double* xyz) {
  v1::Vector3 vector;
  vector.set_x(xyz[0]);
  vector.set_y(xyz[1]);
  vector.set_z(xyz[2]);
  return vector;
}

// Returns the entry of row i in a list of proofs with ascending rows, or null.
template <typename Proof>
const Proof* ProofOf(const google::protobuf::RepeatedPtrField<Proof>& proofs, int i) {
  const auto row = static_cast<uint64_t>(i);
  const auto found =
      std::lower_bound(proofs.begin(), proofs.end(), row,
                       [](const Proof& proof, uint64_t number) { return proof.row() < number; });
  return found != proofs.end() && found->row() == row ? &*found : nullptr;
}

v1::FirstContact ContactAt(const v1::AnswerColumns& columns, int i) {
  v1::FirstContact contact;
  contact.set_separated_until(columns.separated_until(i));
  const double time = columns.contact_times(i);
  if (!std::isnan(time)) contact.set_contact_time(time);
  const v1::MotionProof* const proof = ProofOf(columns.motion_proofs(), i);
  if (proof != nullptr) *contact.mutable_intervals() = proof->intervals();
  return contact;
}

std::string ContactText(const v1::FirstContact& contact) {
  if (contact.has_contact_time()) {
    return absl::StrCat("contact at ", ShortestText(contact.contact_time()));
  }
  return absl::StrCat("separated until ", ShortestText(contact.separated_until()));
}

}  // namespace

bool AreParallel(const v1::AnswerColumns& columns, size_t count) {
  const auto fits = [count](int size, size_t each = 1) {
    return size == 0 || static_cast<size_t>(size) == each * count;
  };
  return static_cast<size_t>(columns.relations_size()) == count && fits(columns.rungs_size()) &&
         fits(columns.axes_size()) && fits(columns.analyses_size()) &&
         fits(columns.certificates_size()) && fits(columns.separations_size()) &&
         columns.separations_size() == columns.separation_bounds_size() &&
         fits(columns.witness_xyz_size(), kWitnessNumbers) &&
         columns.witness_xyz_size() == kWitnessNumbers * columns.witness_errors_size() &&
         fits(columns.normal_xyz_size(), kNormalNumbers) &&
         columns.normal_xyz_size() == kNormalNumbers * columns.normal_angle_bounds_size() &&
         fits(columns.separated_until_size()) &&
         columns.separated_until_size() == columns.contact_times_size() &&
         fits(columns.within_clearance_size()) && fits(columns.pieces_size(), 2);
}

AnswerRow RowAt(const v1::AnswerColumns& columns, int i) {
  AnswerRow row;
  row.relation = columns.relations(i);
  if (columns.rungs_size() > 0) row.rung = columns.rungs(i);
  if (columns.axes_size() > 0) row.axis = &columns.axes(i);
  if (columns.analyses_size() > 0) row.analysis = &columns.analyses(i);
  if (columns.certificates_size() > 0) row.certificate = &columns.certificates(i);
  row.proof = ProofOf(columns.piece_proofs(), i);
  if (columns.separations_size() > 0) {
    row.separation.emplace();
    row.separation->set_value(columns.separations(i));
    row.separation->set_bound(columns.separation_bounds(i));
  }
  if (columns.witness_errors_size() > 0) {
    const double* const xyz = columns.witness_xyz().data() + ptrdiff_t{kWitnessNumbers} * i;
    row.witness.emplace();
    *row.witness->mutable_point_a() = VectorOf(xyz);
    *row.witness->mutable_point_b() = VectorOf(xyz + 3);
    row.witness->set_error(columns.witness_errors(i));
  }
  if (columns.normal_angle_bounds_size() > 0) {
    row.normal.emplace();
    *row.normal->mutable_direction() =
        VectorOf(columns.normal_xyz().data() + ptrdiff_t{kNormalNumbers} * i);
    row.normal->set_angle_bound(columns.normal_angle_bounds(i));
  }
  const bool moves = columns.separated_until_size() > 0 && !std::isnan(columns.separated_until(i));
  if (moves) row.first_contact = ContactAt(columns, i);
  if (columns.within_clearance_size() > 0) row.within_clearance = columns.within_clearance(i);
  if (columns.pieces_size() > 0) row.pieces = {columns.pieces(2 * i), columns.pieces(2 * i + 1)};
  return row;
}

std::string PiecesText(std::pair<int32_t, int32_t> pieces,
                       const std::array<std::string, 2>& piece_names) {
  const auto name = [](int32_t piece, const std::string& known) {
    return piece < 0 ? "-" : known.empty() ? std::to_string(piece) : known;
  };
  return absl::StrCat("pieces ", name(pieces.first, piece_names[0]), " ",
                      name(pieces.second, piece_names[1]));
}

std::string RowText(const AnswerRow& row, const Painter& paint,
                    const std::array<std::string, 2>& piece_names) {
  std::vector<std::string> cells = {PaintedRelation(row.relation, paint)};
  if (row.first_contact) cells.push_back(ContactText(*row.first_contact));
  if (row.separation) cells.push_back(SeparationText(*row.separation));
  if (row.witness) {
    cells.push_back(VectorText(row.witness->point_a()));
    cells.push_back(VectorText(row.witness->point_b()));
  }
  if (row.normal) cells.push_back(NormalText(*row.normal));
  if (row.within_clearance) cells.emplace_back(*row.within_clearance ? "within" : "beyond");
  if (row.pieces) cells.push_back(PiecesText(*row.pieces, piece_names));
  if (row.axis != nullptr) {
    const bool found = row.axis->kind() != v1::AXIS_KIND_UNSPECIFIED;
    cells.push_back(
        found ? absl::StrCat(AxisKindText(row.axis->kind()), " ", VectorText(row.axis->direction()))
              : "no axis");
  }
  if (row.proof != nullptr) {
    const int count = row.proof->certificates_size();
    cells.push_back(absl::StrCat(count, " certificate", count == 1 ? "" : "s", " of pieces"));
  } else if (row.certificate != nullptr) {
    cells.push_back(CertificateText(*row.certificate));
  }
  if (row.analysis != nullptr) {
    cells.push_back(DurationText(row.analysis->time()));
    cells.push_back(absl::StrCat(row.analysis->axes_tested(), " axes"));
    cells.push_back(StageText(*row.analysis));
  }
  return absl::StrJoin(cells, "\t");
}

void AddRow(const AnswerRow& row, JsonObject* object) {
  object->Add("relation", v1::Relation_Name(row.relation));
  object->Add("rung", v1::Rung_Name(row.rung));
  if (row.first_contact) object->AddJson("firstContact", MessageJson(*row.first_contact));
  if (row.separation) object->AddJson("separation", MessageJson(*row.separation));
  if (row.witness) object->AddJson("witness", MessageJson(*row.witness));
  if (row.normal) object->AddJson("normal", MessageJson(*row.normal));
  if (row.within_clearance) {
    object->AddJson("withinClearance", *row.within_clearance ? "true" : "false");
  }
  if (row.pieces) {
    object->AddJson("pieces", absl::StrCat("[", row.pieces->first, ",", row.pieces->second, "]"));
  }
  if (row.axis != nullptr) object->AddJson("axis", MessageJson(*row.axis));
  if (row.proof != nullptr) {
    object->AddJson("pieceProof", MessageJson(*row.proof));
  } else if (row.certificate != nullptr) {
    object->AddJson("certificate", MessageJson(*row.certificate));
  }
  if (row.analysis != nullptr) object->AddJson("analysis", MessageJson(*row.analysis));
}

}  // namespace hulld
