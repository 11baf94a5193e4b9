#ifndef HULLD_CLIENT_HULLCTL_HELP_HELP_TEXT_H_
#define HULLD_CLIENT_HULLCTL_HELP_HELP_TEXT_H_

#include <string>
#include <vector>

#include "client/hullctl/help/command_description.h"

namespace hulld {

// Returns the text of --help: purpose, usage, arguments, options, commands by group, details, and
// examples. Lines have at most 100 characters, except for preformatted ones.
std::string HelpText(const CommandDescription& command);

// Returns "hullctl check A B [OPTIONS]".
std::string UsageText(const CommandDescription& command);

// Returns "-o, --out FILE".
std::string OptionHeading(const OptionDescription& option);

// Returns the help of an option with its choices and variable.
std::string OptionHelp(const OptionDescription& option);

// The visible subcommands of a command, grouped, in the order of their declaration.
struct CommandGroup {
  std::string title;
  std::vector<const CommandDescription*> commands;
};
std::vector<CommandGroup> GroupsOf(const CommandDescription& command);

}  // namespace hulld

#endif  // HULLD_CLIENT_HULLCTL_HELP_HELP_TEXT_H_
