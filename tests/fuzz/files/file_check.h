#ifndef HULLD_TESTS_FUZZ_FILES_FILE_CHECK_H_
#define HULLD_TESTS_FUZZ_FILES_FILE_CHECK_H_

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace hulld::fuzz {

// What hullctl reads by code of this project: points, meshes, batches,
// scenes, robots, and messages as JSON.
enum class FileKind {
  kObj,
  kOff,
  kPly,
  kXyz,
  kCsv,
  kPcd,
  kObjMesh,
  kOffMesh,
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
  // Empty when all is well.
  std::string finding;
  // Whether the file was read to its end.
  bool read = false;
};

// Reads `content` as a file of that kind. It is read, or refused with INVALID_ARGUMENT that names
// the file and says what is wrong. What is read is finite, indices are in range, counts agree with
// what was passed on, and do not depend on the size of blocks or, where all is finite, on whether
// other points would be skipped. JSON that was read reads back the same.
FileVerdict CheckFile(FileKind kind, std::string_view content);

// A small file of each kind, and more than one where the kind has variants.
struct SeedFile {
  FileKind kind;
  std::string content;
};
std::vector<SeedFile> SeedFiles();

// Words and numbers that these files are made of, right and wrong.
const std::vector<std::string>& FileTokens();

}  // namespace hulld::fuzz

#endif  // HULLD_TESTS_FUZZ_FILES_FILE_CHECK_H_
