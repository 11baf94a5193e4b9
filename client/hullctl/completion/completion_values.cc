#include <absl/strings/match.h>
#include <absl/strings/str_cat.h>

#include <algorithm>
#include <set>
#include <string>

#include "client/hullctl/command_line/connection.h"
#include "client/hullctl/command_line/invocation.h"
#include "client/hullctl/completion/completion.h"
#include "client/hullctl/context/context_file.h"

namespace hulld {
namespace {

// Bounds the delay for an interactive user.
constexpr std::chrono::milliseconds kTimeout(500);
// Maximum number of listed IDs, to keep within that delay.
constexpr uint64_t kMaxListed = 20000;
// Longer lists are abbreviated to ID segments, as they exceed a screen.
constexpr size_t kMaxShown = 100;

std::vector<Candidate> Contexts(const std::string& start) {
  const auto file = ReadContextFile();
  std::vector<Candidate> candidates;
  if (!file.ok()) return candidates;
  for (const auto& [name, settings] : file->contexts) {
    if (absl::StartsWith(name, start)) candidates.push_back({name, settings.at("server")});
  }
  return candidates;
}

// Returns hulls, bodies, or both.
std::vector<Candidate> HullsAndBodies(Invocation* invocation, ValueKind kind,
                                      const std::string& start) {
  if (!ResolveConnection(invocation).ok()) return {};
  ClientOptions options = invocation->MakeClient().options();
  options.timeout = kTimeout;
  options.retry.max_attempts = 1;
  const Client client(options);
  std::vector<Candidate> candidates;
  bool many = false;
  if (kind != ValueKind::kBody) {
    const auto hulls = client.ListAllHulls(start, kMaxListed);
    if (!hulls.ok()) return {};
    for (const v1::HullInfo& hull : hulls->hulls()) {
      candidates.push_back({hull.hull_id(), absl::StrCat(hull.vertex_count(), " vertices")});
    }
    many = !hulls->next_page_token().empty();
  }
  if (kind != ValueKind::kHull) {
    const auto bodies = client.ListAllBodies(start, kMaxListed);
    if (!bodies.ok()) return {};
    for (const v1::BodyInfo& body : bodies->bodies()) {
      const char* const pieces = body.piece_count() == 1 ? " piece" : " pieces";
      candidates.push_back({body.body_id(), absl::StrCat("body, ", body.piece_count(), pieces)});
    }
    many = many || !bodies->next_page_token().empty();
  }
  std::ranges::sort(candidates, {}, &Candidate::text);
  std::set<std::string> parts;
  for (const Candidate& candidate : candidates) {
    parts.insert(candidate.text.substr(0, candidate.text.find('/', start.size()) + 1));
  }
  many = many || candidates.size() > kMaxShown;
  // An ID without a further "/" has no segment.
  if (!many || parts.contains("")) return candidates;
  candidates.clear();
  for (const std::string& part : parts) {
    candidates.push_back({part, kind == ValueKind::kBody ? "bodies" : "hulls"});
  }
  return candidates;
}

}  // namespace

ValueSource ValuesFor(Invocation* invocation) {
  return [invocation](ValueKind kind, const std::string& start) {
    return kind == ValueKind::kContext ? Contexts(start) : HullsAndBodies(invocation, kind, start);
  };
}

}  // namespace hulld
