#include "client/hullctl/completion/completion_values.h"

#include <absl/strings/match.h>
#include <absl/strings/str_cat.h>

#include <set>
#include <string>
#include <utility>

#include "client/hullctl/command_line/connection.h"
#include "client/hullctl/context/context_file.h"

namespace hulld {
namespace {

// A person waits.
constexpr std::chrono::milliseconds kPatience(500);
// That a list takes little of that time.
constexpr uint64_t kMostHulls = 20000;
// More than fill a screen are shown by their parts.
constexpr size_t kMostShown = 100;

std::vector<Candidate> Contexts(const std::string& start) {
  const auto file = ReadContextFile();
  std::vector<Candidate> candidates;
  if (!file.ok()) return candidates;
  for (const auto& [name, settings] : file->contexts) {
    if (absl::StartsWith(name, start)) candidates.push_back({name, settings.at("server")});
  }
  return candidates;
}

std::vector<Candidate> Hulls(Invocation* invocation, const std::string& start) {
  if (!ResolveConnection(invocation).ok()) return {};
  ClientOptions options = invocation->MakeClient().options();
  options.timeout = kPatience;
  options.retry.max_attempts = 1;
  const auto listed = Client(options).ListAllHulls(start, kMostHulls);
  if (!listed.ok()) return {};
  std::vector<Candidate> candidates;
  std::set<std::string> parts;
  for (const v1::HullInfo& hull : listed->hulls()) {
    candidates.push_back({hull.hull_id(), absl::StrCat(hull.vertex_count(), " vertices")});
    parts.insert(hull.hull_id().substr(0, hull.hull_id().find('/', start.size()) + 1));
  }
  const bool many = candidates.size() > kMostShown || !listed->next_page_token().empty();
  // An ID without a further "/" has no part.
  if (!many || parts.contains("")) return candidates;
  candidates.clear();
  for (const std::string& part : parts) candidates.push_back({part, "hulls"});
  return candidates;
}

}  // namespace

ValueSource ValuesFor(Invocation* invocation) {
  return [invocation](ValueKind kind, const std::string& start) {
    return kind == ValueKind::kContext ? Contexts(start) : Hulls(invocation, start);
  };
}

}  // namespace hulld
