#ifndef HULLD_SERVER_CONTRACT_RPC_H_
#define HULLD_SERVER_CONTRACT_RPC_H_

#include <cstddef>

namespace hulld::server {

// RPCs of the server.
enum class Rpc {
  kCreateHull,
  kAppendPoints,
  kGetHull,
  kGetHullMesh,
  kListHulls,
  kDeleteHull,
  kCheckCollision,
  kBatchCheckCollisions,
  kStreamCollisions,
  kFindCollisions,
  kGetStatus,
  kReplaceHull,
  kSaveBackup,
  kWatchHulls,
  kWatchCollisions,
  kPutBody,
  kGetBody,
  kListBodies,
  kDeleteBody,
  // gRPC's own protocols: Watch of grpc.health.v1, and reflection.
  kHealthWatch,
  kServerReflectionInfo,
};

inline constexpr size_t kRpcCount = static_cast<size_t>(Rpc::kServerReflectionInfo) + 1;

// Load of a call on the server; determines the limits that apply to it.
enum class CallKind {
  // One request, one short answer.
  kUnary,
  // Thousands of pairs, computed in slices: --max-concurrent-batches.
  kBatch,
  // One request, an answer of many messages.
  kDownload,
  // Lasts as long as the client or the size of the store requires: --max-streams-per-client.
  kStream,
};

// Permissions of a caller. Each includes the previous ones.
enum class Permission {
  // Open to everyone, without a token.
  kNone,
  // Reads only.
  kRead,
  // Changes hulls and bodies.
  kWrite,
  // Administers the whole store.
  kAdmin,
};

// Returns the name in the contract: "CheckCollision".
const char* RpcName(Rpc rpc);
CallKind KindOf(Rpc rpc);
// Returns the permission that a call needs.
Permission PermissionFor(Rpc rpc);

}  // namespace hulld::server

#endif  // HULLD_SERVER_CONTRACT_RPC_H_
