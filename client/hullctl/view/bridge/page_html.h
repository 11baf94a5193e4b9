#ifndef HULLD_CLIENT_HULLCTL_VIEW_BRIDGE_PAGE_HTML_H_
#define HULLD_CLIENT_HULLCTL_VIEW_BRIDGE_PAGE_HTML_H_

#include <cstdint>
#include <span>
#include <string>
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

// Returns index.html; the browser fetches its scripts and styles separately. `nonce` admits the
// inline script: the import map.
std::string ServedPage(std::string_view nonce);

// Returns the Content-Security-Policy header: own scripts and styles, and a WebSocket to `host`,
// nothing else.
std::string ServedPagePolicy(std::string_view nonce, std::string_view host);

// Returns the page as a single file that needs no server and no network. `recording_json`: its
// content (protocol.h). The scripts are compressed: about 300 KB.
std::string StandalonePage(std::string_view recording_json);

// In pixels.
struct PictureSize {
  uint32_t width = 1600;
  uint32_t height = 1000;
};

// Returns a standalone page without panels that stores a PNG of its view, as a data URL, in the
// attribute data-png of its body. Its scripts run immediately, because virtual time does not wait
// for decompression.
std::string PicturePage(std::string_view recording_json, const PictureSize& size);

}  // namespace hulld

#endif  // HULLD_CLIENT_HULLCTL_VIEW_BRIDGE_PAGE_HTML_H_
