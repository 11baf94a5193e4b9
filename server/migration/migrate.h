#ifndef HULLD_SERVER_MIGRATION_MIGRATE_H_
#define HULLD_SERVER_MIGRATION_MIGRATE_H_

#include <ostream>
#include <string>
#include <vector>

namespace hulld::server {

// 'hulld migrate': copies a store that no server has open to another store, of the same kind or
// another, and compares the two. arguments: the command line after "migrate". Prints progress and
// results to `out`, and errors to `err`. Returns the exit status of the process: 0 if everything is
// copied and equal, 1 if it failed midway and can be resumed, 2 if it was refused and changed
// nothing.
int RunMigrate(const std::vector<std::string>& arguments, std::ostream& out, std::ostream& err);

}  // namespace hulld::server

#endif  // HULLD_SERVER_MIGRATION_MIGRATE_H_
