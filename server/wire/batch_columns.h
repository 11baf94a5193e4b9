#ifndef HULLD_SERVER_WIRE_BATCH_COLUMNS_H_
#define HULLD_SERVER_WIRE_BATCH_COLUMNS_H_

#include <cstddef>
#include <cstdint>
#include <vector>

#include "hulld/v1/collision.pb.h"

namespace hulld::server {

// Encodes consecutive answers of a batch as columns, split into messages of about 1 MiB.
class BatchColumns {
 public:
  // head: the message in which the columns start. first_pair: index of the first pair.
  BatchColumns(v1::BatchCheckCollisionsResponse head, const v1::Wanted& wanted,
               uint64_t first_pair);

  // Adds the next pair: `add_row` adds its row to the columns and returns its size, as AddAnswer
  // does.
  template <typename AddRow>
  void Add(AddRow add_row) {
    bytes_ += add_row(ColumnsForNext());
    ++next_pair_;
  }

  std::vector<v1::BatchCheckCollisionsResponse> Take();

 private:
  // Columns of the message for the next row.
  v1::AnswerColumns* ColumnsForNext();

  const v1::Wanted wanted_;
  uint64_t next_pair_;
  std::vector<v1::BatchCheckCollisionsResponse> messages_;
  // Estimated size of the last message.
  size_t bytes_;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_WIRE_BATCH_COLUMNS_H_
