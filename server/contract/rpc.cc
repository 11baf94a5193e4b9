#include "server/contract/rpc.h"

#include "core/base/check.h"

namespace hulld::server {

const char* RpcName(Rpc rpc) {
  switch (rpc) {
    case Rpc::kCreateHull:
      return "CreateHull";
    case Rpc::kAppendPoints:
      return "AppendPoints";
    case Rpc::kGetHull:
      return "GetHull";
    case Rpc::kGetHullMesh:
      return "GetHullMesh";
    case Rpc::kListHulls:
      return "ListHulls";
    case Rpc::kDeleteHull:
      return "DeleteHull";
    case Rpc::kCheckCollision:
      return "CheckCollision";
    case Rpc::kBatchCheckCollisions:
      return "BatchCheckCollisions";
    case Rpc::kStreamCollisions:
      return "StreamCollisions";
    case Rpc::kFindCollisions:
      return "FindCollisions";
    case Rpc::kGetStatus:
      return "GetStatus";
    case Rpc::kReplaceHull:
      return "ReplaceHull";
    case Rpc::kSaveBackup:
      return "SaveBackup";
    case Rpc::kWatchHulls:
      return "WatchHulls";
    case Rpc::kWatchCollisions:
      return "WatchCollisions";
    case Rpc::kPutBody:
      return "PutBody";
    case Rpc::kGetBody:
      return "GetBody";
    case Rpc::kListBodies:
      return "ListBodies";
    case Rpc::kDeleteBody:
      return "DeleteBody";
    case Rpc::kHealthWatch:
      return "HealthWatch";
    case Rpc::kServerReflectionInfo:
      return "ServerReflectionInfo";
  }
  HULLD_UNREACHABLE();
}

}  // namespace hulld::server
