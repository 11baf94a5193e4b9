#ifndef HULLD_TESTS_FUZZ_FILES_FILE_CHECK_H_
#define HULLD_TESTS_FUZZ_FILES_FILE_CHECK_H_

#include <cstddef>
#include <string>
#include <string_view>

namespace hulld::fuzz {

// Formats that hullctl reads with this project's code: points, meshes, batches, scenes, robots, and
// messages as JSON.
enum class FileKind {
  kObj,
  kOff,
  kPly,
  kXyz,
  kCsv,
  kPcd,
  kLas,
  kStl,
  kGltf,
  kDae,
  kObjMesh,
  kOffMesh,
  kPlyMesh,
  kStlMesh,
  kGltfMesh,
  kDaeMesh,
  kBatch,
  kSceneJson,
  kAnswerJson,
  kStreamJson,
  kYamlScene,
  kUrdf,
  kSrdf,
  kJoints,
};
inline constexpr size_t kFileKinds = static_cast<size_t>(FileKind::kJoints) + 1;

struct FileVerdict {
  // Empty if no fault was found.
  std::string finding;
  // True if the file was read to its end.
  bool read = false;
};

// Reads `content` as a file of that kind. The reader must accept it, or refuse it with an
// INVALID_ARGUMENT that names the file and the fault. Accepted data is finite, with indices in
// range and counts equal to the number of items delivered. It does not depend on the block size or,
// if all points are finite, on skipping non-finite ones. Accepted JSON round-trips.
FileVerdict CheckFile(FileKind kind, std::string_view content);

}  // namespace hulld::fuzz

#endif  // HULLD_TESTS_FUZZ_FILES_FILE_CHECK_H_
