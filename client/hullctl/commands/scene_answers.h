#ifndef HULLD_CLIENT_HULLCTL_COMMANDS_SCENE_ANSWERS_H_
#define HULLD_CLIENT_HULLCTL_COMMANDS_SCENE_ANSWERS_H_

#include "client/hullctl/command_line/invocation.h"
#include "client/hullctl/command_line/query_options.h"
#include "client/hullctl/printing/answer_row.h"
#include "client/hullctl/scene/scene_file.h"

namespace hulld {

// Queries the pairs of a scene read from `file`, as 'hullctl batch' does.
ExitCode AnswerPairs(const Invocation& run, const std::string& file, const Scene& scene,
                     const QueryDetails& details, bool colliding);
// Prints the answer about a pair of placements, or the problem in place of it, followed by
// `suffix`.
void PrintPair(const Invocation& run, const Scene& scene, uint32_t a, uint32_t b,
               const AnswerRow& row, const std::string* problem, const std::string& suffix = "");
// Returns the form of bodies in queries. Certificates and the textbook's test apply to hulls only.
BodyForm FormFor(const QueryDetails& details);

}  // namespace hulld

#endif  // HULLD_CLIENT_HULLCTL_COMMANDS_SCENE_ANSWERS_H_
