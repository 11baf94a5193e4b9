#ifndef HULLD_SERVER_STORE_POSTGRES_BATCH_STATEMENTS_H_
#define HULLD_SERVER_STORE_POSTGRES_BATCH_STATEMENTS_H_

#include <span>
#include <string>
#include <vector>

#include "server/store/postgres/parameters.h"
#include "server/store/store.h"

namespace hulld::server {

// Statements that prepare those of StatementsOf in a session.
std::string PrepareBatchStatements();

// What a batch of changes does to the tables, all but the row of the store: deletions first, then
// rows, each row once, however many changes of a hull there are. Cost: O(bytes of the vertices that
// are kept).
std::vector<Statement> StatementsOf(std::span<const Change* const> changes);

// What a batch adds to what the store holds, modulo 2^64. The vertices of a hull whose record was
// damaged when it ended stay counted.
StoreTotals AddedBy(std::span<const Change* const> changes);

}  // namespace hulld::server

#endif  // HULLD_SERVER_STORE_POSTGRES_BATCH_STATEMENTS_H_
