#include "client/hullctl/view/bridge/page_html.h"

#include <absl/strings/escaping.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_replace.h>

#include <vector>

#include "client/hullctl/printing/json.h"
#include "client/hullctl/view/bridge/page_files.h"

namespace hulld {
namespace {

// Marks the position of styles and scripts in index.html.
constexpr char kMarker[] = "<!-- resources -->";

// Classic scripts of three.js, loaded in this order before our modules.
constexpr std::string_view kClassicScripts[] = {"three/three.min.js", "three/OrbitControls.js",
                                                "three/TransformControls.js"};

bool IsModule(std::string_view name) {
  return name.ends_with(".js") && !name.starts_with("three/");
}

// Our modules import each other as "hulld/NAME.js"; the import map resolves these names. So the
// same files work when served and when embedded in one page.
template <typename AddressOf>
std::string ImportMap(const AddressOf& address_of) {
  JsonObject imports;
  for (const PageFile& file : PageFiles()) {
    if (!IsModule(file.name)) continue;
    imports.Add(absl::StrCat("hulld/", std::string(file.name)).c_str(), address_of(file));
  }
  return JsonObject().AddJson("imports", imports.Close()).Close();
}

std::string FillIn(const std::string& resources) {
  return absl::StrReplaceAll(std::string(FindPageFile("index.html")->bytes),
                             {{kMarker, resources}});
}

// Escapes a script so that it cannot close its <script> element: "</" occurs only in strings, where
// the backslash has no effect.
std::string InScript(std::string_view text) {
  return absl::StrReplaceAll(absl::string_view(text.data(), text.size()), {{"</", "<\\/"}});
}

}  // namespace

std::string ServedPage(std::string_view nonce) {
  std::string resources = "<link rel=\"stylesheet\" href=\"/style.css\">\n";
  for (const std::string_view script : kClassicScripts) {
    absl::StrAppend(&resources, "<script src=\"/", std::string(script), "\"></script>\n");
  }
  const std::string map =
      ImportMap([](const PageFile& file) { return absl::StrCat("/", std::string(file.name)); });
  absl::StrAppend(&resources, "<script type=\"importmap\" nonce=\"", std::string(nonce), "\">", map,
                  "</script>\n<script type=\"module\" src=\"/main.js\"></script>");
  return FillIn(resources);
}

std::string ServedPagePolicy(std::string_view nonce, std::string_view host) {
  return absl::StrCat("default-src 'none'; script-src 'self' 'nonce-", std::string(nonce),
                      "'; style-src 'self'; connect-src ws://", std::string(host),
                      "; base-uri 'none'; form-action 'none'; frame-ancestors 'none'");
}

std::string StandalonePage(std::string_view recording_json) {
  // The policy permits no connection at all.
  std::string resources =
      "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; "
      "script-src 'unsafe-inline' data:; style-src 'unsafe-inline'\">\n";
  absl::StrAppend(&resources, "<style>\n", std::string(FindPageFile("style.css")->bytes),
                  "</style>\n");
  for (const std::string_view script : kClassicScripts) {
    absl::StrAppend(&resources, "<script>", InScript(FindPageFile(script)->bytes), "</script>\n");
  }
  const std::string map = ImportMap([](const PageFile& file) {
    return absl::StrCat("data:text/javascript;base64,",
                        absl::Base64Escape({file.bytes.data(), file.bytes.size()}));
  });
  absl::StrAppend(&resources, "<script type=\"importmap\">", map, "</script>\n",
                  "<script type=\"application/json\" id=\"recording\">", InScript(recording_json),
                  "</script>\n<script type=\"module\">import \"hulld/main.js\";</script>");
  return FillIn(resources);
}

std::string PicturePage(std::string_view recording_json, const PictureSize& size) {
  const std::string body = absl::StrCat("\n<body class=\"picture\" style=\"--width: ", size.width,
                                        "px; --height: ", size.height, "px\">\n");
  return absl::StrReplaceAll(StandalonePage(recording_json), {{"\n<body>\n", body}});
}

}  // namespace hulld
