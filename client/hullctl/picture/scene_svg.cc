#include "client/hullctl/picture/scene_svg.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>
#include <utility>

#include "client/hullctl/picture/mesh_thinning.h"
#include "client/pose/vector3.h"

namespace hulld {
namespace {

// Lengths in pixels.
constexpr double kPanelWidth = 400;
constexpr double kMinPictureHeight = 220;
constexpr double kMaxPictureHeight = 380;
constexpr double kMargin = 16;
constexpr double kTitleHeight = 44;
constexpr double kCaptionHeight = 20;
constexpr double kPadding = 26;

constexpr size_t kMaxDots = 6000;
constexpr size_t kMaxTriangles = 7000;
constexpr int kShades = 24;

using Point = std::array<double, 3>;

Point Normalized(const Point& a) {
  const double length = std::sqrt(Dot(a, a));
  if (!(length > 0)) return {0, 0, 0};
  return {a[0] / length, a[1] / length, a[2] / length};
}

// Maps coordinates of any magnitude to a box within [-1, 1]^3 centered on 0.
class Normalization {
 public:
  explicit Normalization(const std::vector<ScenePanel>& panels) {
    constexpr double kInfinity = std::numeric_limits<double>::infinity();
    Point low = {kInfinity, kInfinity, kInfinity};
    Point high = {-kInfinity, -kInfinity, -kInfinity};
    for (const ScenePanel& panel : panels) {
      for (const Point& p : panel.vertices) {
        for (size_t axis = 0; axis < 3; ++axis) {
          low[axis] = std::min(low[axis], p[axis]);
          high[axis] = std::max(high[axis], p[axis]);
        }
      }
    }
    if (!(low[0] <= high[0])) return;
    double largest = 0;
    for (size_t axis = 0; axis < 3; ++axis) {
      largest = std::max({largest, std::abs(low[axis]), std::abs(high[axis])});
    }
    // Scales everything into [-1, 1] by a power of two first, so that later steps cannot overflow
    // or underflow.
    std::frexp(largest, &exponent_);
    double half_extent = 0;
    for (size_t axis = 0; axis < 3; ++axis) {
      const double from = std::ldexp(low[axis], -exponent_);
      const double to = std::ldexp(high[axis], -exponent_);
      center_[axis] = (from + to) / 2;
      half_extent = std::max(half_extent, (to - from) / 2);
    }
    if (half_extent > 0) half_extent_ = half_extent;
  }

  Point Apply(const Point& p) const {
    Point q;
    for (size_t axis = 0; axis < 3; ++axis) {
      q[axis] = (std::ldexp(p[axis], -exponent_) - center_[axis]) / half_extent_;
    }
    return q;
  }

 private:
  int exponent_ = 0;
  Point center_ = {0, 0, 0};
  double half_extent_ = 1;
};

// Orthographic camera: right and up span the picture, `toward` points to the viewer.
struct Camera {
  Point right;
  Point up;
  Point toward;
};

Camera MakeCamera(UpAxis up_axis) {
  constexpr double kAzimuth = 0.62;
  constexpr double kElevation = 0.42;
  const double ca = std::cos(kAzimuth), sa = std::sin(kAzimuth);
  const double ce = std::cos(kElevation), se = std::sin(kElevation);
  // For y up; the other axes follow by cyclic permutation.
  Camera camera{{ca, 0, -sa}, {-se * sa, ce, -se * ca}, {ce * sa, se, ce * ca}};
  const int shift = up_axis == UpAxis::kY ? 0 : up_axis == UpAxis::kZ ? 1 : 2;
  for (Point* axis : {&camera.right, &camera.up, &camera.toward}) {
    std::rotate(axis->begin(), axis->begin() + (3 - shift) % 3, axis->end());
  }
  return camera;
}

struct Rgb {
  int r, g, b;
};

Rgb Mix(const Rgb& dark, const Rgb& light, double share) {
  const auto mix = [share](int a, int b) {
    return static_cast<int>(std::lround(a + share * (b - a)));
  };
  return {mix(dark.r, light.r), mix(dark.g, light.g), mix(dark.b, light.b)};
}

std::string Hex(const Rgb& color) {
  static constexpr char kDigits[] = "0123456789abcdef";
  std::string text = "#";
  for (const int part : {color.r, color.g, color.b}) {
    text += kDigits[part >> 4];
    text += kDigits[part & 15];
  }
  return text;
}

// Returns at most 2 decimals, without trailing zeros.
std::string Pixels(double value) {
  char buffer[32];
  const double rounded = std::round(value * 100) / 100;
  // Adding 0 turns -0 into 0.
  const auto end = std::to_chars(buffer, buffer + sizeof(buffer), rounded + 0.0).ptr;
  return std::string(buffer, end);
}

std::string EscapeXml(const std::string& text) {
  std::string escaped;
  for (const char c : text) {
    if (c == '&') {
      escaped += "&amp;";
    } else if (c == '<') {
      escaped += "&lt;";
    } else if (c == '>') {
      escaped += "&gt;";
    } else {
      // File names may contain bytes that are not UTF-8.
      escaped += c >= ' ' && c <= '~' ? c : '?';
    }
  }
  return escaped;
}

// A polygon ready for drawing.
struct Face {
  double depth;
  int shade;
  bool front;
  std::string path;
};

class SceneWriter {
 public:
  SceneWriter(const std::vector<ScenePanel>& panels, UpAxis up)
      : panels_(panels), normalization_(panels), camera_(MakeCamera(up)) {
    FitScale();
  }

  std::string Write() {
    size_t captions = 0;
    for (const ScenePanel& panel : panels_) captions = std::max(captions, panel.captions.size());
    const double width = kMargin + static_cast<double>(panels_.size()) * (kPanelWidth + kMargin);
    const double panel_height =
        kTitleHeight + picture_height_ + static_cast<double>(captions) * kCaptionHeight + 16;
    const double height = panel_height + 2 * kMargin;
    svg_ =
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<svg xmlns=\"http://www.w3.org/2000/svg\" "
        "width=\"" +
        Pixels(width) + "\" height=\"" + Pixels(height) + "\" viewBox=\"0 0 " + Pixels(width) +
        " " + Pixels(height) + "\">\n";
    WriteStyles();
    svg_ += "<rect width=\"100%\" height=\"100%\" fill=\"#f4f5f7\"/>\n";
    for (size_t i = 0; i < panels_.size(); ++i) {
      const double left = kMargin + static_cast<double>(i) * (kPanelWidth + kMargin);
      svg_ += "<g transform=\"translate(" + Pixels(left) + " " + Pixels(kMargin) + ")\">\n";
      WritePanel(panels_[i], panel_height);
      svg_ += "</g>\n";
    }
    return svg_ + "</svg>\n";
  }

 private:
  void FitScale() {
    double left = 0, right = 0, bottom = 0, top = 0;
    bool first = true;
    for (const ScenePanel& panel : panels_) {
      for (const Point& p : panel.vertices) {
        const Point q = normalization_.Apply(p);
        const double x = Dot(q, camera_.right);
        const double y = Dot(q, camera_.up);
        left = first ? x : std::min(left, x);
        right = first ? x : std::max(right, x);
        bottom = first ? y : std::min(bottom, y);
        top = first ? y : std::max(top, y);
        first = false;
      }
    }
    center_x_ = (left + right) / 2;
    center_y_ = (bottom + top) / 2;
    const double half_width = (right - left) / 2;
    const double half_height = (top - bottom) / 2;
    scale_ = std::min((kPanelWidth / 2 - kPadding) / std::max(half_width, 1e-6),
                      (kMaxPictureHeight / 2 - kPadding) / std::max(half_height, 1e-6));
    // A single point needs no magnification.
    scale_ = std::min(scale_, kPanelWidth * 4);
    picture_height_ =
        std::clamp(2 * (half_height * scale_ + kPadding), kMinPictureHeight, kMaxPictureHeight);
  }

  std::string Place(const Point& q) const {
    const double x = (Dot(q, camera_.right) - center_x_) * scale_ + kPanelWidth / 2;
    const double y = (center_y_ - Dot(q, camera_.up)) * scale_ + kTitleHeight + picture_height_ / 2;
    return Pixels(x) + " " + Pixels(y);
  }

  void WriteStyles() {
    svg_ +=
        "<style>text{font-family:system-ui,'Segoe UI','Helvetica Neue',Arial,sans-serif;"
        "text-anchor:middle}.t{font-size:19px;font-weight:600;fill:#1c2530}"
        ".c{font-size:13.5px;fill:#57606a}.d{fill:none;stroke-linecap:round}";
    for (int i = 0; i < kShades; ++i) {
      const double share = static_cast<double>(i) / (kShades - 1);
      const std::string mesh = Hex(Mix({44, 74, 92}, {203, 224, 232}, share));
      const std::string hull = Hex(Mix({150, 74, 20}, {255, 214, 150}, share));
      const std::string number = std::to_string(i);
      svg_.append(".m").append(number).append("{fill:").append(mesh);
      svg_.append(";stroke:").append(mesh).append("}");
      svg_.append(".h").append(number).append("{fill:").append(hull).append("}");
    }
    svg_ += "</style>\n";
  }

  void WritePanel(const ScenePanel& panel, double height) {
    svg_ += "<rect width=\"" + Pixels(kPanelWidth) + "\" height=\"" + Pixels(height) +
            "\" rx=\"10\" fill=\"#ffffff\" stroke=\"#d8dde3\"/>\n";
    WriteText("t", 31, panel.title);
    std::vector<Point> vertices;
    vertices.reserve(panel.vertices.size());
    for (const Point& p : panel.vertices) vertices.push_back(normalization_.Apply(p));
    if (panel.kind == ScenePanel::Kind::kPoints) {
      WriteDots(vertices, {120, 150, 190}, {24, 62, 120}, 2.2);
    } else {
      WriteFaces(panel, vertices);
    }
    double y = kTitleHeight + picture_height_ + kCaptionHeight;
    for (const std::string& caption : panel.captions) {
      WriteText("c", y, caption);
      y += kCaptionHeight;
    }
  }

  void WriteText(const char* style, double y, const std::string& text) {
    svg_.append("<text class=\"").append(style).append("\" x=\"").append(Pixels(kPanelWidth / 2));
    svg_.append("\" y=\"")
        .append(Pixels(y))
        .append("\">")
        .append(EscapeXml(text))
        .append("</text>\n");
  }

  // Writes dots in bands of depth; farther ones are paler and drawn first.
  void WriteDots(const std::vector<Point>& vertices, const Rgb& far, const Rgb& near, double size) {
    constexpr int kBands = 12;
    // The half diagonal of the box [-1, 1]^3 bounds the depth.
    constexpr double kReach = 1.7321;
    std::vector<std::string> bands(kBands);
    const size_t step = vertices.size() / kMaxDots + 1;
    for (size_t i = 0; i < vertices.size(); i += step) {
      const double share = (Dot(vertices[i], camera_.toward) / kReach + 1) / 2;
      const int band = std::clamp(static_cast<int>(share * kBands), 0, kBands - 1);
      bands[static_cast<size_t>(band)].append("M").append(Place(vertices[i])).append("h0");
    }
    for (int band = 0; band < kBands; ++band) {
      const std::string& path = bands[static_cast<size_t>(band)];
      if (path.empty()) continue;
      const double share = static_cast<double>(band) / (kBands - 1);
      svg_ += "<path class=\"d\" stroke=\"" + Hex(Mix(far, near, share)) + "\" stroke-width=\"" +
              Pixels(size * (0.75 + 0.5 * share)) + "\" d=\"" + path + "\"/>\n";
    }
  }

  void WriteFaces(const ScenePanel& panel, std::vector<Point> vertices) {
    const bool hull = panel.kind == ScenePanel::Kind::kHull;
    std::vector<uint32_t> sizes = panel.polygon_sizes;
    std::vector<uint32_t> indices = panel.polygon_indices;
    const std::vector<Point> all = vertices;
    if (sizes.size() > kMaxTriangles || indices.size() > 3 * kMaxTriangles) {
      Coarsen(&vertices, &sizes, &indices);
    }
    std::vector<Face> faces;
    size_t next = 0;
    for (const uint32_t size : sizes) {
      if (size >= 3) faces.push_back(MakeFace(vertices, &indices[next], size, hull));
      next += size;
    }
    std::stable_sort(faces.begin(), faces.end(),
                     [](const Face& a, const Face& b) { return a.depth < b.depth; });
    if (hull) {
      WriteHull(faces, all);
    } else {
      svg_ += "<g stroke-width=\"0.5\" stroke-linejoin=\"round\">\n";
      WriteShaded(faces, "m");
      svg_ += "</g>\n";
    }
  }

  static void Coarsen(std::vector<Point>* vertices, std::vector<uint32_t>* sizes,
                      std::vector<uint32_t>* indices) {
    std::vector<DrawnTriangle> triangles;
    size_t next = 0;
    for (const uint32_t size : *sizes) {
      for (uint32_t i = 2; i < size; ++i) {
        triangles.push_back({(*indices)[next], (*indices)[next + i - 1], (*indices)[next + i]});
      }
      next += size;
    }
    ThinOut(kMaxTriangles, vertices, &triangles);
    sizes->assign(triangles.size(), 3);
    indices->clear();
    for (const DrawnTriangle& triangle : triangles) {
      indices->insert(indices->end(), triangle.begin(), triangle.end());
    }
  }

  Face MakeFace(const std::vector<Point>& vertices, const uint32_t* corners, uint32_t size,
                bool hull) const {
    Face face;
    const Point& first = vertices[corners[0]];
    Point doubled_area = {0, 0, 0};
    double depth = 0;
    for (uint32_t i = 0; i < size; ++i) {
      const Point& p = vertices[corners[i]];
      const Point& q = vertices[corners[(i + 1) % size]];
      const Point part = Cross(Minus(p, first), Minus(q, first));
      for (size_t axis = 0; axis < 3; ++axis) doubled_area[axis] += part[axis];
      depth += Dot(p, camera_.toward);
      face.path.append(i == 0 ? "M" : i == 1 ? "L" : " ").append(Place(p));
    }
    face.path.append("Z");
    face.depth = depth / size;
    Point normal = Normalized(doubled_area);
    face.front = Dot(normal, camera_.toward) >= 0;
    if (!face.front && !hull) normal = {-normal[0], -normal[1], -normal[2]};
    face.shade = Shade(normal);
    return face;
  }

  // Light from the upper left front, plus ambient light.
  int Shade(const Point& normal) const {
    Point light;
    for (size_t axis = 0; axis < 3; ++axis) {
      light[axis] =
          -0.45 * camera_.right[axis] + 0.65 * camera_.up[axis] + 0.61 * camera_.toward[axis];
    }
    const double lit = std::max(0.0, Dot(normal, Normalized(light)));
    return static_cast<int>(std::lround((0.12 + 0.88 * lit) * (kShades - 1)));
  }

  // Consecutive faces of equal shade share a path.
  void WriteShaded(const std::vector<Face>& faces, const char* style) {
    for (size_t i = 0; i < faces.size();) {
      svg_.append("<path class=\"").append(style).append(std::to_string(faces[i].shade));
      svg_.append("\" d=\"").append(faces[i].path);
      size_t last = i + 1;
      while (last < faces.size() && faces[last].shade == faces[i].shade) {
        svg_.append(faces[last++].path);
      }
      svg_.append("\"/>\n");
      i = last;
    }
  }

  void WriteHull(const std::vector<Face>& faces, const std::vector<Point>& vertices) {
    std::vector<Face> back;
    std::vector<Face> front;
    for (const Face& face : faces) (face.front ? front : back).push_back(face);
    const std::string line = Pixels(faces.size() > 2000 ? 0.25 : faces.size() > 400 ? 0.5 : 0.9);
    svg_ +=
        "<g stroke=\"#c98a4b\" stroke-linejoin=\"round\" stroke-opacity=\"0.45\" "
        "fill-opacity=\"0.35\" stroke-width=\"" +
        line + "\">\n";
    WriteShaded(back, "h");
    svg_ +=
        "</g>\n<g stroke=\"#7a3d0c\" stroke-linejoin=\"round\" stroke-opacity=\"0.7\" "
        "fill-opacity=\"0.78\" "
        "stroke-width=\"" +
        line + "\">\n";
    WriteShaded(front, "h");
    svg_ += "</g>\n";
    if (faces.empty() && vertices.size() == 2) {
      svg_ += "<path fill=\"none\" stroke=\"#7a3d0c\" stroke-width=\"1.5\" d=\"M" +
              Place(vertices[0]) + "L" + Place(vertices[1]) + "\"/>\n";
    }
    if (vertices.size() <= 500) WriteDots(vertices, {214, 160, 110}, {110, 48, 4}, 3);
  }

  const std::vector<ScenePanel>& panels_;
  Normalization normalization_;
  Camera camera_;
  double center_x_ = 0;
  double center_y_ = 0;
  double scale_ = 1;
  double picture_height_ = kMaxPictureHeight;
  std::string svg_;
};

}  // namespace

std::string RenderSceneSvg(const std::vector<ScenePanel>& panels, UpAxis up) {
  return SceneWriter(panels, up).Write();
}

std::string GroupedDigits(uint64_t number) {
  std::string text = std::to_string(number);
  for (size_t i = text.size(); i > 3; i -= 3) text.insert(i - 3, 1, ',');
  return text;
}

}  // namespace hulld
