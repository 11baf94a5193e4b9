#include "client/formats/dae/dae_mesh.h"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <cstdint>
#include <iterator>
#include <optional>
#include <string_view>
#include <utility>
#include <vector>

#include "client/formats/text_number.h"

namespace hulld {
namespace {

using pugi::xml_node;

// True for the elements of a mesh that contain corners.
bool IsPrimitive(std::string_view name) {
  constexpr std::string_view kNames[] = {"lines",     "linestrips", "polygons", "polylist",
                                         "triangles", "trifans",    "tristrips"};
  return std::find(std::begin(kNames), std::end(kNames), name) != std::end(kNames);
}

class DaeMeshReader {
 public:
  DaeMeshReader(const std::array<LengthScale, 3>& scale, DaeDocument* document)
      : scale_(scale), document_(*document) {}

  TriangleMesh Read(xml_node geometry) {
    const xml_node mesh = DaeDocument::ChildOf(geometry, "mesh");
    if (!mesh) document_.Fail(geometry, "is not a <mesh>; export it as one");
    vertices_ = DaeDocument::ChildOf(mesh, "vertices");
    const xml_node positions =
        vertices_.find_child([](xml_node input) { return SemanticOf(input) == "POSITION"; });
    if (positions) ReadPositions(mesh, positions);
    for (const xml_node child : mesh.children()) {
      if (ok() && IsPrimitive(DaeDocument::NameOf(child))) ReadPrimitives(child);
    }
    return ok() ? std::move(mesh_) : TriangleMesh();
  }

 private:
  bool ok() const { return document_.ok(); }

  // Empty if the element is not an <input>.
  static std::string_view SemanticOf(xml_node input) {
    if (DaeDocument::NameOf(input) != "input") return {};
    return input.attribute("semantic").value();
  }

  void ReadPositions(xml_node mesh, xml_node input) {
    const xml_node source = mesh.find_child([input](xml_node child) {
      return DaeDocument::NameOf(child) == "source" &&
             DaeDocument::RefersTo(input, "source", child);
    });
    const xml_node accessor =
        DaeDocument::ChildOf(DaeDocument::ChildOf(source, "technique_common"), "accessor");
    xml_node numbers = DaeDocument::ChildOf(source, "float_array");
    if (!numbers) numbers = DaeDocument::ChildOf(source, "int_array");
    if (!numbers || !DaeDocument::RefersTo(accessor, "source", numbers)) {
      return document_.Fail(input, "refers to no <source> with an <accessor> and its array");
    }
    const uint64_t count = document_.IntegerOf(accessor, "count", 0);
    const uint64_t offset = document_.IntegerOf(accessor, "offset", 0);
    const uint64_t stride = document_.IntegerOf(accessor, "stride", 1);
    const std::array<size_t, 3> places = PlacesOf(accessor);
    const size_t last = *std::max_element(places.begin(), places.end());
    if (last >= stride) {
      document_.Fail(accessor, absl::StrCat("has stride ", stride, ", too small for x, y, and z"));
    }
    std::vector<std::array<double, 3>>& vertices = mesh_.vertices;
    uint64_t next = 0;
    const size_t size = document_.ForEachWord(numbers, [&](std::string_view word) {
      const uint64_t at = next++;
      if (at < offset || (at - offset) / stride >= count) return;
      const uint64_t place = (at - offset) % stride;
      if (place == 0) vertices.emplace_back();
      for (size_t axis = 0; axis < 3; ++axis) {
        if (places[axis] != place) continue;
        vertices.back()[axis] = document_.NumberOf(
            word, [&](std::string_view text, double* x) { return scale_[axis].Parse(text, x); });
      }
    });
    CheckCount(numbers, size);
    if (count > 0 && size < offset + (count - 1) * stride + last + 1) {
      document_.Fail(
          accessor, absl::StrCat("needs more than the ", Counted(size, "number"), " of its array"));
    }
  }

  // Returns the positions of x, y, and z within an element: those of the parameters with these
  // names, or the first three if no parameter has such a name.
  std::array<size_t, 3> PlacesOf(xml_node accessor) {
    std::array<std::optional<size_t>, 3> named;
    size_t place = 0;
    for (const xml_node param : accessor.children()) {
      if (DaeDocument::NameOf(param) != "param") continue;
      const std::string_view name = param.attribute("name").value();
      for (size_t axis = 0; axis < 3; ++axis) {
        if (name == std::string_view("XYZ").substr(axis, 1)) named[axis] = place;
      }
      ++place;
    }
    const auto is_named = [](const std::optional<size_t>& at) { return at.has_value(); };
    if (std::none_of(named.begin(), named.end(), is_named)) return {0, 1, 2};
    if (!std::all_of(named.begin(), named.end(), is_named)) {
      document_.Fail(accessor, "lacks some of the parameters X, Y, and Z");
      return {};
    }
    return {*named[0], *named[1], *named[2]};
  }

  void ReadPrimitives(xml_node primitives) {
    // A corner is a tuple of indices, one for each offset.
    uint64_t size = 1;
    std::optional<uint64_t> place;
    for (const xml_node input : primitives.children()) {
      const std::string_view semantic = SemanticOf(input);
      if (semantic.empty()) continue;
      const uint64_t offset = document_.IntegerOf(input, "offset", 0);
      size = std::max(size, offset + 1);
      if (semantic == "VERTEX" && DaeDocument::RefersTo(input, "source", vertices_)) place = offset;
    }
    if (!place) {
      return document_.Fail(primitives, "has no input VERTEX from the <vertices> of the mesh");
    }
    uint64_t found = 0;
    for (const xml_node child : primitives.children()) {
      if (!ok()) return;
      const std::string_view name = DaeDocument::NameOf(child);
      if (name == "p") found += AddList(primitives, CornersOf(child, size, *place));
      if (name != "ph") continue;
      // A polygon <p> and its holes <h>.
      for (const xml_node list : child.children()) {
        const std::vector<uint32_t> corners = CornersOf(list, size, *place);
        AddFan(corners, 0, corners.size());
      }
      ++found;
    }
    CheckCount(primitives, found);
  }

  std::vector<uint32_t> CornersOf(xml_node list, uint64_t size, uint64_t place) {
    std::vector<uint32_t> corners;
    const uint64_t limit = mesh_.vertices.size();
    uint64_t next = 0;
    const size_t count = document_.ForEachWord(list, [&](std::string_view word) {
      if (next++ % size != place) return;
      uint64_t index = 0;
      if (!ParseUnsigned(word, &index) || index >= limit) {
        document_.FailAt(word.data(),
                         absl::StrCat(Quoted(word), " is not the index of a vertex; the mesh has ",
                                      Counted(limit, "vertex", "vertices"), ", counted from 0"));
      }
      corners.push_back(static_cast<uint32_t>(index));
    });
    if (count % size != 0) {
      document_.Fail(list, absl::StrCat("has ", count, " indices, not a multiple of ", size));
    }
    return corners;
  }

  // Adds the triangles of one <p>. Returns the number of its primitives.
  uint64_t AddList(xml_node primitives, const std::vector<uint32_t>& corners) {
    const std::string_view kind = DaeDocument::NameOf(primitives);
    if (kind == "polylist") return AddPolylist(primitives, corners);
    if (kind == "triangles" || kind == "lines") {
      const size_t size = kind == "lines" ? 2 : 3;
      for (size_t i = 0; size == 3 && i + 2 < corners.size(); i += 3) AddFan(corners, i, 3);
      if (corners.size() % size != 0) {
        document_.Fail(primitives,
                       absl::StrCat("has ", corners.size(), " corners, not a multiple of ", size));
      }
      return corners.size() / size;
    }
    if (kind == "tristrips") {
      for (size_t i = 2; i < corners.size(); ++i) {
        const size_t odd = i % 2;
        mesh_.triangles.push_back({corners[i - 2 + odd], corners[i - 1 - odd], corners[i]});
      }
    } else if (kind != "linestrips") {
      AddFan(corners, 0, corners.size());
    }
    return 1;
  }

  uint64_t AddPolylist(xml_node primitives, const std::vector<uint32_t>& corners) {
    size_t first = 0;
    const auto add = [&](std::string_view word) {
      uint64_t size = 0;
      if (!ParseUnsigned(word, &size) || size > corners.size() - first) {
        return document_.FailAt(word.data(),
                                absl::StrCat(Quoted(word), " is not a number of corners; <p> has ",
                                             corners.size() - first, " more"));
      }
      AddFan(corners, first, size);
      first += size;
    };
    const size_t found = document_.ForEachWord(DaeDocument::ChildOf(primitives, "vcount"), add);
    if (first != corners.size()) {
      document_.Fail(primitives, absl::StrCat("has ", corners.size(), " corners in <p>, but ",
                                              first, " in <vcount>"));
    }
    return found;
  }

  void AddFan(const std::vector<uint32_t>& corners, size_t first, size_t size) {
    for (size_t i = first + 2; i < first + size; ++i) {
      mesh_.triangles.push_back({corners[first], corners[i - 1], corners[i]});
    }
  }

  void CheckCount(xml_node node, uint64_t found) {
    const uint64_t declared = document_.IntegerOf(node, "count", found);
    if (declared == found) return;
    document_.Fail(
        node, absl::StrCat("declares ", declared, ", but has ", found, "; is the file complete?"));
  }

  const std::array<LengthScale, 3>& scale_;
  DaeDocument& document_;
  xml_node vertices_;
  TriangleMesh mesh_;
};

}  // namespace

TriangleMesh ReadDaeMesh(pugi::xml_node geometry, const std::array<LengthScale, 3>& scale,
                         DaeDocument* document) {
  return DaeMeshReader(scale, document).Read(geometry);
}

}  // namespace hulld
