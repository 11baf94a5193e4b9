#include "client/hullctl/command_line/command.h"

#include <absl/strings/match.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_join.h>
#include <absl/strings/str_split.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <system_error>

#include "client/formats/text_number.h"
#include "client/hullctl/help/help_text.h"
#include "client/hullctl/help/suggestion.h"

namespace hulld {
namespace {

// "-o,--out" -> "--out".
std::string LongName(const std::string& names) { return names.substr(names.rfind(',') + 1); }

const CLI::App& LastApp(const CLI::App& app) {
  const std::vector<CLI::App*> given = app.get_subcommands();
  return given.empty() ? app : LastApp(*given.back());
}

bool IsOption(const std::string& word) { return word.size() > 1 && word[0] == '-' && word != "--"; }

std::vector<std::string> OptionNames(const CommandDescription& command) {
  std::vector<std::string> names;
  for (const OptionDescription& option : command.options) {
    if (!option.is_argument() && !option.hidden) names.push_back(option.long_name());
  }
  return names;
}

std::vector<std::string> CommandNames(const CommandDescription& command) {
  std::vector<std::string> names;
  for (const auto& below : command.commands) {
    if (!below->hidden) names.push_back(below->name);
  }
  return names;
}

// Rejects values that no message of the contract can contain. Names of files may be any bytes.
void CheckUtf8(CLI::Option* option, const OptionDescription* description) {
  const auto check = [description](const std::string& value) -> std::string {
    const ValueKind kind = description->value_kind;
    std::error_code ignored;
    const bool is_file = kind == ValueKind::kFile || kind == ValueKind::kDirectory ||
                         (kind == ValueKind::kShape && std::filesystem::exists(value, ignored));
    return is_file || IsUtf8(value) ? "" : Quoted(value) + " is not UTF-8";
  };
  option->check(CLI::Validator(check, ""));
}

}  // namespace

Option& Option::Required() {
  option_->required();
  description_->required = true;
  return *this;
}

Option& Option::ValueName(const std::string& name) {
  description_->value_name = name;
  if (name == "FILE") description_->value_kind = ValueKind::kFile;
  return *this;
}

Option& Option::Completes(ValueKind kind) {
  description_->value_kind = kind;
  return *this;
}

Option& Option::Variable(const std::string& variable) {
  description_->variable = variable;
  return *this;
}

Option& Option::OneOf(const std::vector<std::string>& values) {
  description_->choices = values;
  option_->transform(CLI::Validator(
      [values](std::string& value) -> std::string {
        for (const std::string& known : values) {
          if (!absl::EqualsIgnoreCase(value, known)) continue;
          value = known;
          return "";
        }
        return absl::StrCat(Quoted(value), " is not one of ", absl::StrJoin(values, ", "),
                            Suggestion(value, values));
      },
      ""));
  return *this;
}

Option& Option::Check(std::function<std::string(const std::string&)> check) {
  option_->check(CLI::Validator(
      [check = std::move(check)](const std::string& value) { return check(value); }, ""));
  return *this;
}

Option& Option::Needs(const Option& other) {
  option_->needs(other.option_);
  return *this;
}

OptionDescription* Command::Describe(const std::string& names, const std::string& help) {
  OptionDescription& option = description_->options.emplace_back();
  option.names = absl::StrSplit(names, ',');
  option.help = help;
  if (names == "FILE") option.value_kind = ValueKind::kFile;
  return &option;
}

void Command::BeginGroup(const std::string& title) { group_ = title; }

Command Command::AddCommand(const std::string& name, const std::string& help) {
  CLI::App* const command = app_->add_subcommand(name, help);
  command->fallthrough();
  auto description = std::make_unique<CommandDescription>();
  description->path = description_->path + " " + name;
  description->name = name;
  description->help = help;
  description->group = group_;
  description_->commands.push_back(std::move(description));
  return Command(command, description_->commands.back().get());
}

void Command::RequireCommand() { app_->require_subcommand(1); }

Option Command::AddText(const std::string& name, std::string* value, const std::string& help) {
  OptionDescription* const description = Describe(name, help);
  if (!description->is_argument()) description->value_name = "TEXT";
  CLI::Option* const option = app_->add_option(name, *value, help);
  CheckUtf8(option, description);
  return Option(option, description);
}

Option Command::AddTexts(const std::string& name, std::vector<std::string>* values,
                         const std::string& help) {
  OptionDescription* const description = Describe(name, help);
  description->repeated = true;
  CLI::Option* const option = app_->add_option(name, *values, help);
  CheckUtf8(option, description);
  return Option(option, description);
}

Option Command::AddRepeated(const std::string& name, std::vector<std::string>* values,
                            const std::string& help) {
  OptionDescription* const description = Describe(name, help);
  description->value_name = "TEXT";
  CLI::Option* const option = app_->add_option(name, *values, help);
  option->allow_extra_args(false);
  CheckUtf8(option, description);
  return Option(option, description);
}

Option Command::AddParsed(const std::string& name,
                          std::function<absl::Status(const std::string&)> parse,
                          const std::string& help) {
  const auto take = [name = LongName(name), parse = std::move(parse)](const std::string& text) {
    const absl::Status parsed = parse(text);
    if (!parsed.ok()) throw CLI::ValidationError(name, std::string(parsed.message()));
  };
  OptionDescription* const description = Describe(name, help);
  if (!description->is_argument()) description->value_name = "TEXT";
  return Option(app_->add_option_function<std::string>(name, take, help), description);
}

Option Command::AddNumber(const std::string& name, uint64_t min, uint64_t max,
                          const std::string& help, std::function<void(uint64_t)> take) {
  const auto parse = [min, max, take = std::move(take)](const std::string& text) {
    uint64_t number = 0;
    if (ParseUnsigned(text, &number) && number >= min && number <= max) {
      take(number);
      return absl::OkStatus();
    }
    return absl::InvalidArgumentError(
        max == kAnyNumber
            ? absl::StrCat(Quoted(text), " is not a whole number of at least ", min)
            : absl::StrCat(Quoted(text), " is not a whole number from ", min, " to ", max));
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
  return Option(app_->add_flag(name, *value, help), Describe(name, help));
}

Option Command::AddFlag(const std::string& name, std::function<void()> set,
                        const std::string& help) {
  return Option(app_->add_flag_callback(name, std::move(set), help), Describe(name, help));
}

void Command::SetDetails(const std::string& text) { description_->details = text; }

void Command::SetExamples(std::vector<Example> examples) {
  description_->examples = std::move(examples);
}

void Command::Hide() { description_->hidden = true; }

void Command::OnGiven(std::function<void()> callback) { app_->callback(std::move(callback)); }

CommandLine::CommandLine(const std::string& name, const std::string& version,
                         const std::string& help)
    : app_(std::make_unique<CLI::App>(help, name)) {
  app_->set_version_flag("--version", name + " " + version);
  description_.path = name;
  description_.name = name;
  description_.help = help;
  for (const auto& [names, does] :
       {std::pair<const char*, const char*>{"-h,--help", "Show this help and exit"},
        {"--version", "Show the version and exit"}}) {
    OptionDescription& option = description_.options.emplace_back();
    option.names = absl::StrSplit(names, ',');
    option.help = does;
  }
}

CommandLine::~CommandLine() = default;

Command CommandLine::root() { return Command(app_.get(), &description_); }

const CommandDescription& CommandLine::LastGiven() const {
  const CLI::App* app = &LastApp(*app_);
  std::vector<std::string> words;
  for (; app != app_.get(); app = app->get_parent()) words.insert(words.begin(), app->get_name());
  return *FindCommand(description_, words);
}

std::string CommandLine::Explain(const std::string& text) const {
  const CommandDescription& command = LastGiven();
  std::vector<std::string> rest = app_->remaining(/*recurse=*/true);
  // For an unknown command, CLI11 also reports a missing one.
  const bool needs_command = LastApp(*app_).get_require_subcommand_min() > 0;
  if (needs_command && !rest.empty() && !IsOption(rest.front())) {
    const std::vector<std::string> known = CommandNames(command);
    std::string hint = Suggestion(rest.front(), known);
    const bool few = command.path != command.name && known.size() < 8;
    if (hint.empty() && few) hint = absl::StrCat("; commands: ", absl::StrJoin(known, ", "));
    return absl::StrCat("'", command.path, "' has no command ", Quoted(rest.front()), hint);
  }
  // CLI11 also returns the "--" that precedes arguments.
  const bool has_mark = std::erase(rest, "--") > 0;
  for (const std::string& word : rest) {
    if (!IsOption(word)) continue;
    const std::string name = word.substr(0, word.find('='));
    std::vector<std::string> known = OptionNames(command);
    for (const std::string& global : OptionNames(description_)) known.push_back(global);
    // After "--", the name of an option is an argument.
    if (has_mark && std::find(known.begin(), known.end(), name) != known.end()) break;
    return absl::StrCat("'", command.path, "' has no option ", Quoted(name),
                        Suggestion(name, known));
  }
  if (needs_command) {
    return absl::StrCat("no command given; usage: ", UsageText(command));
  }
  if (!rest.empty()) {
    const std::string known = absl::StrJoin(CommandNames(command), ", ");
    return absl::StrCat("unexpected argument ", Quoted(rest.front()),
                        known.empty() ? "" : "; commands: ", known,
                        "; usage: ", UsageText(command));
  }
  return text;
}

std::optional<ExitCode> CommandLine::Parse(const std::vector<std::string>& arguments,
                                           std::ostream& out, std::ostream& err) {
  // CLI11 would take the argument after "--name=" as its value, and expects the reverse order.
  std::vector<std::string> reversed;
  const auto end = std::find(arguments.begin(), arguments.end(), "--");
  for (auto word = arguments.begin(); word != arguments.end(); ++word) {
    const bool is_empty =
        word < end && word->starts_with("--") && word->find('=') + 1 == word->size();
    reversed.push_back(word->substr(0, word->size() - (is_empty ? 1 : 0)));
    if (is_empty) reversed.emplace_back();
  }
  std::reverse(reversed.begin(), reversed.end());
  std::string problem;
  try {
    app_->parse(reversed);
    return std::nullopt;
  } catch (const CLI::CallForHelp&) {
    const std::vector<std::string> rest = app_->remaining(/*recurse=*/true);
    const bool unknown = LastApp(*app_).get_require_subcommand_min() > 0 && !rest.empty();
    if (!unknown) {
      out << HelpText(LastGiven());
      return ExitCode::kDone;
    }
  } catch (const CLI::CallForVersion& version) {
    out << version.what() << "\n";
    return ExitCode::kDone;
  } catch (const CLI::RequiredError& error) {
    problem = absl::StrCat(error.what(), "; usage: ", UsageText(LastGiven()));
  } catch (const CLI::ArgumentMismatch& error) {
    // "--out: 1 required TEXT missing"
    const std::string text = error.what();
    const std::string name = text.substr(0, text.find(':'));
    const OptionDescription* option = FindOption(LastGiven(), name);
    if (option == nullptr) option = FindOption(description_, name);
    problem = option == nullptr || !option->takes_value() ? text
              : absl::StrContains(text, "At Most")
                  ? absl::StrCat(name, " may be given only once")
                  : absl::StrCat(name, " needs a value: ", name, " ", option->value_name);
  } catch (const CLI::ParseError& error) {
    problem = error.what();
  }
  err << description_.name << ": " << Explain(problem) << "\n"
      << "'" << LastGiven().path << " --help' for usage.\n";
  return ExitCode::kUsage;
}

}  // namespace hulld
