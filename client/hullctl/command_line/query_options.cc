#include "client/hullctl/command_line/query_options.h"

#include <CLI/CLI.hpp>
#include <cmath>
#include <utility>

#include "client/formats/text_number.h"

namespace hulld {

CLI::Option* AddLengthOption(CLI::App* command, const std::string& name, const std::string& help,
                             std::function<void(double)> take) {
  const auto parse = [name, take = std::move(take)](const std::string& text) {
    double length = 0;
    if (ParseDouble(text, &length) != NumberText::kNumber || !std::isfinite(length) || length < 0) {
      throw CLI::ValidationError(name, Quoted(text) + " is not a length of at least 0");
    }
    take(length);
  };
  return command->add_option_function<std::string>(name, parse, help)->type_name("LENGTH");
}

void AddQueryOptions(CLI::App* command, QueryWishes* wishes) {
  v1::Wanted* const wanted = &wishes->wanted;
  command->add_flag_callback(
      "--textbook", [wishes] { wishes->method = v1::METHOD_TEXTBOOK_SAT; },
      "Use the textbook's separating-axis test instead of the certified search");
  command->add_flag_callback(
      "--axis", [wanted] { wanted->set_axis(true); },
      "Also show the separating or touching axis and the features on it");
  command->add_flag_callback(
      "--report", [wanted] { wanted->set_analysis(true); },
      "Also show time, sizes, axes tested and where separation was found");
  command->add_flag_callback(
      "--certificate", [wanted] { wanted->set_certificate(true); },
      "Also show what proves the relation: a direction, vertex pairs");
  command->add_flag_callback(
      "--separation", [wanted] { wanted->set_separation(true); },
      "Also show the distance, or minus the penetration depth, with its proven bound");
  AddLengthOption(command, "--max-error", "How large the bound of the separation may be",
                  [wanted](double length) {
                    wanted->set_separation(true);
                    wanted->set_max_error(length);
                  });
  command->add_flag_callback(
      "--witness", [wanted] { wanted->set_witness(true); },
      "Also show a point of each hull that attain the separation");
  AddLengthOption(command, "--clearance", "Also tell whether the separation is at most this",
                  [wanted](double length) { wanted->set_clearance(length); });
  AddLengthOption(command, "--tolerance",
                  "Allow the answer WITHIN_TOLERANCE where the separation is at most this, for "
                  "speed (default 0: exact)",
                  [wishes](double length) { wishes->tolerance = length; });
  command->add_flag_callback(
      "--verify",
      [wishes] {
        wishes->verify = true;
        wishes->wanted.set_certificate(true);
      },
      "Check the certificate at once, by exact arithmetic of hullctl's own");
}

}  // namespace hulld
