#include <absl/strings/str_cat.h>
#include <absl/strings/str_replace.h>
#include <google/protobuf/descriptor.h>

#include "client/hullctl/command_line/commands.h"
#include "client/hullctl/printing/answer_text.h"
#include "client/hullctl/printing/table.h"

namespace hulld {
namespace {

std::string UptimeText(const google::protobuf::Duration& uptime) {
  const int64_t seconds = uptime.seconds();
  if (seconds < 60) return std::to_string(seconds) + " s";
  if (seconds < 3600) return std::to_string(seconds / 60) + " min";
  return std::to_string(seconds / 3600) + " h " + std::to_string(seconds / 60 % 60) + " min";
}

// Number of limits that every table shows; `--output wide` shows all.
constexpr int kMainLimits = 5;

// Adds the limits from `first` on, before `end`, in the order of the contract, by the names of
// their fields.
void AddLimits(const v1::Limits& limits, int first, int end, Table* table) {
  for (int i = first; i < end; ++i) {
    const google::protobuf::FieldDescriptor* const field = v1::Limits::descriptor()->field(i);
    const std::string name = absl::StrReplaceAll(field->name(), {{"_", " "}});
    if (field->message_type() == nullptr) {
      table->Row({name, absl::StrCat(v1::Limits::GetReflection()->GetUInt64(limits, field))});
    } else if (limits.has_max_request_time()) {
      table->Row({name, DurationText(limits.max_request_time())});
    }
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
      .Row({"vertices", status.has_vertex_count() ? std::to_string(status.vertex_count()) : "-"});
  AddLimits(limits, 0, kMainLimits, &table);
  if (run.wide()) {
    const bool known = status.has_body_count();
    table.Row({"bodies", known ? std::to_string(status.body_count()) : "-"});
    AddLimits(limits, kMainLimits, v1::Limits::descriptor()->field_count(), &table);
  }
  table.Print(run.out);
}

ExitCode Status(const Invocation& run) {
  const Client client = run.MakeClient();
  HULLD_ASSIGN_OR_FAIL(run.Fail, const auto status, client.GetStatus());
  const absl::Status health = client.CheckHealth();
  // A server without the health service is healthy if it answers.
  const bool serving = health.ok() || absl::IsUnimplemented(health);
  const char* const text = health.ok() ? "SERVING" : serving ? "UNKNOWN" : "NOT_SERVING";
  if (!run.PrintForPrograms(status, text)) {
    PrintStatus(run, status, text);
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
  OnGiven(command, invocation, Status);
}

void AddHealthCommand(Command program, Invocation* invocation) {
  Command health =
      program.AddCommand("health", "Show whether the server is serving; needs no token");
  health.SetDetails("Exits with 0 only if it is.");
  health.SetExamples({{"Wait for a server in a script", "until hullctl health; do sleep 1; done"}});
  OnGiven(health, invocation, Health);
}

}  // namespace hulld
