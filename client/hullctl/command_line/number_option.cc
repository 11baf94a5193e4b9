#include "client/hullctl/command_line/number_option.h"

#include <absl/strings/str_cat.h>

#include <CLI/CLI.hpp>
#include <utility>

#include "client/formats/text_number.h"

namespace hulld {

CLI::Option* AddNumberOption(CLI::App* command, const std::string& name, uint64_t least,
                             uint64_t most, const std::string& help,
                             std::function<void(uint64_t)> take) {
  const auto parse = [name, least, most, take = std::move(take)](const std::string& text) {
    uint64_t number = 0;
    if (!ParseUnsigned(text, &number) || number < least || number > most) {
      throw CLI::ValidationError(
          name,
          most == kAnyNumber
              ? absl::StrCat(Quoted(text), " is not a whole number of at least ", least)
              : absl::StrCat(Quoted(text), " is not a whole number from ", least, " to ", most));
    }
    take(number);
  };
  return command->add_option_function<std::string>(name, parse, help)->type_name("N");
}

}  // namespace hulld
