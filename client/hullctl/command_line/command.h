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
#include <utility>
#include <vector>

#include "client/hullctl/help/command_description.h"

// A wrapper of CLI11. Only command.cc includes CLI11's header, which takes 20 s to compile.
namespace CLI {
class App;
class Option;
}  // namespace CLI

namespace hulld {

// Exit codes. A collision is an answer, not an error.
enum class ExitCode {
  kDone = 0,
  // The server refused the request or failed; or an audit, a comparison, or a judgement found a
  // fault or a difference.
  kRequestFailed = 1,
  // The command line or an input file is invalid, or an output file cannot be written.
  kUsage = 2,
  // No answer: the server is unreachable, is draining, or did not answer in time.
  kUnreachable = 3,
  // Some items of a batch failed; the rest succeeded.
  kSomeFailed = 4,
  // A certificate does not prove its answer.
  kInvalidCertificate = 5,
  // A certificate could not be checked: its hulls have changed or were deleted, or the answer has
  // none.
  kCannotCheck = 6,
};

inline constexpr char kExitCodeHelp[] =
    "Exit codes:\n"
    "  0  done (a collision is an answer, not an error)\n"
    "  1  the server refused the request; or an audit, 'scene diff', or 'judge' found a fault or\n"
    "     a difference\n"
    "  2  the command line or an input file is invalid, or a file cannot be written\n"
    "  3  no answer: the server is unreachable, is draining, or exceeded --timeout\n"
    "  4  some items of a batch failed\n"
    "  5  a certificate does not prove its answer\n"
    "  6  a certificate cannot be checked: its hulls changed or were deleted, or the answer has\n"
    "     no certificate; if a file is not a record of an answer, the exit code is 2\n";

inline constexpr uint64_t kAnyNumber = std::numeric_limits<uint64_t>::max();

// A declared option or argument; sets further properties.
class Option {
 public:
  Option& Required();
  // Sets the name of the value in the help.
  Option& ValueName(const std::string& name);
  // Sets the kind of values that completion offers.
  Option& Completes(ValueKind kind);
  // Sets the environment variable named in the help; the declaring code reads it.
  Option& Variable(const std::string& variable);
  // Allows only these values, in any letter case. The variable receives them as listed here.
  Option& OneOf(const std::vector<std::string>& values);
  // Rejects values for which `check` returns a nonempty reason.
  Option& Check(std::function<std::string(const std::string&)> check);
  // Allows the option only together with `other`.
  Option& Needs(const Option& other);

 private:
  friend class Command;
  Option(CLI::Option* option, OptionDescription* description)
      : option_(option), description_(description) {}

  CLI::Option* option_;
  OptionDescription* description_;
};

// The declaration of hullctl or one of its commands. A handle: copies refer to the same command.
//
// Option names have the forms "--out" and "-o,--out"; a name without a dash is an argument.
// Variables that receive values must outlive the parsing.
class Command {
 public:
  // Lists commands added after this call under this heading in the help.
  void BeginGroup(const std::string& title);
  // Adds a subcommand. Options of this command are also accepted after it.
  Command AddCommand(const std::string& name, const std::string& help);
  // Requires one of the subcommands.
  void RequireCommand();

  Option AddText(const std::string& name, std::string* value, const std::string& help);
  Option AddTexts(const std::string& name, std::vector<std::string>* values,
                  const std::string& help);
  // Adds an option that may be repeated, one value each.
  Option AddRepeated(const std::string& name, std::vector<std::string>* values,
                     const std::string& help);
  // Adds an option with a custom parser; the message of its error is shown after the option's name.
  Option AddParsed(const std::string& name, std::function<absl::Status(const std::string&)> parse,
                   const std::string& help);
  // Likewise; `parse` returns an absl::StatusOr with the value.
  template <typename Parse, typename T>
  Option AddParsed(const std::string& name, Parse parse, T* value, const std::string& help) {
    const auto take = [=](const std::string& text) {
      auto parsed = parse(text);
      if (!parsed.ok()) return parsed.status();
      *value = *std::move(parsed);
      return absl::OkStatus();
    };
    return AddParsed(name, take, help);
  }
  // Adds an option for one of several named values.
  template <typename T>
  Option AddChoice(const std::string& name, const std::vector<std::pair<const char*, T>>& choices,
                   T* value, const std::string& help) {
    std::vector<std::string> names;
    names.reserve(choices.size());
    for (const auto& [choice, meaning] : choices) names.emplace_back(choice);
    const auto take = [=](const std::string& text) {
      for (const auto& [choice, meaning] : choices) {
        if (text == choice) *value = meaning;
      }
      return absl::OkStatus();
    };
    return AddParsed(name, take, help).OneOf(names);
  }
  // Adds an option for a decimal integer from `min` to `max`. (CLI11 itself reads 010 as eight.)
  Option AddNumber(const std::string& name, uint64_t min, uint64_t max, const std::string& help,
                   std::function<void(uint64_t)> take);
  template <typename T>
  Option AddNumber(const std::string& name, uint64_t min, uint64_t max, const std::string& help,
                   T* value) {
    return AddNumber(name, min, max, help,
                     [value](uint64_t number) { *value = static_cast<T>(number); });
  }
  // Adds an option for a finite length of at least 0.
  Option AddLength(const std::string& name, const std::string& help,
                   std::function<void(double)> take);
  template <typename T>
  Option AddLength(const std::string& name, const std::string& help, T* value) {
    return AddLength(name, help, [value](double length) { *value = length; });
  }
  Option AddFlag(const std::string& name, bool* value, const std::string& help);
  Option AddFlag(const std::string& name, std::function<void()> set, const std::string& help);

  // Sets the help text after the options.
  void SetDetails(const std::string& text);
  void SetExamples(std::vector<Example> examples);
  // Hides the command from help and completion.
  void Hide();
  // Called at the end of the parsing if this command was given.
  void OnGiven(std::function<void()> callback);

 private:
  friend class CommandLine;
  Command(CLI::App* app, CommandDescription* description) : app_(app), description_(description) {}

  // Adds the description of a new option.
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

  // Returns the program itself.
  Command root();

  // Returns all declarations.
  const CommandDescription& description() const { return description_; }

  // Parses the arguments after the program's name and calls the callbacks of the given commands.
  // Prints help, version, or errors, and then returns the exit code; returns nullopt if the program
  // continues.
  std::optional<ExitCode> Parse(const std::vector<std::string>& arguments, std::ostream& out,
                                std::ostream& err);

 private:
  // Returns the last command given.
  const CommandDescription& LastGiven() const;
  // Returns an explanation of an argument error; CLI11's text if no better one is known.
  std::string Explain(const std::string& text) const;

  std::unique_ptr<CLI::App> app_;
  CommandDescription description_;
};

}  // namespace hulld

#endif  // HULLD_CLIENT_HULLCTL_COMMAND_LINE_COMMAND_H_
