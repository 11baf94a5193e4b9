#include "tests/source_tree.h"

#include <cstdlib>

namespace hulld {

std::filesystem::path SourceTree() { return HULLD_SOURCE_DIR; }

std::filesystem::path RealData() {
  const char* named = std::getenv("HULLD_DATA");
  return named != nullptr ? named : SourceTree() / "../shared/data";
}

}  // namespace hulld
