#include "server/wire/answer_columns.h"

#include <absl/status/status.h>

#include <limits>
#include <string>
#include <vector>

#include "core/query/terms/answer.h"
#include "server/contract/errors.h"
#include "server/settings/config.h"
#include "server/wire/encode.h"

namespace hulld::server {
namespace {

// Overhead per element of a repeated message field: a tag and a length.
constexpr size_t kElementOverhead = 5;
constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
constexpr int kWitnessNumbers = 6;

// Adds the reason why the last row has no answer.
size_t AddProblem(const absl::Status& status, v1::AnswerColumns* columns) {
  v1::PairProblem* const problem = columns->add_pair_problems();
  problem->set_row(static_cast<uint64_t>(columns->relations_size()) - 1);
  problem->set_code(ToGrpc(status.code()));
  problem->set_message(std::string(status.message()));
  problem->set_reason(ReasonOf(status));
  return problem->ByteSizeLong() + kElementOverhead;
}

void AddWitness(const Witness& witness, v1::AnswerColumns* columns) {
  for (const Vector& point : {witness.p_WA, witness.p_WB}) {
    for (int i = 0; i < 3; ++i) columns->add_witness_xyz(point[i]);
  }
  columns->add_witness_errors(witness.error);
}

void AddNormal(const Normal& normal, v1::AnswerColumns* columns) {
  for (int i = 0; i < 3; ++i) columns->add_normal_xyz(normal.direction[i]);
  columns->add_normal_angle_bounds(normal.angle_bound);
}

// Fills the fixed-size columns.
size_t AddNumbers(const Answer* answer, const v1::Wanted& wanted, v1::AnswerColumns* columns) {
  size_t bytes = 0;
  if (wanted.separation()) {
    const bool known = answer != nullptr && answer->separation.has_value();
    columns->add_separations(known ? answer->separation->value : kNone);
    columns->add_separation_bounds(known ? answer->separation->bound : kNone);
    bytes += 2 * sizeof(double);
  }
  if (wanted.witness()) {
    const Vector none = Vector::Constant(kNone);
    const bool known = answer != nullptr && answer->witness.has_value();
    AddWitness(known ? *answer->witness : Witness{none, none, kNone}, columns);
    bytes += (kWitnessNumbers + 1) * sizeof(double);
  }
  if (wanted.normal()) {
    const bool known = answer != nullptr && answer->normal.has_value();
    AddNormal(known ? *answer->normal : Normal{Vector::Constant(kNone), kNone}, columns);
    bytes += 4 * sizeof(double);
  }
  if (wanted.has_clearance()) {
    columns->add_within_clearance(answer != nullptr && answer->within_clearance.value_or(false));
    bytes += 1;
  }
  return bytes;
}

// Like EncodeAxis, but leaves the pair without an answer if a feature is too large.
size_t AddAxis(const SeparatingAxis& found, const Hull& a, const Hull& b,
               v1::AnswerColumns* columns) {
  v1::Axis* const axis = columns->mutable_axes(columns->axes_size() - 1);
  const absl::Status encoded = EncodeAxis(found, a, b, axis);
  if (encoded.ok()) return axis->ByteSizeLong();
  axis->Clear();
  columns->set_relations(columns->relations_size() - 1, v1::RELATION_UNSPECIFIED);
  return AddProblem(encoded, columns);
}

size_t AddRow(v1::Relation relation, v1::Rung rung, const v1::Wanted& wanted,
              v1::AnswerColumns* columns) {
  columns->add_relations(relation);
  columns->add_rungs(rung);
  if (wanted.axis()) columns->add_axes();
  if (wanted.analysis()) columns->add_analyses();
  if (wanted.certificate()) columns->add_certificates();
  return 2 + kElementOverhead *
                 (size_t{wanted.axis()} + size_t{wanted.analysis()} + size_t{wanted.certificate()});
}

size_t AddTimes(double separated_until, double contact_time, v1::AnswerColumns* columns) {
  columns->add_separated_until(separated_until);
  columns->add_contact_times(contact_time);
  return 2 * sizeof(double);
}

// Adds the intervals of the last row.
size_t AddMotionProof(const std::vector<SeparatedInterval>& intervals, v1::AnswerColumns* columns) {
  if (intervals.empty()) return 0;
  v1::MotionProof* const proof = columns->add_motion_proofs();
  proof->set_row(static_cast<uint64_t>(columns->relations_size()) - 1);
  EncodeIntervals(intervals, proof->mutable_intervals());
  return proof->ByteSizeLong() + kElementOverhead;
}

// Encodes the certificate of the last row.
size_t SetCertificate(const Certificate& found, const QueryHull& a, const QueryHull& b,
                      v1::AnswerColumns* columns) {
  v1::Certificate* const certificate =
      columns->mutable_certificates(columns->certificates_size() - 1);
  EncodeCertificate(found, a.hull(), b.hull(), certificate);
  return certificate->ByteSizeLong();
}

}  // namespace

size_t FullMessageBytes(const v1::Wanted& wanted) {
  return wanted.axis() ? Config::kReplyMessageBytes / 4 : Config::kReplyMessageBytes;
}

bool NamesRows(const v1::AnswerColumns& columns) {
  return columns.pair_problems_size() > 0 || columns.piece_proofs_size() > 0 ||
         columns.motion_proofs_size() > 0;
}

size_t AddUnanswered(const v1::Wanted& wanted, v1::AnswerColumns* columns) {
  const size_t bytes = AddRow(v1::RELATION_UNSPECIFIED, v1::RUNG_UNSPECIFIED, wanted, columns);
  return bytes + AddNumbers(nullptr, wanted, columns);
}

size_t AddRelation(const Answer& answer, v1::AnswerColumns* columns) {
  columns->add_relations(EncodeRelation(answer.relation));
  columns->add_rungs(EncodeRung(answer.rung));
  return 2;
}

size_t AddAnswer(const absl::StatusOr<Answer>& answer, const QueryHull& a, const QueryHull& b,
                 const v1::Wanted& wanted, v1::AnswerColumns* columns) {
  if (!answer.ok()) {
    const size_t bytes = AddUnanswered(wanted, columns);
    return bytes + AddProblem(answer.status(), columns);
  }
  size_t bytes =
      AddRow(EncodeRelation(answer->relation), EncodeRung(answer->rung), wanted, columns);
  bytes += AddNumbers(&*answer, wanted, columns);
  if (wanted.analysis() && answer->analysis.has_value()) {
    v1::Analysis* const analysis = columns->mutable_analyses(columns->analyses_size() - 1);
    EncodeAnalysis(*answer->analysis, a.hull(), b.hull(), analysis);
    bytes += analysis->ByteSizeLong();
  }
  if (wanted.certificate() && answer->certificate.has_value()) {
    bytes += SetCertificate(*answer->certificate, a, b, columns);
  }
  if (wanted.axis() && answer->axis.has_value()) {
    bytes += AddAxis(*answer->axis, a.hull(), b.hull(), columns);
  }
  return bytes;
}

size_t AddNoTimes(v1::AnswerColumns* columns) { return AddTimes(kNone, kNone, columns); }

size_t AddFirstContact(const FirstContact& contact, const QueryHull& a, const QueryHull& b,
                       const v1::Wanted& wanted, v1::AnswerColumns* columns) {
  const size_t bytes =
      AddRow(EncodeRelation(contact.relation), v1::RUNG_UNSPECIFIED, wanted, columns) +
      AddTimes(contact.separated_until, contact.contact_time.value_or(kNone), columns) +
      AddMotionProof(contact.intervals, columns);
  if (!contact.certificate.has_value()) return bytes;
  return bytes + SetCertificate(*contact.certificate, a, b, columns);
}

}  // namespace hulld::server
