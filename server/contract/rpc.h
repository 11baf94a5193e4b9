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

// Returns the name in the contract: "CheckCollision".
const char* RpcName(Rpc rpc);

}  // namespace hulld::server

#endif  // HULLD_SERVER_CONTRACT_RPC_H_
