#include "server/settings/subcommand.h"

#include <CLI/CLI.hpp>
#include <utility>

namespace hulld::server {

std::optional<int> Subcommand::Parse(const std::vector<std::string>& arguments, std::ostream& out,
                                     std::ostream& err) const {
  constexpr int kExitUsage = 2;
  CLI::App app(description, name);
  for (const SubcommandOption& option : options) {
    if (bool* const* flag = std::get_if<bool*>(&option.value)) {
      app.add_flag(option.name, **flag, option.description);
    } else {
      app.add_option(option.name, *std::get<std::string*>(option.value), option.description)
          ->envname(option.variable);
    }
  }
  app.footer(footer);
  std::vector<std::string> reversed(arguments.rbegin(), arguments.rend());
  try {
    app.parse(std::move(reversed));
  } catch (const CLI::ParseError& error) {
    return app.exit(error, out, err) == 0 ? 0 : kExitUsage;
  }
  return std::nullopt;
}

}  // namespace hulld::server
