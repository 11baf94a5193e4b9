#include "client/hullctl/parts/split_append.h"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <memory>
#include <set>
#include <utility>

#include "client/hullctl/command_line/hull_segment.h"
#include "client/hullctl/parts/swell.h"
#include "client/hullctl/printing/json.h"
#include "client/hullctl/printing/progress_bar.h"
#include "client/hullctl/printing/table.h"

namespace hulld {
namespace {

// About a MiB a message.
constexpr size_t kPointsPerMessage = 40000;

struct NamedPart {
  std::string hull_id;
  MeshPart part;
};

absl::StatusOr<std::vector<NamedPart>> ReadAll(const std::string& hull_id,
                                               const std::vector<std::string>& files,
                                               SplitBy split) {
  std::vector<NamedPart> all;
  std::set<std::string> taken;
  for (const std::string& file : files) {
    auto parts = ReadParts(file, split);
    if (!parts.ok()) return parts.status();
    for (MeshPart& part : *parts) {
      const std::string name = part.name.empty() ? "part" : part.name;
      const std::string segment = UniqueHullSegment(name, &taken);
      all.push_back({absl::StrCat(hull_id, "/", segment), std::move(part)});
    }
  }
  return all;
}

absl::StatusOr<AppendTotals> Send(const Client& client, const NamedPart& named, bool create) {
  AppendOptions options;
  options.create_if_absent = create;
  auto stream = client.OpenAppend(named.hull_id, options);
  if (!stream.ok()) return stream.status();
  const auto& vertices = named.part.mesh.vertices;
  for (size_t begin = 0; begin < vertices.size(); begin += kPointsPerMessage) {
    const size_t end = std::min(begin + kPointsPerMessage, vertices.size());
    v1::PointBlock block;
    for (size_t i = begin; i < end; ++i) {
      for (const double x : vertices[i]) block.add_xyz(x);
    }
    if (absl::Status sent = (*stream)->Append(std::move(block)); !sent.ok()) return sent;
  }
  if (absl::Status finished = (*stream)->Finish(); !finished.ok()) return finished;
  return (*stream)->totals();
}

}  // namespace

ExitCode AppendParts(const Invocation& run, const std::string& hull_id,
                     const std::vector<std::string>& files, SplitBy split, bool create) {
  const auto parts = ReadAll(hull_id, files, split);
  if (!parts.ok()) return run.FailUsage(parts.status());
  const Client client = run.MakeClient();
  ProgressBar bar(run.err, run.shows_progress, "parts", parts->size());
  Table table;
  table.Row({"HULL", "TRIANGLES", "POINTS", "VERTICES", "VOLUME OF THE HULL"});
  for (const NamedPart& named : *parts) {
    const auto totals = Send(client, named, create);
    bar.Clear();
    if (!totals.ok()) {
      run.err << "hullctl: " << &named - parts->data() << " of " << parts->size()
              << " parts were appended before this error\n";
      return run.Fail(totals.status());
    }
    const auto swell =
        SwellOf(client, named.hull_id, named.part.mesh.vertices.size(), named.part.mesh);
    if (!swell.ok()) return run.Fail(swell.status());
    WarnOfSwell(run, named.hull_id, swell->ratio);
    if (run.names()) {
      run.out << named.hull_id << "\n";
    } else if (run.json()) {
      JsonObject object;
      object.Add("hullId", named.hull_id)
          .Add("triangles", uint64_t{named.part.mesh.triangles.size()})
          .Add("vertices", totals->vertex_count);
      if (swell->ratio) object.AddJson("volumeRatio", absl::StrCat(*swell->ratio));
      run.out << object.Close() << "\n";
    }
    table.Row({named.hull_id, absl::StrCat(named.part.mesh.triangles.size()),
               absl::StrCat(named.part.mesh.vertices.size()), absl::StrCat(totals->vertex_count),
               swell->text.empty() ? "-" : swell->text});
  }
  if (!run.names() && !run.json()) table.Print(run.out);
  return ExitCode::kDone;
}

}  // namespace hulld
