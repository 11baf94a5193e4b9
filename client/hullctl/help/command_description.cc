#include "client/hullctl/help/command_description.h"

#include <algorithm>

namespace hulld {

const CommandDescription* FindCommand(const CommandDescription& program,
                                      const std::vector<std::string>& words) {
  const CommandDescription* command = &program;
  for (const std::string& word : words) {
    const auto found = std::find_if(command->commands.begin(), command->commands.end(),
                                    [&word](const auto& below) { return below->name == word; });
    if (found == command->commands.end()) return nullptr;
    command = found->get();
  }
  return command;
}

const OptionDescription* FindOption(const CommandDescription& command, const std::string& name) {
  for (const OptionDescription& option : command.options) {
    if (std::find(option.names.begin(), option.names.end(), name) != option.names.end()) {
      return &option;
    }
  }
  return nullptr;
}

}  // namespace hulld
