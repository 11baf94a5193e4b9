#include "server/contract/rpc.h"

#include <cstddef>

namespace hulld::server {
namespace {

struct Properties {
  Rpc rpc;
  const char* name;
  CallKind kind;
  Permission permission;
};

// In the order of the enum.
constexpr Properties kRpcs[] = {
    {Rpc::kCreateHull, "CreateHull", CallKind::kUnary, Permission::kWrite},
    {Rpc::kAppendPoints, "AppendPoints", CallKind::kStream, Permission::kWrite},
    {Rpc::kGetHull, "GetHull", CallKind::kUnary, Permission::kRead},
    {Rpc::kGetHullMesh, "GetHullMesh", CallKind::kDownload, Permission::kRead},
    {Rpc::kListHulls, "ListHulls", CallKind::kUnary, Permission::kRead},
    {Rpc::kDeleteHull, "DeleteHull", CallKind::kUnary, Permission::kWrite},
    {Rpc::kCheckCollision, "CheckCollision", CallKind::kUnary, Permission::kRead},
    {Rpc::kBatchCheckCollisions, "BatchCheckCollisions", CallKind::kBatch, Permission::kRead},
    {Rpc::kStreamCollisions, "StreamCollisions", CallKind::kStream, Permission::kRead},
    {Rpc::kFindCollisions, "FindCollisions", CallKind::kBatch, Permission::kRead},
    {Rpc::kGetStatus, "GetStatus", CallKind::kUnary, Permission::kRead},
    {Rpc::kReplaceHull, "ReplaceHull", CallKind::kStream, Permission::kWrite},
    {Rpc::kSaveBackup, "SaveBackup", CallKind::kStream, Permission::kAdmin},
    {Rpc::kWatchHulls, "WatchHulls", CallKind::kStream, Permission::kRead},
    {Rpc::kWatchCollisions, "WatchCollisions", CallKind::kStream, Permission::kRead},
    {Rpc::kPutBody, "PutBody", CallKind::kUnary, Permission::kWrite},
    {Rpc::kGetBody, "GetBody", CallKind::kUnary, Permission::kRead},
    {Rpc::kListBodies, "ListBodies", CallKind::kUnary, Permission::kRead},
    {Rpc::kDeleteBody, "DeleteBody", CallKind::kUnary, Permission::kWrite},
    {Rpc::kHealthWatch, "HealthWatch", CallKind::kStream, Permission::kNone},
    {Rpc::kServerReflectionInfo, "ServerReflectionInfo", CallKind::kStream, Permission::kNone},
};

constexpr bool ListsEachInOrder() {
  size_t next = 0;
  for (const Properties& each : kRpcs) {
    if (static_cast<size_t>(each.rpc) != next++) return false;
  }
  return next == kRpcCount;
}
static_assert(ListsEachInOrder());

const Properties& PropertiesOf(Rpc rpc) { return kRpcs[static_cast<size_t>(rpc)]; }

}  // namespace

const char* RpcName(Rpc rpc) { return PropertiesOf(rpc).name; }

CallKind KindOf(Rpc rpc) { return PropertiesOf(rpc).kind; }

Permission PermissionFor(Rpc rpc) { return PropertiesOf(rpc).permission; }

}  // namespace hulld::server
