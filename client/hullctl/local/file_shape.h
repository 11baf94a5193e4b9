#ifndef HULLD_CLIENT_HULLCTL_LOCAL_FILE_SHAPE_H_
#define HULLD_CLIENT_HULLCTL_LOCAL_FILE_SHAPE_H_

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <string>
#include <vector>

#include "client/client.h"
#include "client/hullctl/command_line/invocation.h"
#include "hulld/v1/collision.pb.h"

namespace hulld {

// Returns true if an argument is a file rather than the ID of a hull or body: an existing file with
// the extension of a format of points, or a path that no ID can be ("./part", "/tmp/part.stl").
bool IsShapeFile(const std::string& argument);

// Sets the shape of the placement to the hull of all points of a file. Up to kMaxShapePoints
// distinct points are sent unchanged. For a file with more, a private server builds the hull, and
// its vertices are sent; with --local, the hull is registered on that server instead.
// INVALID_ARGUMENT: the file cannot be read; its hull has more than kMaxShapePoints vertices.
// Errors of the local server.
absl::Status SetShape(const Invocation& run, const std::string& path, v1::Placement* placement);

// Returns the hull of all finite points of a file, built by a private server. Errors as above,
// regardless of the number of vertices.
absl::StatusOr<HullMesh> HullOfFile(const std::string& path);

// Returns the hull of each shape, built by a private server. Errors of that server.
absl::StatusOr<std::vector<HullMesh>> HullsOfShapes(const std::vector<v1::PointBlock>& shapes);

// Limit of the server (Placement.points).
inline constexpr size_t kMaxShapePoints = 4096;

}  // namespace hulld

#endif  // HULLD_CLIENT_HULLCTL_LOCAL_FILE_SHAPE_H_
