#ifndef HULLD_CLIENT_HULLCTL_HELP_HELP_TEXT_H_
#define HULLD_CLIENT_HULLCTL_HELP_HELP_TEXT_H_

#include <string>
#include <vector>

#include "client/hullctl/help/command_description.h"

namespace hulld {

// What --help prints: purpose, usage, arguments, options, commands by group, details, examples; in
// lines of at most 100 characters, but for the caller's own.
std::string HelpText(const CommandDescription& command);

// "hullctl check A B [OPTIONS]".
std::string UsageText(const CommandDescription& command);

// "-o, --out FILE".
std::string OptionHeading(const OptionDescription& option);

// What an option's help adds to its text: choices, variable.
std::string OptionHelp(const OptionDescription& option);

// The commands below one, hidden ones left out, as groups in the order of their declaration.
struct CommandGroup {
  std::string title;
  std::vector<const CommandDescription*> commands;
};
std::vector<CommandGroup> GroupsOf(const CommandDescription& command);

}  // namespace hulld

#endif  // HULLD_CLIENT_HULLCTL_HELP_HELP_TEXT_H_
