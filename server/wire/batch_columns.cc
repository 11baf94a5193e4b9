#include "server/wire/batch_columns.h"

#include <algorithm>
#include <utility>

#include "server/settings/config.h"
#include "server/wire/answer_columns.h"
#include "server/wire/encode.h"

namespace hulld::server {
namespace {

// Bytes of a relation and a rung.
constexpr size_t kRelationBytes = 2;

}  // namespace

BatchColumns::BatchColumns(v1::BatchCheckCollisionsResponse head, const v1::Wanted& wanted,
                           uint64_t first_pair)
    : wanted_(wanted), next_pair_(first_pair), bytes_(head.ByteSizeLong()) {
  head.set_first_pair(first_pair);
  messages_.push_back(std::move(head));
}

v1::AnswerColumns* BatchColumns::ColumnsForNext() {
  if (bytes_ >= Config::kReplyMessageBytes) {
    messages_.emplace_back().set_first_pair(next_pair_);
    bytes_ = 0;
  }
  return messages_.back().mutable_columns();
}

void BatchColumns::AddUnanswered() {
  bytes_ += server::AddUnanswered(wanted_, ColumnsForNext());
  ++next_pair_;
}

void BatchColumns::Add(const absl::StatusOr<Answer>& answer, const Hull& a, const Hull& b) {
  bytes_ += AddAnswer(answer, a, b, wanted_, ColumnsForNext());
  ++next_pair_;
}

void BatchColumns::Add(std::span<const RelationAnswer> answers) {
  while (!answers.empty()) {
    v1::AnswerColumns* const columns = ColumnsForNext();
    const size_t room = (Config::kReplyMessageBytes - bytes_ + kRelationBytes - 1) / kRelationBytes;
    const std::span<const RelationAnswer> part = answers.first(std::min(room, answers.size()));
    const int rows = columns->relations_size() + static_cast<int>(part.size());
    columns->mutable_relations()->Reserve(rows);
    columns->mutable_rungs()->Reserve(rows);
    for (const RelationAnswer& answer : part) {
      columns->mutable_relations()->AddAlreadyReserved(EncodeRelation(answer.relation));
      columns->mutable_rungs()->AddAlreadyReserved(EncodeRung(answer.rung));
    }
    bytes_ += kRelationBytes * part.size();
    next_pair_ += part.size();
    answers = answers.subspan(part.size());
  }
}

std::vector<v1::BatchCheckCollisionsResponse> BatchColumns::Take() { return std::move(messages_); }

}  // namespace hulld::server
