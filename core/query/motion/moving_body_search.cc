#include "core/query/motion/moving_body_search.h"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <iterator>
#include <utility>
#include <variant>

#include "core/base/check.h"
#include "core/query/motion/pair_at.h"
#include "core/query/motion/swept_box.h"

namespace hulld {
namespace {

// Pairs that cannot be first are dropped when the number of pairs that met has doubled and is at
// least this. Not tuned.
constexpr size_t kMinToDrop = 64;

std::vector<uint32_t> PiecesOf(const MovingBody& body) {
  std::vector<uint32_t> pieces;
  for (uint32_t i = 0; i < body.body.pieces().size(); ++i) {
    if (!body.body.pieces()[i].hull->empty()) pieces.push_back(i);
  }
  return pieces;
}

// Ends the intervals at an earlier time. Their proofs remain valid for shorter intervals: the slack
// of kMotionPlaneErrorFactor covers the rounding of a plane at its new end.
void EndAt(double until, std::vector<SeparatedInterval>& intervals) {
  const auto ends_later = [=](const SeparatedInterval& interval) {
    return interval.until >= until;
  };
  const auto last = std::ranges::find_if(intervals, ends_later);
  HULLD_CHECK(last != intervals.end());
  if (last->end && last->until > until) {
    const double from = last == intervals.begin() ? 0 : std::prev(last)->until;
    const double share = (until - from) / (last->until - from);
    const Vector& n = std::get<Vector>(last->direction);
    last->end->direction = (1 - share) * n + share * last->end->direction;
    last->end->offset = (1 - share) * *last->offset + share * last->end->offset;
  }
  last->until = until;
  intervals.erase(last + 1, intervals.end());
}

}  // namespace

MovingBodySearch::MovingBodySearch(const MovingBody& a, const MovingBody& b,
                                   const MotionOptions& options)
    : a_(&a),
      b_(&b),
      options_(&options),
      is_plain_translation_(!a.is_rounded() && !b.is_rounded() && IsTranslation(a.X_WB) &&
                            IsTranslation(b.X_WB)),
      latest_(is_plain_translation_ ? 1 : options.latest),
      meeting_(
          a.body, b.body, [&a](uint32_t piece) { return SweptBox(a.Piece(piece)); },
          [&b](uint32_t piece) { return SweptBox(b.Piece(piece)); }) {
  HULLD_DCHECK(ValidateMotionOptions(options).ok());
}

absl::StatusOr<bool> MovingBodySearch::Advance(uint64_t steps) {
  for (; steps > 0 && stage_ != Stage::kEnded; --steps) {
    if (options_->should_stop && options_->should_stop()) return MotionStopped();
    const absl::Status status = stage_ == Stage::kPairs ? Search() : Prove();
    if (!status.ok()) return status;
  }
  return stage_ == Stage::kEnded;
}

BodyContact MovingBodySearch::Take() {
  HULLD_CHECK(stage_ == Stage::kEnded);
  return std::move(result_);
}

absl::StatusOr<FirstContact> MovingBodySearch::Find(PiecePair pieces, double latest,
                                                    bool want_certificate) const {
  MotionOptions options = *options_;
  options.latest = latest;
  options.want_certificate = want_certificate;
  return FindFirstContact(a_->Piece(pieces.a), b_->Piece(pieces.b), options);
}

// Takes one step toward the first contact.
absl::Status MovingBodySearch::Search() {
  const std::optional<PiecePair> pieces = overlaps_at_start_ ? std::nullopt : meeting_.Next();
  if (!pieces) return Decide();
  const absl::StatusOr<FirstContact> found = Find(*pieces, std::min(earliest_, latest_), false);
  if (!found.ok()) return found.status();
  if (found->relation == Relation::kSeparated || found->separated_until > latest_) {
    others_until_ = std::min(others_until_, found->separated_until);
  } else {
    TakeUp({*pieces, found->relation, found->separated_until,
            found->contact_time.value_or(kInfinity)});
  }
  return absl::OkStatus();
}

void MovingBodySearch::TakeUp(const Met& met) {
  if (met.relation == Relation::kOverlapping) {
    overlaps_ = true;
    overlaps_at_start_ |= met.contact_time == 0;
  }
  earliest_ = std::min(earliest_, met.contact_time);
  met_.push_back(met);
  if (met_.size() >= std::max(2 * kept_, kMinToDrop)) DropLater();
}

// Drops pairs that are separated up to the earliest contact.
void MovingBodySearch::DropLater() {
  std::erase_if(met_, [&](const Met& met) { return met.separated_until > earliest_; });
  kept_ = met_.size();
}

absl::Status MovingBodySearch::Decide() {
  DropLater();
  FirstContact& contact = result_.contact;
  contact.separated_until = others_until_;
  const Met* first = nullptr;
  for (const Met& met : met_) {
    if (first == nullptr || met.separated_until < contact.separated_until) {
      first = &met;
      contact.separated_until = met.separated_until;
    }
  }
  if (first == nullptr) return EnterCertificates();
  contact.relation = Relation::kWithinTolerance;
  result_.of_body.pieces = first->pieces;
  if (earliest_ == kInfinity) return EnterCertificates();
  contact.contact_time = earliest_;
  contact.relation = Relation::kSeparated;
  for (const Met& met : met_) {
    const absl::StatusOr<Relation> relation = RelationAtContact(met);
    if (!relation.ok()) return relation.status();
    if (*relation <= contact.relation) continue;
    contact.relation = *relation;
    result_.of_body.pieces = met.pieces;
    if (*relation == Relation::kOverlapping) break;
  }
  HULLD_CHECK(contact.relation != Relation::kSeparated);
  if (is_plain_translation_ && overlaps_) contact.relation = Relation::kOverlapping;
  return EnterCertificates();
}

absl::StatusOr<Relation> MovingBodySearch::RelationAtContact(const Met& met) const {
  if (met.contact_time == earliest_) return met.relation;
  if (is_plain_translation_) return Relation::kSeparated;
  const absl::StatusOr<Answer> answer =
      PairAt(a_->Piece(met.pieces.a), b_->Piece(met.pieces.b), earliest_)
          .Check(/*want_certificate=*/false, options_->should_stop);
  if (!answer.ok()) return answer.status();
  return answer->relation;
}

absl::Status MovingBodySearch::EnterCertificates() {
  stage_ = options_->want_certificate ? Stage::kCertificates : Stage::kEnded;
  if (!options_->want_certificate) return absl::OkStatus();
  if (result_.contact.separated_until == 0) {
    if (result_.contact.contact_time) {
      pieces_a_ = {result_.of_body.pieces->a};
      pieces_b_ = {result_.of_body.pieces->b};
    }
  } else {
    pieces_a_ = PiecesOf(*a_);
    pieces_b_ = PiecesOf(*b_);
  }
  if (pieces_a_.size() * pieces_b_.size() <= options_->max_piece_certificates) {
    return absl::OkStatus();
  }
  return absl::ResourceExhaustedError(
      absl::StrCat("each of ", pieces_a_.size() * pieces_b_.size(),
                   " pairs of pieces in motion needs a certificate, but at most ",
                   options_->max_piece_certificates,
                   " are allowed; use bodies with fewer pieces, or do not request certificates"));
}

// Proves one pair of pieces.
absl::Status MovingBodySearch::Prove() {
  if (next_ == pieces_a_.size() * pieces_b_.size()) {
    stage_ = Stage::kEnded;
    return absl::OkStatus();
  }
  const PiecePair pieces = {pieces_a_[next_ / pieces_b_.size()],
                            pieces_b_[next_ % pieces_b_.size()]};
  ++next_;
  absl::StatusOr<PieceCertificate> certificate = Certify(pieces);
  if (!certificate.ok()) return certificate.status();
  result_.of_body.certificates.push_back(*std::move(certificate));
  return absl::OkStatus();
}

absl::StatusOr<PieceCertificate> MovingBodySearch::Certify(PiecePair pieces) const {
  const double until = result_.contact.separated_until;
  const bool decides = IsDeciding(pieces);
  absl::StatusOr<FirstContact> found = Find(pieces, decides ? earliest_ : until, true);
  if (!found.ok()) return found.status();
  PieceCertificate certificate = {pieces, Relation::kSeparated, {}, {}};
  if (until > 0) {
    EndAt(until, found->intervals);
    certificate.intervals = std::move(found->intervals);
  }
  if (!decides) return certificate;
  if (found->contact_time == earliest_) {
    certificate.relation = found->relation;
    certificate.certificate = std::move(*found->certificate);
    return certificate;
  }
  absl::StatusOr<Answer> answer = PairAt(a_->Piece(pieces.a), b_->Piece(pieces.b), earliest_)
                                      .Check(/*want_certificate=*/true, options_->should_stop);
  if (!answer.ok()) return answer.status();
  certificate.relation = answer->relation;
  certificate.certificate = std::move(*answer->certificate);
  return certificate;
}

absl::StatusOr<BodyContact> FindFirstContact(const MovingBody& a, const MovingBody& b,
                                             const MotionOptions& options) {
  if (absl::Status s = ValidateMotionOptions(options); !s.ok()) return s;
  MovingBodySearch search(a, b, options);
  const absl::StatusOr<bool> ended = search.Advance(std::numeric_limits<uint64_t>::max());
  if (!ended.ok()) return ended.status();
  return search.Take();
}

}  // namespace hulld
