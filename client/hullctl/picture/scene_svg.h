#ifndef HULLD_CLIENT_HULLCTL_PICTURE_SCENE_SVG_H_
#define HULLD_CLIENT_HULLCTL_PICTURE_SCENE_SVG_H_

#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace hulld {

// One of the pictures that stand side by side.
struct ScenePanel {
  enum class Kind {
    // Dots at the vertices.
    kPoints,
    // Opaque polygons, seen from both sides.
    kMesh,
    // Glassy convex polygons with their edges, and dots at the vertices.
    kHull,
  };
  Kind kind;
  std::string title;
  // Lines of text under the picture.
  std::vector<std::string> captions;
  std::vector<std::array<double, 3>> vertices;
  // Corners per polygon, and the vertex indices of all polygons one after another, all in range.
  std::vector<uint32_t> polygon_sizes;
  std::vector<uint32_t> polygon_indices;
};

// The direction that points up in the picture.
enum class UpAxis { kX, kY, kZ };

// An SVG image: the panels from left to right in one orthographic view and one scale, nearer things
// drawn over farther ones. Requires finite vertices, of any
// magnitude; unchecked, as the readers of files and the server refuse others. Coordinates are
// rounded to 2 decimals of a pixel; more than some thousand vertices or polygons of a panel are
// thinned out, so that the image stays near 1 MB at most.
std::string RenderSceneSvg(const std::vector<ScenePanel>& panels, UpAxis up);

// "1234567" as "1,234,567".
std::string GroupedDigits(uint64_t number);

}  // namespace hulld

#endif  // HULLD_CLIENT_HULLCTL_PICTURE_SCENE_SVG_H_
