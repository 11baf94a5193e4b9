#ifndef HULLD_SERVER_SETTINGS_SUBCOMMAND_H_
#define HULLD_SERVER_SETTINGS_SUBCOMMAND_H_

#include <optional>
#include <ostream>
#include <string>
#include <variant>
#include <vector>

namespace hulld::server {

// A flag, or an option with a string as its value.
struct SubcommandOption {
  const char* name;
  std::variant<std::string*, bool*> value;
  const char* description;
  // Environment variable that provides the string if the option is missing; empty for none.
  const char* variable = "";
};

// Command line of a subcommand such as "hulld doctor".
struct Subcommand {
  const char* name;
  const char* description;
  std::vector<SubcommandOption> options;
  // Last paragraph of --help.
  const char* footer;

  // Sets the values of the options. Returns the exit status if the program must end, after printing
  // why: 0 for --help, 2 for invalid arguments. arguments: without the names of program and
  // subcommand.
  std::optional<int> Parse(const std::vector<std::string>& arguments, std::ostream& out,
                           std::ostream& err) const;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_SETTINGS_SUBCOMMAND_H_
