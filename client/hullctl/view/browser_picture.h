#ifndef HULLD_CLIENT_HULLCTL_VIEW_BROWSER_PICTURE_H_
#define HULLD_CLIENT_HULLCTL_VIEW_BROWSER_PICTURE_H_

#include <absl/status/statusor.h>

#include <string>

#include "client/hullctl/view/bridge/page_html.h"

namespace hulld {

// Parses "1600x1000". INVALID_ARGUMENT: another format, or a side outside of 64 to 16384.
absl::StatusOr<PictureSize> ParsePictureSize(const std::string& text);

// Returns the PNG that a PicturePage renders of itself in a headless browser: the one named by
// $HULLCTL_BROWSER, or the first of chromium, chromium-browser, google-chrome,
// google-chrome-stable, and microsoft-edge on the PATH. Uses a temporary folder, deleted
// afterwards. FAILED_PRECONDITION: no browser. INTERNAL: no picture, with the browser's last
// message.
absl::StatusOr<std::string> PictureOf(const std::string& picture_page);

}  // namespace hulld

#endif  // HULLD_CLIENT_HULLCTL_VIEW_BROWSER_PICTURE_H_
