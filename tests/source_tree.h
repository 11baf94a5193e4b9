#pragma once

#include <filesystem>

namespace hulld {

// The top of the source tree that this program was built from. A function, so that all files but
// one compile to the same bytes in every checkout.
std::filesystem::path SourceTree();

// The folder of real meshes: the one that the variable HULLD_DATA names, or ../shared/data beside
// the source tree. It need not exist.
std::filesystem::path RealData();

}  // namespace hulld
