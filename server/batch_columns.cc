#include "server/batch_columns.h"

#include <utility>

#include "server/config.h"
#include "server/encode.h"
#include "server/status_map.h"

namespace hulld::server {
namespace {

// What an element of a repeated message field takes beside its own bytes: a tag and its length.
constexpr size_t kElementOverhead = 5;

}  // namespace

BatchColumns::BatchColumns(v1::BatchCheckCollisionsResponse head, const v1::Wanted& wanted,
                           uint64_t first_pair)
    : wanted_(wanted), next_pair_(first_pair), bytes_(head.ByteSizeLong()) {
  head.set_first_pair(first_pair);
  messages_.push_back(std::move(head));
}

void BatchColumns::AddRow(v1::Relation relation, v1::Rung rung) {
  if (bytes_ >= Config::kReplyMessageBytes) {
    messages_.emplace_back().set_first_pair(next_pair_);
    bytes_ = 0;
  }
  v1::BatchCheckCollisionsResponse& message = messages_.back();
  message.add_relations(relation);
  message.add_rungs(rung);
  if (wanted_.axis()) message.add_axes();
  if (wanted_.analysis()) message.add_analyses();
  bytes_ += 2 + kElementOverhead * (size_t{wanted_.axis()} + size_t{wanted_.analysis()});
  ++next_pair_;
}

void BatchColumns::AddUnanswered() { AddRow(v1::RELATION_UNSPECIFIED, v1::RUNG_UNSPECIFIED); }

// Belongs to the row added last.
void BatchColumns::AddProblem(const absl::Status& status) {
  v1::PairProblem* problem = messages_.back().add_pair_problems();
  problem->set_pair(next_pair_ - 1);
  problem->set_code(ToGrpc(status.code()));
  problem->set_message(std::string(status.message()));
  bytes_ += problem->ByteSizeLong() + kElementOverhead;
}

void BatchColumns::Add(const absl::StatusOr<Answer>& answer, const Hull& a, const Hull& b) {
  if (!answer.ok()) {
    AddUnanswered();
    return AddProblem(answer.status());
  }
  AddRow(EncodeRelation(answer->relation), EncodeRung(answer->rung));
  v1::BatchCheckCollisionsResponse& message = messages_.back();
  if (wanted_.analysis()) {
    v1::Analysis* analysis = message.mutable_analyses(message.analyses_size() - 1);
    EncodeAnalysis(answer->analysis, a, b, analysis);
    bytes_ += analysis->ByteSizeLong();
  }
  if (wanted_.axis() && answer->axis.has_value()) {
    v1::Axis* axis = message.mutable_axes(message.axes_size() - 1);
    const absl::Status encoded = EncodeAxis(*answer->axis, a, b, axis);
    if (!encoded.ok()) {
      axis->Clear();
      message.set_relations(message.relations_size() - 1, v1::RELATION_UNSPECIFIED);
      AddProblem(encoded);
    }
    bytes_ += axis->ByteSizeLong();
  }
}

std::vector<v1::BatchCheckCollisionsResponse> BatchColumns::Take() { return std::move(messages_); }

}  // namespace hulld::server
