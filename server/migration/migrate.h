#ifndef HULLD_SERVER_MIGRATION_MIGRATE_H_
#define HULLD_SERVER_MIGRATION_MIGRATE_H_

#include <ostream>
#include <string>
#include <vector>

namespace hulld::server {

// 'hulld migrate': copies a store that no server has open to another place, of another kind or the
// same, and compares the two. arguments: those after "migrate". Prints what it did to `out`, and
// what is wrong to `err`. Returns the exit status of the process: 0 when all is copied and the
// same, 1 when it failed on its way and can be run again, 2 when it was refused and changed
// nothing.
int RunMigrate(const std::vector<std::string>& arguments, std::ostream& out, std::ostream& err);

}  // namespace hulld::server

#endif  // HULLD_SERVER_MIGRATION_MIGRATE_H_
