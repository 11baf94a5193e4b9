#include "server/call.h"

#include <utility>

#include "server/status_map.h"

namespace hulld::server {

absl::Status Call::Begin() {
  absl::StatusOr<Admission::Ticket> ticket = admission_.Admit();
  if (!ticket.ok()) return ticket.status();
  ticket_ = *std::move(ticket);
  return absl::OkStatus();
}

grpc::Status Call::End(const absl::Status& status) { return ToGrpc(status); }

}  // namespace hulld::server
