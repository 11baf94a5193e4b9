#ifndef HULLD_CLIENT_HULLCTL_VIEW_BRIDGE_PAGE_HTML_H_
#define HULLD_CLIENT_HULLCTL_VIEW_BRIDGE_PAGE_HTML_H_

#include <cstdint>
#include <string>
#include <string_view>

namespace hulld {

// index.html, whose scripts and styles the browser fetches one by one. `nonce` admits the one
// script that stands in the page: the map from modules' names to addresses.
std::string ServedPage(std::string_view nonce);

// What the page may do, as the value of the header Content-Security-Policy: its own scripts and
// styles, and a WebSocket to `host`, nothing else.
std::string ServedPagePolicy(std::string_view nonce, std::string_view host);

// The same page as one file that needs no server and no network. `recording_json`: what the page
// shows (protocol.h).
std::string StandalonePage(std::string_view recording_json);

// In pixels.
struct PictureSize {
  uint32_t width = 1600;
  uint32_t height = 1000;
};

// The same without its panels, which puts a PNG of what it shows, as a data URL, into the attribute
// data-png of its body.
std::string PicturePage(std::string_view recording_json, const PictureSize& size);

}  // namespace hulld

#endif  // HULLD_CLIENT_HULLCTL_VIEW_BRIDGE_PAGE_HTML_H_
