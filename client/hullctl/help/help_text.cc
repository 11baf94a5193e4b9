#include "client/hullctl/help/help_text.h"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_join.h>
#include <absl/strings/str_split.h>

#include <algorithm>
#include <utility>

namespace hulld {
namespace {

constexpr size_t kHelpWidth = 100;
// Longer names have their text on the next line.
constexpr size_t kWidestName = 26;

using Entry = std::pair<std::string, std::string>;

// Wraps words at `width` characters; indents each line but the first.
std::string Wrapped(const std::string& text, size_t indent, size_t width) {
  std::string result;
  size_t column = 0;
  for (const absl::string_view word : absl::StrSplit(text, ' ', absl::SkipEmpty())) {
    if (column > 0 && column + 1 + word.size() > width) {
      absl::StrAppend(&result, "\n", std::string(indent, ' '));
      column = 0;
    }
    absl::StrAppend(&result, column > 0 ? " " : "", word);
    column += (column > 0 ? 1 : 0) + word.size();
  }
  return result;
}

// Appends two columns under a heading; nothing without entries.
void AppendList(const std::string& heading, const std::vector<Entry>& entries, std::string* text) {
  if (entries.empty()) return;
  size_t widest = 0;
  for (const auto& [name, help] : entries) {
    if (name.size() <= kWidestName) widest = std::max(widest, name.size());
  }
  const size_t indent = widest + 4;
  absl::StrAppend(text, "\n", heading, ":\n");
  for (const auto& [name, help] : entries) {
    absl::StrAppend(text, "  ", name);
    const bool fits = name.size() <= kWidestName;
    absl::StrAppend(text, fits ? "" : "\n",
                    std::string(fits ? indent - 2 - name.size() : indent, ' '));
    absl::StrAppend(text, Wrapped(help, indent, kHelpWidth - indent), "\n");
  }
}

std::vector<Entry> OptionEntries(const CommandDescription& command, bool arguments) {
  std::vector<Entry> entries;
  for (const OptionDescription& option : command.options) {
    if (option.hidden || option.is_argument() != arguments) continue;
    entries.emplace_back(OptionHeading(option), OptionHelp(option));
  }
  return entries;
}

}  // namespace

std::vector<CommandGroup> GroupsOf(const CommandDescription& command) {
  std::vector<CommandGroup> groups;
  for (const auto& below : command.commands) {
    if (below->hidden) continue;
    const std::string title = below->group.empty() ? "Commands" : below->group;
    auto group = std::ranges::find(groups, title, &CommandGroup::title);
    if (group == groups.end()) group = groups.insert(groups.end(), {title, {}});
    group->commands.push_back(below.get());
  }
  return groups;
}

std::string UsageText(const CommandDescription& command) {
  std::string arguments;
  for (const OptionDescription& option : command.options) {
    if (!option.is_argument() || option.hidden) continue;
    const std::string name = OptionHeading(option);
    absl::StrAppend(&arguments, " ", option.required ? name : "[" + name + "]");
  }
  // 'hullctl scene' works with a command and without.
  const char* const below = command.commands.empty() ? ""
                            : arguments.empty()      ? " COMMAND"
                                                     : " [COMMAND]";
  return command.path + below + arguments + " [OPTIONS]";
}

std::string OptionHeading(const OptionDescription& option) {
  if (option.is_argument()) {
    if (!option.value_name.empty()) return option.value_name;
    return option.names.front() + (option.repeated ? "..." : "");
  }
  // Aligns long names.
  std::string text = option.names.size() > 1 ? "" : "    ";
  absl::StrAppend(&text, absl::StrJoin(option.names, ", "));
  if (!option.value_name.empty()) absl::StrAppend(&text, " ", option.value_name);
  return text;
}

std::string OptionHelp(const OptionDescription& option) {
  std::string text = option.help;
  if (!option.choices.empty() && option.value_name != absl::StrJoin(option.choices, "|")) {
    absl::StrAppend(&text, "; one of ", absl::StrJoin(option.choices, ", "));
  }
  if (option.required && !option.is_argument()) absl::StrAppend(&text, " (required)");
  if (!option.variable.empty()) absl::StrAppend(&text, " [$", option.variable, "]");
  return text;
}

std::string HelpText(const CommandDescription& command) {
  std::string text = absl::StrCat(command.help, "\n\nUsage: ", UsageText(command), "\n");
  AppendList("Arguments", OptionEntries(command, true), &text);
  for (const CommandGroup& group : GroupsOf(command)) {
    std::vector<Entry> entries;
    for (const CommandDescription* below : group.commands) {
      entries.emplace_back(below->name, below->help);
    }
    AppendList(group.title, entries, &text);
  }
  const bool is_program = command.path == command.name;
  AppendList(is_program ? "Options of every command" : "Options", OptionEntries(command, false),
             &text);
  if (!command.details.empty()) absl::StrAppend(&text, "\n", command.details, "\n");
  if (!command.examples.empty()) absl::StrAppend(&text, "\nExamples:\n");
  for (const Example& example : command.examples) {
    if (!example.purpose.empty()) absl::StrAppend(&text, "  # ", example.purpose, "\n");
    absl::StrAppend(&text, "  ", example.command, "\n");
  }
  const std::string program = command.path.substr(0, command.path.find(' '));
  if (!command.commands.empty()) {
    absl::StrAppend(&text, "\n'", command.path, " COMMAND --help' explains a command.\n");
  } else {
    absl::StrAppend(&text, "\n'", program, " --help' lists the options of every command.\n");
  }
  return text;
}

}  // namespace hulld
