#ifndef HULLD_CLIENT_HULLCTL_HELP_COMMAND_DESCRIPTION_H_
#define HULLD_CLIENT_HULLCTL_HELP_COMMAND_DESCRIPTION_H_

#include <deque>
#include <memory>
#include <string>
#include <vector>

namespace hulld {

// Kind of a value, for completion. kPlaced: a hull or a body. kShape: a hull, a body, or a file.
enum class ValueKind { kText, kFile, kDirectory, kHull, kBody, kPlaced, kShape, kContext };

// An option, a flag, or a positional argument.
struct OptionDescription {
  // "-o" and "--out"; a single name without a dash, such as "FILE", is an argument.
  std::vector<std::string> names;
  std::string help;
  // Name of the value; empty for a flag. For an argument: its text in the usage, if that is not its
  // name.
  std::string value_name;
  // Environment variable that also sets the value, if any.
  std::string variable;
  // Allowed values; empty: any.
  std::vector<std::string> choices;
  ValueKind value_kind = ValueKind::kText;
  bool required = false;
  // True for an argument that takes several words.
  bool repeated = false;
  bool hidden = false;

  bool is_argument() const { return names.front().front() != '-'; }
  bool takes_value() const { return is_argument() || !value_name.empty(); }
  // Returns "--out" for "-o" and "--out".
  const std::string& long_name() const { return names.back(); }
};

struct Example {
  // Purpose of the example. If empty, the same as that of the previous example.
  std::string purpose;
  std::string command;
};

// Describes a program or one of its commands; help, man page, and completion are generated from it.
// Filled only where the command is declared (command_line/command.h).
struct CommandDescription {
  // Including the names of parent commands: "hullctl backup save".
  std::string path;
  std::string name;
  // One line.
  std::string help;
  // Heading of its list.
  std::string group;
  // Paragraphs with line breaks.
  std::string details;
  std::vector<Example> examples;
  // True: omitted from help and completion.
  bool hidden = false;
  std::deque<OptionDescription> options;
  std::vector<std::unique_ptr<CommandDescription>> commands;
};

// Returns the command at the path `words`; null if it does not exist.
const CommandDescription* FindCommand(const CommandDescription& program,
                                      const std::vector<std::string>& words);

// Returns the command's option with that name, such as "--out"; null if it does not exist.
const OptionDescription* FindOption(const CommandDescription& command, const std::string& name);

}  // namespace hulld

#endif  // HULLD_CLIENT_HULLCTL_HELP_COMMAND_DESCRIPTION_H_
