#include "server/wire/batch_columns.h"

#include <utility>

#include "server/wire/answer_columns.h"

namespace hulld::server {

BatchColumns::BatchColumns(v1::BatchCheckCollisionsResponse head, const v1::Wanted& wanted,
                           uint64_t first_pair)
    : wanted_(wanted), next_pair_(first_pair), bytes_(head.ByteSizeLong()) {
  head.set_first_pair(first_pair);
  messages_.push_back(std::move(head));
}

v1::AnswerColumns* BatchColumns::ColumnsForNext() {
  if (bytes_ >= FullMessageBytes(wanted_)) {
    messages_.emplace_back().set_first_pair(next_pair_);
    bytes_ = 0;
  }
  return messages_.back().mutable_columns();
}

std::vector<v1::BatchCheckCollisionsResponse> BatchColumns::Take() { return std::move(messages_); }

}  // namespace hulld::server
