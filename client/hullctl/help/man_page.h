#ifndef HULLD_CLIENT_HULLCTL_HELP_MAN_PAGE_H_
#define HULLD_CLIENT_HULLCTL_HELP_MAN_PAGE_H_

#include <string>
#include <vector>

#include "client/hullctl/help/command_description.h"

namespace hulld {

// The manual page of a program, or of one of its commands with those below it, in roff for man(7),
// section 1. `version` stands in its footer. The program's page says what `files` holds in sections
// of its own.
struct ManSection {
  std::string title;
  std::string text;
};
std::string ManPage(const CommandDescription& program, const CommandDescription& command,
                    const std::string& version, const std::vector<ManSection>& sections);

// "hullctl-backup.1" for the command "hullctl backup".
std::string ManPageName(const CommandDescription& command);

}  // namespace hulld

#endif  // HULLD_CLIENT_HULLCTL_HELP_MAN_PAGE_H_
