#ifndef HULLD_CLIENT_HULLCTL_HELP_COMMAND_DESCRIPTION_H_
#define HULLD_CLIENT_HULLCTL_HELP_COMMAND_DESCRIPTION_H_

#include <deque>
#include <memory>
#include <string>
#include <vector>

namespace hulld {

// What a value is, so that the shell can complete it. kPlaced: a hull or a body.
enum class ValueKind { kText, kFile, kDirectory, kHull, kBody, kPlaced, kContext };

// An option, a flag, or an argument that is known by its place.
struct OptionDescription {
  // "-o" and "--out"; or one name without a dash, as in "FILE": an argument.
  std::vector<std::string> names;
  std::string help;
  // How the value is named; empty for a flag.
  std::string value_name;
  // The environment variable that gives the value too, if there is one.
  std::string variable;
  // The only values that are taken; empty: any.
  std::vector<std::string> choices;
  ValueKind value_kind = ValueKind::kText;
  bool required = false;
  // An argument that stands for one or more words.
  bool repeated = false;
  bool hidden = false;

  bool is_argument() const { return names.front().front() != '-'; }
  bool takes_value() const { return is_argument() || !value_name.empty(); }
  // "--out" of "-o" and "--out".
  const std::string& long_name() const { return names.back(); }
};

struct Example {
  // What it is good for; empty: as the one before.
  std::string purpose;
  std::string command;
};

// A program or one of its commands: what help, man page and completion tell. It is filled where the
// command is declared (command_line/command.h), which is the only place that says these things.
struct CommandDescription {
  // With those of the commands above it: "hullctl backup save".
  std::string path;
  std::string name;
  // One line.
  std::string help;
  // The heading of the list that it stands in.
  std::string group;
  // Paragraphs, lines broken.
  std::string details;
  std::vector<Example> examples;
  // Neither help nor completion names it.
  bool hidden = false;
  std::deque<OptionDescription> options;
  std::vector<std::unique_ptr<CommandDescription>> commands;
};

// The command that `words`, each the name of one below the other, lead to; null when there is none.
const CommandDescription* FindCommand(const CommandDescription& program,
                                      const std::vector<std::string>& words);

// The option of the command with that name, as in "--out"; null when there is none.
const OptionDescription* FindOption(const CommandDescription& command, const std::string& name);

}  // namespace hulld

#endif  // HULLD_CLIENT_HULLCTL_HELP_COMMAND_DESCRIPTION_H_
