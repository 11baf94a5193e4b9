#include "client/hullctl/view/bridge/page_html.h"

#include <absl/strings/escaping.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_replace.h>
#include <zlib.h>

#include "client/hullctl/printing/json.h"

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
template <typename TextOf>
std::string ModulesJson(const TextOf& text_of) {
  JsonObject modules;
  for (const PageFile& file : PageFiles()) {
    if (!IsModule(file.name)) continue;
    modules.Add(absl::StrCat("hulld/", std::string(file.name)).c_str(), text_of(file));
  }
  return modules.Close();
}

template <typename AddressOf>
std::string ImportMap(const AddressOf& address_of) {
  return JsonObject().AddJson("imports", ModulesJson(address_of)).Close();
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

// Runs the packed scripts: a list of classic scripts, then the modules by name.
constexpr char kUnpack[] = R"js((async () => {
  const packed = Uint8Array.from(
      atob(document.getElementById('packed').textContent), (c) => c.charCodeAt(0));
  const unpacked = new Blob([packed]).stream().pipeThrough(new DecompressionStream('deflate'));
  const texts = await new Response(unpacked).json();
  if (document.readyState === 'loading') {
    await new Promise((resolve) => addEventListener('DOMContentLoaded', resolve));
  }
  const modules = Object.entries(texts.pop());
  const imports = Object.fromEntries(modules.map(
      ([name, text]) => [name, `data:text/javascript,${encodeURIComponent(text)}`]));
  const run = (type, textContent) =>
      document.head.append(Object.assign(document.createElement('script'), {type, textContent}));
  for (const text of texts) run('text/javascript', text);
  run('importmap', JSON.stringify({imports}));
  run('module', 'import "hulld/main.js";');
})())js";

// Compresses in the format of zlib, "deflate" in browsers.
std::string Deflated(const std::string& text) {
  uLongf size = compressBound(text.size());
  std::string packed(size, '\0');
  compress2(reinterpret_cast<Bytef*>(packed.data()), &size,
            reinterpret_cast<const Bytef*>(text.data()), text.size(), Z_BEST_COMPRESSION);
  packed.resize(size);
  return packed;
}

// Returns index.html with its style and a recording inside, and scripts that start the page.
std::string StandaloneHtml(std::string_view recording_json, const std::string& scripts) {
  // The policy permits no connection at all.
  return FillIn(
      absl::StrCat("<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; "
                   "script-src 'unsafe-inline' data:; style-src 'unsafe-inline'\">\n<style>\n",
                   std::string(FindPageFile("style.css")->bytes),
                   "</style>\n<script type=\"application/json\" id=\"recording\">",
                   InScript(recording_json), "</script>\n", scripts));
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
  std::string texts = "[";
  for (const std::string_view script : kClassicScripts) {
    absl::StrAppend(&texts, QuoteJson(FindPageFile(script)->bytes), ",");
  }
  const std::string modules =
      ModulesJson([](const PageFile& file) { return std::string(file.bytes); });
  return StandaloneHtml(recording_json,
                        absl::StrCat("<script type=\"text/plain\" id=\"packed\">",
                                     absl::Base64Escape(Deflated(texts + modules + "]")),
                                     "</script>\n<script>", kUnpack, "</script>"));
}

std::string PicturePage(std::string_view recording_json, const PictureSize& size) {
  std::string scripts;
  for (const std::string_view script : kClassicScripts) {
    absl::StrAppend(&scripts, "<script>", InScript(FindPageFile(script)->bytes), "</script>\n");
  }
  const std::string map = ImportMap([](const PageFile& file) {
    return absl::StrCat("data:text/javascript;base64,",
                        absl::Base64Escape({file.bytes.data(), file.bytes.size()}));
  });
  absl::StrAppend(&scripts, "<script type=\"importmap\">", map,
                  "</script>\n<script type=\"module\">import \"hulld/main.js\";</script>");
  const std::string body = absl::StrCat("\n<body class=\"picture\" style=\"--width: ", size.width,
                                        "px; --height: ", size.height, "px\">\n");
  return absl::StrReplaceAll(StandaloneHtml(recording_json, scripts), {{"\n<body>\n", body}});
}

}  // namespace hulld
