#include "core/query/body/piece_certification.h"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <utility>

#include "core/base/check.h"
#include "core/query/collision.h"

namespace hulld {
namespace {

QueryOptions CertificateOptions(const QueryOptions& options) {
  QueryOptions each;
  each.want_certificate = true;
  each.should_stop = options.should_stop;
  return each;
}

}  // namespace

PieceCertification::PieceCertification(const PlacedBody& a, const PlacedBody& b,
                                       const QueryOptions& options, Relation relation,
                                       std::optional<PiecePair> decided)
    : a_(&a),
      b_(&b),
      each_(CertificateOptions(options)),
      max_certificates_(options.max_piece_certificates),
      relation_(relation) {
  HULLD_CHECK(relation != Relation::kWithinTolerance);
  if (relation == Relation::kOverlapping) {
    HULLD_CHECK(decided.has_value());
    pairs_.push_back(*decided);
    Enter(Stage::kCertificates);
  } else if (!BoundingBox(a).Meets(BoundingBox(b))) {
    Enter(Stage::kCertificates);
  } else {
    Enter(Stage::kBoxesOfB);
  }
}

void PieceCertification::Enter(Stage stage) {
  stage_ = stage;
  next_ = 0;
  if (stage_ == Stage::kBoxesOfB && b_->body().pieces().empty()) stage_ = Stage::kPairs;
  if (stage_ == Stage::kPairs && a_->body().pieces().empty()) stage_ = Stage::kCertificates;
  if (stage_ != Stage::kCertificates || !pairs_.empty()) return;
  HULLD_CHECK(relation_ == strongest_);
  stage_ = Stage::kEnded;
}

absl::Status PieceCertification::Step() {
  switch (stage_) {
    case Stage::kBoxesOfB: {
      const PlacedPiece piece(*b_, static_cast<uint32_t>(next_));
      boxes_.push_back(BoundingBox(piece.placed()));
      if (++next_ < b_->body().pieces().size()) break;
      tree_ = BoxTree(boxes_);
      Enter(Stage::kPairs);
      break;
    }
    case Stage::kPairs:
      if (absl::Status s = FindPairs(static_cast<uint32_t>(next_)); !s.ok()) return s;
      if (++next_ == a_->body().pieces().size()) Enter(Stage::kCertificates);
      break;
    case Stage::kCertificates:
      if (absl::Status s = Certify(pairs_[next_]); !s.ok()) return s;
      if (++next_ < pairs_.size()) break;
      HULLD_CHECK(relation_ == strongest_);
      stage_ = Stage::kEnded;
      break;
    case Stage::kEnded:
      break;
  }
  return absl::OkStatus();
}

absl::Status PieceCertification::FindPairs(uint32_t piece_a) {
  const PlacedPiece piece(*a_, piece_a);
  if (piece.placed().empty()) return absl::OkStatus();
  meeting_.clear();
  tree_.AppendMeeting(BoundingBox(piece.placed()), 0, meeting_);
  std::sort(meeting_.begin(), meeting_.end());
  for (const uint32_t piece_b : meeting_) {
    // An empty box intersects a box that covers all of space.
    if (b_->body().pieces()[piece_b].hull->empty()) continue;
    pairs_.push_back({piece_a, piece_b});
  }
  if (pairs_.size() <= max_certificates_) return absl::OkStatus();
  return absl::ResourceExhaustedError(
      absl::StrCat("more than ", max_certificates_,
                   " pairs of pieces are so close that each needs a certificate; use bodies with "
                   "fewer pieces, or do not request certificates"));
}

absl::Status PieceCertification::Certify(PiecePair pieces) {
  const PlacedPiece a(*a_, pieces.a);
  const PlacedPiece b(*b_, pieces.b);
  absl::StatusOr<Answer> answer = CheckCollision(a.placed(), b.placed(), each_);
  if (!answer.ok()) return answer.status();
  HULLD_CHECK(answer->certificate.has_value());
  // Without a tolerance, relations are in order of strength.
  strongest_ = std::max(strongest_, answer->relation);
  certificates_.push_back({pieces, answer->relation, std::move(*answer->certificate)});
  return absl::OkStatus();
}

std::vector<PieceCertificate> PieceCertification::Take() {
  HULLD_CHECK(ended());
  return std::move(certificates_);
}

}  // namespace hulld
