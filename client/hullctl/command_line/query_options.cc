#include "client/hullctl/command_line/query_options.h"

namespace hulld {

void AddWantedOptions(Command command, QueryDetails* details) {
  v1::Wanted* const wanted = &details->wanted;
  command.AddFlag(
      "--axis", [wanted] { wanted->set_axis(true); },
      "Show the separating or touching axis and its features");
  command.AddFlag(
      "--report", [wanted] { wanted->set_analysis(true); },
      "Show time, sizes, axes tested, and the separating axis");
  command.AddFlag(
      "--certificate", [wanted] { wanted->set_certificate(true); },
      "Show the certificate of the relation: a direction, vertex pairs");
  command.AddFlag(
      "--separation", [wanted] { wanted->set_separation(true); },
      "Show the distance, or minus the penetration depth, with its proven error bound");
  command.AddLength("--max-error", "Maximum error bound of the separation",
                    [wanted](double length) {
                      wanted->set_separation(true);
                      wanted->set_max_error(length);
                    });
  command.AddFlag(
      "--witness", [wanted] { wanted->set_witness(true); },
      "Show a point of each hull at which the separation is attained");
  command.AddFlag(
      "--normal", [wanted] { wanted->set_normal(true); },
      "Show the direction in which the separation is attained, with a bound on its angle");
  command.AddLength("--clearance", "Show whether the separation is at most this length",
                    [wanted](double length) { wanted->set_clearance(length); });
  command.AddLength(
      "--tolerance",
      "Allow the answer WITHIN_TOLERANCE for separations up to this, for speed (default 0: exact)",
      &details->tolerance);
}

void AddQueryOptions(Command command, QueryDetails* details) {
  AddWantedOptions(command, details);
  command.AddFlag(
      "--textbook", [details] { details->method = v1::METHOD_TEXTBOOK_SAT; },
      "Use the textbook separating-axis test instead of the certified search");
  command.AddFlag(
      "--verify",
      [details] {
        details->verify = true;
        details->wanted.set_certificate(true);
      },
      "Check the certificate with hullctl's own exact arithmetic");
}

}  // namespace hulld
