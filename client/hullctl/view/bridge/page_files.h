#ifndef HULLD_CLIENT_HULLCTL_VIEW_BRIDGE_PAGE_FILES_H_
#define HULLD_CLIENT_HULLCTL_VIEW_BRIDGE_PAGE_FILES_H_

#include <span>
#include <string_view>

namespace hulld {

// A file of the viewer's page, as it was at build time.
struct PageFile {
  // As in "index.html"; those of three.js start with "three/".
  std::string_view name;
  std::string_view bytes;
};

// All of them; embed_page.cmake makes them part of the program.
std::span<const PageFile> PageFiles();

// Null when there is none of this name.
const PageFile* FindPageFile(std::string_view name);

// The media type of a file by its name.
std::string_view MediaTypeOf(std::string_view name);

}  // namespace hulld

#endif  // HULLD_CLIENT_HULLCTL_VIEW_BRIDGE_PAGE_FILES_H_
