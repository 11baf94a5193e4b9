#ifndef HULLD_SERVER_ADMIN_DOCTOR_H_
#define HULLD_SERVER_ADMIN_DOCTOR_H_

#include <string>
#include <vector>

namespace hulld::server {

// 'hulld doctor': audits every hull of a store without changing it. For each hull, reads the record
// and the vertices, builds the hull, compares it with the record, and audits it with code that is
// independent of the builder. With --accept-loss, a damaged or incomplete log is accepted first.
// arguments: the command line after "doctor". Prints a report and returns the exit status: 0 if the
// store is sound; 1 if it is damaged; 2 if the arguments are wrong, or the store does not exist or
// is in use.
int RunDoctor(const std::vector<std::string>& arguments);

}  // namespace hulld::server

#endif  // HULLD_SERVER_ADMIN_DOCTOR_H_
