#ifndef HULLD_CLIENT_HULLCTL_HELP_MAN_PAGE_H_
#define HULLD_CLIENT_HULLCTL_HELP_MAN_PAGE_H_

#include <string>
#include <vector>

#include "client/hullctl/help/command_description.h"

namespace hulld {

// Returns the manual page of a program, or of a command with its subcommands, in roff for man(7),
// section 1. The footer shows `version`. The program's page adds `files` as extra sections.
struct ManSection {
  std::string title;
  std::string text;
};
std::string ManPage(const CommandDescription& program, const CommandDescription& command,
                    const std::string& version, const std::vector<ManSection>& sections);

// Returns "hullctl-backup.1" for the command "hullctl backup".
std::string ManPageName(const CommandDescription& command);

}  // namespace hulld

#endif  // HULLD_CLIENT_HULLCTL_HELP_MAN_PAGE_H_
