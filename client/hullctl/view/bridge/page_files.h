#ifndef HULLD_CLIENT_HULLCTL_VIEW_BRIDGE_PAGE_FILES_H_
#define HULLD_CLIENT_HULLCTL_VIEW_BRIDGE_PAGE_FILES_H_

#include <span>
#include <string_view>

namespace hulld {

// A file of the viewer's page, embedded at build time.
struct PageFile {
  // For example "index.html"; names of three.js files start with "three/".
  std::string_view name;
  std::string_view bytes;
};

// Returns all files. embed_page.cmake embeds them in the program.
std::span<const PageFile> PageFiles();

// Returns null for an unknown name.
const PageFile* FindPageFile(std::string_view name);

// Returns the media type of a file by its name.
std::string_view MediaTypeOf(std::string_view name);

}  // namespace hulld

#endif  // HULLD_CLIENT_HULLCTL_VIEW_BRIDGE_PAGE_FILES_H_
