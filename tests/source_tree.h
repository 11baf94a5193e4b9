#pragma once

#include <filesystem>

namespace hulld {

// Returns the top of the source tree that this program was built from. A function, so that all
// files but one compile to the same bytes in every checkout.
std::filesystem::path SourceTree();

// Returns the folder of real meshes: $HULLD_DATA, or ../shared/data relative to the source tree. It
// need not exist.
std::filesystem::path RealData();

}  // namespace hulld
