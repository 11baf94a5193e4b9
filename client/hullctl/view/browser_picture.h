#ifndef HULLD_CLIENT_HULLCTL_VIEW_BROWSER_PICTURE_H_
#define HULLD_CLIENT_HULLCTL_VIEW_BROWSER_PICTURE_H_

#include <absl/status/statusor.h>

#include <string>

#include "client/hullctl/view/bridge/page_html.h"

namespace hulld {

// "1600x1000". INVALID_ARGUMENT: it is none, or a side is not from 64 to 16384.
absl::StatusOr<PictureSize> ParsePictureSize(const std::string& text);

// The bytes of the PNG that a PicturePage makes of itself in a browser without a window: the first
// of chromium, chromium-browser, google-chrome, google-chrome-stable and microsoft-edge on the
// PATH, or the one that $HULLCTL_BROWSER names. It works in a temporary folder, which goes
// afterwards. FAILED_PRECONDITION: there is no browser. INTERNAL: it made no picture, with what it
// said last.
absl::StatusOr<std::string> PictureOf(const std::string& picture_page);

}  // namespace hulld

#endif  // HULLD_CLIENT_HULLCTL_VIEW_BROWSER_PICTURE_H_
