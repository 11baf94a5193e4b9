#ifndef HULLD_SERVER_STORE_POSTGRES_BATCH_STATEMENTS_H_
#define HULLD_SERVER_STORE_POSTGRES_BATCH_STATEMENTS_H_

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "server/store/postgres/session.h"
#include "server/store/store.h"

namespace hulld::server {

// Returns SQL that prepares the statements of StatementsOf in a session.
std::string PrepareBatchStatements();

// Statements that apply a batch of changes to the tables, except the row of the store: deletions
// first, then inserts, with each row written once, regardless of the number of changes to a hull.
// Cost: O(bytes of the remaining vertices).
std::vector<Statement> StatementsOf(std::span<const Change* const> changes);

// Statements that list the changes of a batch for peer servers: hulld_put_changes, which sessions
// of a shared store prepare.
std::vector<Statement> ListChanges(std::span<const Change* const> changes, uint64_t batch);

// Returns the change that a batch makes to the store's totals, modulo 2^64. The vertices of a hull
// that ended with a damaged record stay counted.
StoreTotals AddedBy(std::span<const Change* const> changes);

}  // namespace hulld::server

#endif  // HULLD_SERVER_STORE_POSTGRES_BATCH_STATEMENTS_H_
