#ifndef HULLD_CLIENT_HULLCTL_COMMAND_LINE_COMMAND_H_
#define HULLD_CLIENT_HULLCTL_COMMAND_LINE_COMMAND_H_

#include <absl/status/status.h>

#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <ostream>
#include <string>
#include <vector>

#include "client/hullctl/command_line/exit_code.h"
#include "client/hullctl/help/command_description.h"

// CLI11 parses; command.cc alone includes its header, which takes 20 s to compile.
namespace CLI {
class App;
class Option;
}  // namespace CLI

namespace hulld {

inline constexpr uint64_t kAnyNumber = std::numeric_limits<uint64_t>::max();

// A declared option or argument, for further properties.
class Option {
 public:
  Option& Required();
  // How the help names the value.
  Option& ValueName(const std::string& name);
  // What completion offers for the value.
  Option& Completes(ValueKind kind);
  // The environment variable that the help names; the code that declares the option reads it.
  Option& Variable(const std::string& variable);
  // Only these values are allowed.
  Option& OneOf(const std::vector<std::string>& values);
  // Refuses values for which `check` returns a text, which says why.
  Option& Check(std::function<std::string(const std::string&)> check);
  // Allowed only together with `other`.
  Option& Needs(const Option& other);

 private:
  friend class Command;
  Option(CLI::Option* option, OptionDescription* description)
      : option_(option), description_(description) {}

  CLI::Option* option_;
  OptionDescription* description_;
};

// hullctl or one of its commands, while it is declared. A handle: copies stand for the same
// command.
//
// Names of options are as in "--out" and "-o,--out"; a name without a dash is an argument. The
// variables that values go to must outlive the parsing.
class Command {
 public:
  // Commands that are added from here on stand under this heading in the help.
  void BeginGroup(const std::string& title);
  // A command below this one. Options of this one may stand behind it, too.
  Command AddCommand(const std::string& name, const std::string& help);
  // One of the commands below must be given.
  void RequireCommand();

  Option AddText(const std::string& name, std::string* value, const std::string& help);
  Option AddTexts(const std::string& name, std::vector<std::string>* values,
                  const std::string& help);
  // An option that may be given again and again, one value each time.
  Option AddRepeated(const std::string& name, std::vector<std::string>* values,
                     const std::string& help);
  // `parse` takes the value; the message of its error is shown behind the option's name.
  Option AddParsed(const std::string& name, std::function<absl::Status(const std::string&)> parse,
                   const std::string& help);
  // The same, and it may be given again and again, one value each time.
  Option AddParsedEach(const std::string& name,
                       std::function<absl::Status(const std::string&)> parse,
                       const std::string& help);
  // A decimal whole number from `least` to `most`. (CLI11 itself reads 010 as eight.)
  Option AddNumber(const std::string& name, uint64_t least, uint64_t most, const std::string& help,
                   std::function<void(uint64_t)> take);
  // A finite length of at least 0.
  Option AddLength(const std::string& name, const std::string& help,
                   std::function<void(double)> take);
  Option AddFlag(const std::string& name, bool* value, const std::string& help);
  Option AddFlag(const std::string& name, std::function<void()> set, const std::string& help);

  // What the help says behind the options.
  void SetDetails(const std::string& text);
  void SetExamples(std::vector<Example> examples);
  // Neither help nor completion names it.
  void Hide();
  // Called at the end of the parsing when this command was given.
  void OnGiven(std::function<void()> callback);

 private:
  friend class CommandLine;
  Command(CLI::App* app, CommandDescription* description) : app_(app), description_(description) {}

  // The description of an option that is being added.
  OptionDescription* Describe(const std::string& names, const std::string& help);

  CLI::App* app_;
  CommandDescription* description_;
  std::string group_;
};

// The command line of a program.
class CommandLine {
 public:
  CommandLine(const std::string& name, const std::string& version, const std::string& help);
  ~CommandLine();

  // The program itself.
  Command root();

  // All that was declared.
  const CommandDescription& description() const { return description_; }

  // Parses the arguments that follow the program's name and calls what is to be called. Prints
  // help, version and errors, and then returns the code that the program is to end with; without a
  // code, the program is to go on.
  std::optional<ExitCode> Parse(const std::vector<std::string>& arguments, std::ostream& out,
                                std::ostream& err);

 private:
  // The last of the commands that were given.
  const CommandDescription& LastGiven() const;
  // What is wrong with the arguments; CLI11's words where nothing better is known.
  std::string Explain(const std::string& text) const;

  std::unique_ptr<CLI::App> app_;
  CommandDescription description_;
};

}  // namespace hulld

#endif  // HULLD_CLIENT_HULLCTL_COMMAND_LINE_COMMAND_H_
