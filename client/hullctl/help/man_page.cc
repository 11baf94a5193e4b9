#include "client/hullctl/help/man_page.h"

#include <absl/strings/ascii.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_join.h>
#include <absl/strings/str_replace.h>
#include <absl/strings/str_split.h>

#include "client/hullctl/help/help_text.h"

namespace hulld {
namespace {

// Escapes text for roff: no line begins with a control character, and hyphens and quotes can be
// copied from the page.
std::string Escaped(const std::string& text) {
  std::string result = absl::StrReplaceAll(text, {{"\\", "\\e"},
                                                  {"-", "\\-"},
                                                  {"'", "\\(aq"},
                                                  {"^", "\\(ha"},
                                                  {"~", "\\(ti"},
                                                  {"`", "\\(ga"}});
  if (!result.empty() && result[0] == '.') result.insert(0, "\\&");
  return absl::StrReplaceAll(result, {{"\n.", "\n\\&."}});
}

// Keeps lines unchanged.
std::string Verbatim(const std::string& text) {
  return absl::StrCat(".nf\n", Escaped(text), "\n.fi\n");
}

// Fills paragraphs; keeps indented lines unchanged.
std::string Flowing(const std::string& text) {
  std::string result;
  bool verbatim = false;
  for (const absl::string_view line : absl::StrSplit(text, '\n')) {
    const bool indented = !line.empty() && line[0] == ' ';
    if (indented != verbatim) absl::StrAppend(&result, indented ? ".nf\n" : ".fi\n");
    verbatim = indented;
    absl::StrAppend(&result, line.empty() ? ".PP" : Escaped(std::string(line)), "\n");
  }
  return result + (verbatim ? ".fi\n" : "");
}

void AppendOptionItems(const CommandDescription& command, bool arguments, std::string* page) {
  for (const OptionDescription& option : command.options) {
    if (option.hidden || option.is_argument() != arguments) continue;
    std::vector<std::string> names = option.names;
    if (arguments) names = {OptionHeading(option)};
    for (std::string& name : names) name = "\\fB" + Escaped(name) + "\\fR";
    absl::StrAppend(page, ".TP\n", absl::StrJoin(names, ", "));
    if (!arguments && !option.value_name.empty()) {
      absl::StrAppend(page, " \\fI", Escaped(option.value_name), "\\fR");
    }
    absl::StrAppend(page, "\n", Escaped(OptionHelp(option)), ".\n");
  }
}

void AppendHeading(const std::string& title, std::string* page) {
  absl::StrAppend(page, ".SH ", absl::AsciiStrToUpper(title), "\n");
}

// Appends options, details, and examples of a command and of its subcommands.
void AppendCommand(const CommandDescription& command, std::string* page) {
  AppendOptionItems(command, true, page);
  AppendOptionItems(command, false, page);
  if (!command.details.empty()) absl::StrAppend(page, ".PP\n", Flowing(command.details));
  for (const auto& below : command.commands) {
    if (below->hidden) continue;
    absl::StrAppend(page, ".SS \"", Escaped(UsageText(*below)), "\"\n", Escaped(below->help),
                    ".\n");
    AppendCommand(*below, page);
  }
}

void CollectExamples(const CommandDescription& command, std::vector<std::string>* lines) {
  for (const Example& example : command.examples) {
    if (!example.purpose.empty()) lines->push_back("# " + example.purpose);
    lines->push_back("$ " + example.command);
  }
  for (const auto& below : command.commands) CollectExamples(*below, lines);
}

}  // namespace

std::string ManPageName(const CommandDescription& command) {
  return absl::StrReplaceAll(command.path, {{" ", "-"}}) + ".1";
}

std::string ManPage(const CommandDescription& program, const CommandDescription& command,
                    const std::string& version, const std::vector<ManSection>& sections) {
  const bool is_program = &program == &command;
  const std::string title = absl::StrReplaceAll(command.path, {{" ", "-"}});
  std::string page = absl::StrCat(".TH ", absl::AsciiStrToUpper(Escaped(title)), " 1 \"\" \"",
                                  program.name, " ", version, "\" \"hulld\"\n");
  AppendHeading("name", &page);
  absl::StrAppend(&page, Escaped(title), " \\- ", Escaped(command.help), "\n");
  AppendHeading("synopsis", &page);
  absl::StrAppend(&page, "\\fB", Escaped(UsageText(command)), "\\fR\n");
  if (is_program) {
    for (const CommandGroup& group : GroupsOf(command)) {
      AppendHeading(group.title, &page);
      for (const CommandDescription* below : group.commands) {
        absl::StrAppend(&page, ".TP\n\\fB", Escaped(title + "-" + below->name), "\\fR(1)\n",
                        Escaped(below->help), ".\n");
      }
    }
    AppendHeading("options of every command", &page);
    AppendOptionItems(command, false, &page);
    AppendHeading("notes", &page);
    absl::StrAppend(&page, Verbatim(command.details));
  } else {
    AppendHeading("description", &page);
    absl::StrAppend(&page, Escaped(command.help), ".\n");
    AppendCommand(command, &page);
  }
  for (const ManSection& section : sections) {
    AppendHeading(section.title, &page);
    absl::StrAppend(&page, Flowing(section.text));
  }
  std::vector<std::string> examples;
  if (is_program) {
    for (const Example& example : command.examples) examples.push_back("$ " + example.command);
  } else {
    CollectExamples(command, &examples);
  }
  if (!examples.empty()) {
    AppendHeading("examples", &page);
    absl::StrAppend(&page, Verbatim(absl::StrJoin(examples, "\n")));
  }
  if (!is_program) {
    AppendHeading("see also", &page);
    absl::StrAppend(&page, "\\fB", Escaped(program.name),
                    "\\fR(1) describes the options of every command, contexts, and exit codes.\n");
  }
  return page;
}

}  // namespace hulld
