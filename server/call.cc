#include "server/call.h"

#include <utility>

#include "server/authenticator.h"
#include "server/status_map.h"

namespace hulld::server {

absl::Status Call::Begin() {
  if (absl::Status s = Authenticate(); !s.ok()) return s;
  absl::StatusOr<Admission::Ticket> ticket = admission_.Admit();
  if (!ticket.ok()) return ticket.status();
  ticket_ = *std::move(ticket);
  return absl::OkStatus();
}

absl::Status Call::Authenticate() {
  if (admission_.authenticator() == nullptr) return absl::OkStatus();
  absl::StatusOr<Caller> caller =
      admission_.authenticator()->Authenticate(context_.client_metadata(), rpc_);
  if (!caller.ok()) return caller.status();
  caller_ = *std::move(caller);
  return absl::OkStatus();
}

grpc::Status Call::End(const absl::Status& status) { return ToGrpc(status); }

}  // namespace hulld::server
