#ifndef HULLD_CLIENT_HULLCTL_PICTURE_SCENE_SVG_H_
#define HULLD_CLIENT_HULLCTL_PICTURE_SCENE_SVG_H_

#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace hulld {

// One of several pictures side by side.
struct ScenePanel {
  enum class Kind {
    // Dots at the vertices.
    kPoints,
    // Opaque polygons, visible from both sides.
    kMesh,
    // Translucent convex polygons with their edges, and dots at the vertices.
    kHull,
  };
  Kind kind;
  std::string title;
  // Lines of text under the picture.
  std::vector<std::string> captions;
  std::vector<std::array<double, 3>> vertices;
  // Corners per polygon, and the concatenated vertex indices of all polygons, all in range.
  std::vector<uint32_t> polygon_sizes;
  std::vector<uint32_t> polygon_indices;
};

// The direction that points up in the picture.
enum class UpAxis { kX, kY, kZ };

// Returns an SVG image: the panels from left to right in one orthographic view at one scale, nearer
// objects over farther ones. Requires finite vertices of any magnitude; unchecked, as the file
// readers and the server reject other values. Coordinates are rounded to 2 decimals of a pixel.
// Panels of more than some thousand vertices or polygons are thinned out to keep the image near 1
// MB at most.
std::string RenderSceneSvg(const std::vector<ScenePanel>& panels, UpAxis up);

// Returns "1234567" as "1,234,567".
std::string GroupedDigits(uint64_t number);

}  // namespace hulld

#endif  // HULLD_CLIENT_HULLCTL_PICTURE_SCENE_SVG_H_
