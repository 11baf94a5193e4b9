#include "client/hullctl/parts/split_append.h"

#include <absl/strings/str_cat.h>

#include <optional>
#include <set>
#include <utility>

#include "client/base/status_macros.h"
#include "client/formats/text_number.h"
#include "client/hullctl/body/hull_segment.h"
#include "client/hullctl/parts/volume_comparison.h"
#include "client/hullctl/printing/json.h"
#include "client/hullctl/printing/progress_bar.h"
#include "client/hullctl/printing/table.h"
#include "client/point_messages.h"

namespace hulld {
namespace {

struct NamedPart {
  std::string hull_id;
  MeshPart part;
};

absl::StatusOr<std::vector<NamedPart>> ReadAll(const std::string& body_id,
                                               const std::vector<std::string>& files,
                                               SplitBy split) {
  std::vector<NamedPart> all;
  std::set<std::string> taken;
  for (const std::string& file : files) {
    HULLD_ASSIGN_OR_RETURN(auto parts, ReadParts(file, split));
    for (MeshPart& part : parts) {
      const std::string name = part.name.empty() ? "part" : part.name;
      const std::string segment = UniqueHullSegment(name, &taken);
      all.push_back({absl::StrCat(body_id, "/", segment), std::move(part)});
    }
  }
  return all;
}

absl::StatusOr<AppendTotals> Send(const Client& client, const NamedPart& named, bool create) {
  AppendOptions options;
  options.create_if_absent = create;
  HULLD_ASSIGN_OR_RETURN(auto stream, client.OpenAppend(named.hull_id, options));
  std::vector<double> xyz;
  for (const auto& vertex : named.part.mesh.vertices) {
    xyz.insert(xyz.end(), vertex.begin(), vertex.end());
  }
  HULLD_RETURN_IF_ERROR(SendInMessages(
      xyz, [&](v1::PointBlock points) { return stream->Append(std::move(points)); }));
  HULLD_RETURN_IF_ERROR(stream->Finish());
  return stream->totals();
}

// Returns the body of the parts as it was before the append; without an ID if it does not exist.
// ALREADY_EXISTS: a hull has its ID. NOT_FOUND: it does not exist, and `create` is false.
absl::StatusOr<v1::GetBodyResponse> FindBody(const Client& client, const std::string& id,
                                             bool create) {
  const absl::Status hull = client.GetHull(id).status();
  if (hull.ok() || absl::IsDataLoss(hull)) {
    return absl::AlreadyExistsError(absl::StrCat("hull ", Quoted(id),
                                                 " already exists, but --split creates a body with "
                                                 "this ID; use another ID; nothing was changed"));
  }
  if (!absl::IsNotFound(hull)) return hull;
  auto body = client.GetBody(id);
  if (!absl::IsNotFound(body.status())) return body;
  if (create) return v1::GetBodyResponse();
  return absl::NotFoundError(absl::StrCat(
      "body ", Quoted(id), " not found; pass --create to create it and the hulls of its parts"));
}

// Returns the body with the parts: keeps existing pieces, and adds missing parts after them at the
// identity pose. Nullopt if no part is missing.
std::optional<v1::PutBodyRequest> Extended(const v1::GetBodyResponse& body, const std::string& id,
                                           const std::vector<NamedPart>& parts) {
  v1::PutBodyRequest request;
  request.set_body_id(id);
  *request.mutable_pieces() = body.pieces();
  request.set_if_revision(body.body().revision());
  std::set<std::string> had;
  for (const v1::Placement& piece : body.pieces()) had.insert(piece.hull_id());
  for (const NamedPart& part : parts) {
    if (had.insert(part.hull_id).second) request.add_pieces()->set_hull_id(part.hull_id);
  }
  if (request.pieces_size() == body.pieces_size()) return std::nullopt;
  return request;
}

// FAILED_PRECONDITION: the server would refuse the body with the parts.
absl::Status CheckPieces(const Client& client, const v1::GetBodyResponse& body,
                         const std::string& id, const std::vector<NamedPart>& parts) {
  const auto request = Extended(body, id, parts);
  if (!request.has_value()) return absl::OkStatus();
  HULLD_ASSIGN_OR_RETURN(const auto status, client.GetStatus());
  const auto pieces = static_cast<uint64_t>(request->pieces_size());
  const uint64_t limit = status.limits().max_pieces_per_body();
  if (pieces <= limit) return absl::OkStatus();
  return absl::FailedPreconditionError(
      absl::StrCat("body ", Quoted(id), " would have ", pieces, " pieces; the limit is ", limit,
                   " (--max-pieces-per-body); use several bodies; nothing was changed"));
}

// Creates or extends the body of the parts, and prints the result.
ExitCode JoinParts(const Invocation& run, const Client& client, const v1::GetBodyResponse& found,
                   const std::string& id, const std::vector<NamedPart>& parts) {
  v1::BodyInfo body = found.body();
  const auto request = Extended(found, id, parts);
  if (request.has_value()) {
    const auto put = client.PutBody(*request);
    if (!put.ok()) {
      run.err << "hullctl: all parts were appended, but not added to body " << id << "\n";
      return run.Fail(put.status());
    }
    body = put->body();
  }
  const uint64_t added = body.piece_count() - static_cast<uint64_t>(found.pieces_size());
  JsonObject json;
  json.Add("bodyId", id)
      .Add("pieces", uint64_t{body.piece_count()})
      .Add("added", added)
      .Add("revision", uint64_t{body.revision()});
  if (run.PrintForPrograms(json.Close(), id)) return ExitCode::kDone;
  if (added == 0) {
    run.out << "body " << id << " already has all parts, at revision " << body.revision() << "\n";
  } else {
    run.out << "body " << id << (found.pieces().empty() ? " created" : " extended")
            << " at revision " << body.revision() << ", " << Counted(body.piece_count(), "piece")
            << "\n";
  }
  return ExitCode::kDone;
}

}  // namespace

ExitCode AppendParts(const Invocation& run, const std::string& body_id,
                     const std::vector<std::string>& files, SplitBy split, bool create) {
  HULLD_ASSIGN_OR_FAIL(run.FailUsage, const auto parts, ReadAll(body_id, files, split));
  const Client client = run.MakeClient();
  HULLD_ASSIGN_OR_FAIL(run.Fail, const auto body, FindBody(client, body_id, create));
  if (absl::Status fits = CheckPieces(client, body, body_id, parts); !fits.ok()) {
    return run.Fail(fits);
  }
  ProgressBar bar(run.err, run.shows_progress, "parts", parts.size());
  Table table;
  table.Row({"HULL", "TRIANGLES", "POINTS", "VERTICES", "VOLUME OF THE HULL"});
  for (const NamedPart& named : parts) {
    const auto totals = Send(client, named, create);
    bar.Clear();
    if (!totals.ok()) {
      run.err << "hullctl: " << &named - parts.data() << " of " << parts.size()
              << " parts were appended before this error\n";
      return run.Fail(totals.status());
    }
    HULLD_ASSIGN_OR_FAIL(
        run.Fail, const auto volumes,
        CompareVolumes(client, named.hull_id, named.part.mesh.vertices.size(), named.part.mesh));
    WarnOfVolumeRatio(run, named.hull_id, volumes.ratio);
    JsonObject json;
    json.Add("hullId", named.hull_id)
        .Add("triangles", uint64_t{named.part.mesh.triangles.size()})
        .Add("vertices", totals->vertex_count);
    if (volumes.ratio) json.AddJson("volumeRatio", absl::StrCat(*volumes.ratio));
    run.PrintForPrograms(json.Close(), named.hull_id);
    table.Row({named.hull_id, absl::StrCat(named.part.mesh.triangles.size()),
               absl::StrCat(named.part.mesh.vertices.size()), absl::StrCat(totals->vertex_count),
               volumes.text.empty() ? "-" : volumes.text});
  }
  if (!run.names() && !run.json()) table.Print(run.out);
  return JoinParts(run, client, body, body_id, parts);
}

}  // namespace hulld
