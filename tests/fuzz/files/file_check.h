#ifndef HULLD_TESTS_FUZZ_FILES_FILE_CHECK_H_
#define HULLD_TESTS_FUZZ_FILES_FILE_CHECK_H_

#include <cstddef>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

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

// A small file of each kind, with variants if the kind has several.
struct SeedFile {
  FileKind kind;
  std::string content;
};
std::vector<SeedFile> SeedFiles();

// Mutates `content` once: swaps, repeats, or drops a line, number, binary word, or tag, replaces a
// number or word by an extreme value, or truncates the file. next(n) chooses a number below n.
void ChangeStructure(const std::function<size_t(size_t)>& next, std::string* content);

// Words and numbers of these formats, valid and invalid.
const std::vector<std::string>& FileTokens();

}  // namespace hulld::fuzz

#endif  // HULLD_TESTS_FUZZ_FILES_FILE_CHECK_H_
