#ifndef HULLD_TESTS_CLIENT_FORMATS_DAE_DAE_TEXT_H_
#define HULLD_TESTS_CLIENT_FORMATS_DAE_DAE_TEXT_H_

#include <gtest/gtest.h>

#include <string>
#include <string_view>

#include "client/formats/mesh_file.h"
#include "tests/client/formats/point_reading.h"

namespace hulld {

// A triangle with corners (0, 0, 0), (200, 0, 0), and (0, 0, 50) centimeters, Z up.
inline constexpr char kPlate[] = R"(<?xml version="1.0" encoding="utf-8"?>
<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
<asset><unit name="centimeter" meter="0.01"/><up_axis>Z_UP</up_axis></asset>
<library_geometries><geometry id="plate-mesh" name="plate"><mesh>
<source id="at"><float_array id="numbers" count="9">0 0 0 200 0 0 0 0 50</float_array>
<technique_common><accessor source="#numbers" count="3" stride="3">
<param name="X" type="float"/><param name="Y" type="float"/><param name="Z" type="float"/>
</accessor></technique_common></source>
<vertices id="corners"><input semantic="POSITION" source="#at"/></vertices>
<triangles count="1"><input semantic="VERTEX" source="#corners" offset="0"/>
<p>0 1 2</p></triangles>
</mesh></geometry></library_geometries>
<library_nodes/>
<library_visual_scenes><visual_scene id="scene">
<node id="plate"><instance_geometry url="#plate-mesh"/></node>
</visual_scene></library_visual_scenes>
<scene><instance_visual_scene url="#scene"/></scene>
</COLLADA>
)";

inline std::string DaeReplaced(std::string text, std::string_view from, std::string_view to) {
  const size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return at == std::string::npos ? text : text.replace(at, from.size(), to);
}

// The plate in meters, with the first `from` replaced.
inline std::string DaeText(std::string_view from = "", std::string_view to = "") {
  return DaeReplaced(DaeReplaced(kPlate, "0.01", "1"), from, to);
}

inline PointsRead ReadDaeText(const std::string& text, const ReadOptions& options = {}) {
  return ReadText(text, PointFormat::kDae, options);
}

inline std::vector<MeshPart> DaeParts(const std::string& text) {
  const TempFile file("a.dae", text);
  const auto parts = ReadParts(file.path(), SplitBy::kName);
  EXPECT_TRUE(parts.ok()) << parts.status();
  return parts.ok() ? *parts : std::vector<MeshPart>();
}

}  // namespace hulld

#endif  // HULLD_TESTS_CLIENT_FORMATS_DAE_DAE_TEXT_H_
