
#include "client/hullctl/commands/commands.h"
#include "client/hullctl/printing/answer_text.h"
#include "client/hullctl/printing/json.h"
#include "client/hullctl/printing/table.h"

namespace hulld {
namespace {

std::string UptimeText(const google::protobuf::Duration& uptime) {
  const int64_t seconds = uptime.seconds();
  if (seconds < 60) return std::to_string(seconds) + " s";
  if (seconds < 3600) return std::to_string(seconds / 60) + " min";
  return std::to_string(seconds / 3600) + " h " + std::to_string(seconds / 60 % 60) + " min";
}

void AddMoreLimits(const v1::Limits& limits, Table* table) {
  table->Row({"max message bytes", std::to_string(limits.max_message_bytes())})
      .Row({"max points per hull", std::to_string(limits.max_points_per_hull())})
      .Row({"max placements", std::to_string(limits.max_placements())})
      .Row({"max calls", std::to_string(limits.max_calls())})
      .Row({"max waiting calls", std::to_string(limits.max_waiting_calls())})
      .Row({"max streams per client", std::to_string(limits.max_streams_per_client())})
      .Row({"max concurrent batches", std::to_string(limits.max_concurrent_batches())})
      .Row({"max calls per client", std::to_string(limits.max_calls_per_client())})
      .Row({"max batches per client", std::to_string(limits.max_batches_per_client())})
      .Row({"max pieces per body", std::to_string(limits.max_pieces_per_body())})
      .Row({"max writers per hull", std::to_string(limits.max_writers_per_hull())})
      .Row({"memory limit bytes", std::to_string(limits.memory_limit_bytes())})
      .Row({"request memory bytes", std::to_string(limits.request_memory_bytes())});
  if (limits.has_max_request_time()) {
    table->Row({"max request time", DurationText(limits.max_request_time())});
  }
}

void PrintStatus(const Invocation& run, const v1::GetStatusResponse& status,
                 const std::string& health) {
  const v1::Limits& limits = status.limits();
  Table table;
  table.Row({"server", run.server})
      .Row({"health", run.paint(health == "SERVING" ? Hue::kGood : Hue::kBad, health)})
      .Row({"version", status.version()})
      .Row({"uptime", UptimeText(status.uptime())})
      .Row({"store", status.store_kind() + "  " + status.header().store_id()})
      .Row({"revision", std::to_string(status.header().revision())})
      .Row({"hulls", status.has_hull_count() ? std::to_string(status.hull_count()) : "-"})
      .Row({"vertices", status.has_vertex_count() ? std::to_string(status.vertex_count()) : "-"})
      .Row({"max points per chunk", std::to_string(limits.max_points_per_chunk())})
      .Row({"max vertices per hull", std::to_string(limits.max_vertices_per_hull())})
      .Row({"max hulls", std::to_string(limits.max_hulls())})
      .Row({"max pairs per batch", std::to_string(limits.max_pairs_per_batch())})
      .Row({"max textbook axes", std::to_string(limits.max_textbook_axes())});
  if (run.wide()) {
    const bool known = status.has_body_count();
    table.Row({"bodies", known ? std::to_string(status.body_count()) : "-"});
    AddMoreLimits(limits, &table);
  }
  table.Print(run.out);
}

ExitCode Status(const Invocation& run) {
  const Client client = run.MakeClient();
  const auto status = client.GetStatus();
  if (!status.ok()) return run.Fail(status.status());
  const absl::Status health = client.CheckHealth();
  // A server without the health service is healthy if it answers.
  const bool serving = health.ok() || absl::IsUnimplemented(health);
  const char* const text = health.ok() ? "SERVING" : serving ? "UNKNOWN" : "NOT_SERVING";
  if (!run.PrintForPrograms(*status, text)) {
    PrintStatus(run, *status, text);
  }
  if (serving) return ExitCode::kDone;
  return run.Fail(health);
}

ExitCode Health(const Invocation& run) {
  const absl::Status health = run.MakeClient().CheckHealth();
  if (!health.ok()) return run.Fail(health);
  // The JSON of grpc.health.v1.HealthCheckResponse.
  run.out << (run.json() ? "{\"status\":\"SERVING\"}" : "SERVING") << "\n";
  return ExitCode::kDone;
}

}  // namespace

void AddStatusCommand(Command program, Invocation* invocation) {
  Command command =
      program.AddCommand("status", "Show version, sizes, limits, and health of the server");
  command.SetDetails("Exits with 0 only if the server answers and is serving.");
  command.SetExamples({{"", "hullctl status --server hulls.example:50551 --tls"},
                       {"All limits", "hullctl status --output wide"}});
  command.OnGiven([=] { invocation->action = [=] { return Status(*invocation); }; });
}

void AddHealthCommand(Command program, Invocation* invocation) {
  Command health =
      program.AddCommand("health", "Show whether the server is serving; needs no token");
  health.SetDetails("Exits with 0 only if it is.");
  health.SetExamples({{"Wait for a server in a script", "until hullctl health; do sleep 1; done"}});
  health.OnGiven([=] { invocation->action = [=] { return Health(*invocation); }; });
}

}  // namespace hulld
