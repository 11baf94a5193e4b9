#include "client/hullctl/command_line/command.h"

#include <absl/strings/str_cat.h>

#include <CLI/CLI.hpp>
#include <cmath>
#include <utility>

#include "client/formats/text_number.h"
#include "client/hullctl/command_line/unknown_command.h"

namespace hulld {
namespace {

// "-o,--out" -> "--out".
std::string LongName(const std::string& names) { return names.substr(names.rfind(',') + 1); }

// The last of the commands that were given.
const CLI::App& LastGiven(const CLI::App& app) {
  const std::vector<CLI::App*> given = app.get_subcommands();
  return given.empty() ? app : LastGiven(*given.back());
}

// What stands where a command must, if anything does.
std::optional<std::string> UnknownCommand(const CLI::App& app) {
  if (LastGiven(app).get_require_subcommand_min() == 0) return std::nullopt;
  const std::vector<std::string> rest = app.remaining(/*recurse=*/true);
  if (rest.empty() || rest.front().empty() || rest.front()[0] == '-') return std::nullopt;
  return rest.front();
}

std::vector<std::string> CommandsBelow(const CLI::App& app) {
  std::vector<std::string> names;
  for (const CLI::App* command : app.get_subcommands([](const CLI::App*) { return true; })) {
    names.push_back(command->get_name());
  }
  return names;
}

}  // namespace

Option& Option::Required() {
  option_->required();
  return *this;
}

Option& Option::ValueName(const std::string& name) {
  option_->type_name(name);
  return *this;
}

Option& Option::Environment(const std::string& variable) {
  option_->envname(variable);
  return *this;
}

Option& Option::OneOf(const std::vector<std::string>& values) {
  option_->check(CLI::IsMember(values));
  return *this;
}

Option& Option::Check(const std::string& name,
                      std::function<std::string(const std::string&)> check) {
  option_->check(CLI::Validator(
      [check = std::move(check)](const std::string& value) { return check(value); }, name));
  return *this;
}

Option& Option::Needs(const Option& other) {
  option_->needs(other.option_);
  return *this;
}

Command Command::AddCommand(const std::string& name, const std::string& help) {
  CLI::App* const command = app_->add_subcommand(name, help);
  command->fallthrough();
  return Command(command);
}

void Command::RequireCommand() { app_->require_subcommand(1); }

Option Command::AddText(const std::string& name, std::string* value, const std::string& help) {
  return Option(app_->add_option(name, *value, help));
}

Option Command::AddTexts(const std::string& name, std::vector<std::string>* values,
                         const std::string& help) {
  return Option(app_->add_option(name, *values, help));
}

Option Command::AddParsed(const std::string& name,
                          std::function<absl::Status(const std::string&)> parse,
                          const std::string& help) {
  const auto take = [name = LongName(name), parse = std::move(parse)](const std::string& text) {
    const absl::Status parsed = parse(text);
    if (!parsed.ok()) throw CLI::ValidationError(name, std::string(parsed.message()));
  };
  return Option(app_->add_option_function<std::string>(name, take, help));
}

Option Command::AddNumber(const std::string& name, uint64_t least, uint64_t most,
                          const std::string& help, std::function<void(uint64_t)> take) {
  const auto parse = [least, most, take = std::move(take)](const std::string& text) {
    uint64_t number = 0;
    if (ParseUnsigned(text, &number) && number >= least && number <= most) {
      take(number);
      return absl::OkStatus();
    }
    return absl::InvalidArgumentError(
        most == kAnyNumber
            ? absl::StrCat(Quoted(text), " is not a whole number of at least ", least)
            : absl::StrCat(Quoted(text), " is not a whole number from ", least, " to ", most));
  };
  return AddParsed(name, parse, help).ValueName("N");
}

Option Command::AddLength(const std::string& name, const std::string& help,
                          std::function<void(double)> take) {
  const auto parse = [take = std::move(take)](const std::string& text) {
    double length = 0;
    if (ParseDouble(text, &length) != NumberText::kNumber || !std::isfinite(length) || length < 0) {
      return absl::InvalidArgumentError(Quoted(text) + " is not a length of at least 0");
    }
    take(length);
    return absl::OkStatus();
  };
  return AddParsed(name, parse, help).ValueName("LENGTH");
}

Option Command::AddFlag(const std::string& name, bool* value, const std::string& help) {
  return Option(app_->add_flag(name, *value, help));
}

Option Command::AddFlag(const std::string& name, std::function<void()> set,
                        const std::string& help) {
  return Option(app_->add_flag_callback(name, std::move(set), help));
}

void Command::SetFooter(const std::string& text) { app_->footer(text); }

void Command::OnGiven(std::function<void()> callback) { app_->callback(std::move(callback)); }

CommandLine::CommandLine(const std::string& name, const std::string& version,
                         const std::string& help)
    : app_(std::make_unique<CLI::App>(help, name)) {
  app_->set_version_flag("--version", name + " " + version);
}

CommandLine::~CommandLine() = default;

Command CommandLine::root() { return Command(app_.get()); }

std::optional<ExitCode> CommandLine::Parse(const std::vector<std::string>& arguments,
                                           std::ostream& out, std::ostream& err) {
  // CLI11 takes the arguments from the back.
  std::vector<std::string> reversed(arguments.rbegin(), arguments.rend());
  try {
    app_->parse(reversed);
    return std::nullopt;
  } catch (const CLI::RequiredError& error) {
    // CLI11 says that a command is missing also when there is one that it does not know.
    const std::optional<std::string> word = UnknownCommand(*app_);
    if (!word.has_value()) {
      app_->exit(error, out, err);
    } else {
      err << ExplainUnknownCommand(*word, CommandsBelow(LastGiven(*app_)))
          << "\nRun with --help for more information.\n";
    }
    return ExitCode::kUsage;
  } catch (const CLI::ParseError& error) {
    return app_->exit(error, out, err) == 0 ? ExitCode::kDone : ExitCode::kUsage;
  }
}

}  // namespace hulld
