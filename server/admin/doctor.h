#ifndef HULLD_SERVER_ADMIN_DOCTOR_H_
#define HULLD_SERVER_ADMIN_DOCTOR_H_

#include <string>
#include <vector>

namespace hulld::server {

// 'hulld doctor': looks at every hull of a store without changing anything: reads its record and
// its vertices, builds it, compares it with what the record says, and audits it by other means than
// the builder. With --cut-log it first cuts a damaged log. arguments: those after "doctor". Prints
// a report, and returns the exit status of the process: 0 when all is well, 1 when something is
// damaged, 2 when the arguments are wrong or there is no store to look at.
int RunDoctor(const std::vector<std::string>& arguments);

}  // namespace hulld::server

#endif  // HULLD_SERVER_ADMIN_DOCTOR_H_
