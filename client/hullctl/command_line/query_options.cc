#include "client/hullctl/command_line/query_options.h"

namespace hulld {

void QueryDetails::Apply(v1::Wanted* file_wanted, double* file_tolerance) const {
  file_wanted->MergeFrom(wanted);
  if (tolerance.has_value()) *file_tolerance = *tolerance;
}

void AddWantedOptions(Command command, QueryDetails* wishes) {
  v1::Wanted* const wanted = &wishes->wanted;
  command.AddFlag(
      "--axis", [wanted] { wanted->set_axis(true); },
      "Also show the separating or touching axis and the features on it");
  command.AddFlag(
      "--report", [wanted] { wanted->set_analysis(true); },
      "Also show time, sizes, axes tested and where separation was found");
  command.AddFlag(
      "--certificate", [wanted] { wanted->set_certificate(true); },
      "Also show what proves the relation: a direction, vertex pairs");
  command.AddFlag(
      "--separation", [wanted] { wanted->set_separation(true); },
      "Also show the distance, or minus the penetration depth, with its proven bound");
  command.AddLength("--max-error", "How large the bound of the separation may be",
                    [wanted](double length) {
                      wanted->set_separation(true);
                      wanted->set_max_error(length);
                    });
  command.AddFlag(
      "--witness", [wanted] { wanted->set_witness(true); },
      "Also show a point of each hull that attain the separation");
  command.AddLength("--clearance", "Also tell whether the separation is at most this",
                    [wanted](double length) { wanted->set_clearance(length); });
  command.AddLength("--tolerance",
                    "Allow the answer WITHIN_TOLERANCE where the separation is at most this, for "
                    "speed (default 0: exact)",
                    [wishes](double length) { wishes->tolerance = length; });
}

void AddQueryOptions(Command command, QueryDetails* wishes) {
  AddWantedOptions(command, wishes);
  command.AddFlag(
      "--textbook", [wishes] { wishes->method = v1::METHOD_TEXTBOOK_SAT; },
      "Use the textbook's separating-axis test instead of the certified search");
  command.AddFlag(
      "--verify",
      [wishes] {
        wishes->verify = true;
        wishes->wanted.set_certificate(true);
      },
      "Check the certificate at once, by exact arithmetic of hullctl's own");
}

}  // namespace hulld
