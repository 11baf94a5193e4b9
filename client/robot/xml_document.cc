#include "client/robot/xml_document.h"

#include <absl/strings/ascii.h>
#include <absl/strings/str_cat.h>

#include <algorithm>
#include <set>
#include <string_view>

#include "client/formats/text_number.h"

namespace hulld {
namespace {

bool IsSpace(char c) { return absl::ascii_isspace(static_cast<unsigned char>(c)); }
bool EndsName(char c) { return IsSpace(c) || c == '>' || c == '/' || c == '=' || c == '<'; }

// Checks that the tags of a text are well-formed before pugixml parses it. Its errors name neither
// the tag nor the attribute, and it accepts an attribute twice.
class TagWalk {
 public:
  TagWalk(std::string_view text, const std::string& name) : text_(text), name_(name) {}

  absl::Status Run() {
    if (text_.find('\0') != std::string_view::npos) return Error("the text contains a zero byte");
    while (at_ < text_.size()) {
      absl::Status step = text_[at_] == '<' ? TakeMarkup() : TakeText();
      if (!step.ok()) return step;
    }
    if (!open_.empty()) {
      return Error(absl::StrCat("the file ends before </", open_.back().name, ">, which closes <",
                                open_.back().name, "> of line ", open_.back().line));
    }
    return roots_ == 1 ? absl::OkStatus() : Error("the file contains no element");
  }

 private:
  struct Open {
    std::string name;
    uint64_t line;
  };

  absl::Status Error(const std::string& message) const {
    return absl::InvalidArgumentError(absl::StrCat(name_, ":", line_, ": ", message));
  }

  bool StartsWith(std::string_view start) const { return text_.substr(at_, start.size()) == start; }

  void Advance(size_t count) {
    for (; count > 0; --count) line_ += text_[at_++] == '\n' ? 1 : 0;
  }

  void SkipSpace() {
    while (at_ < text_.size() && IsSpace(text_[at_])) Advance(1);
  }

  // Skips to the end of the next occurrence of `end`.
  absl::Status SkipPast(std::string_view end, const char* what) {
    const size_t found = text_.find(end, at_);
    if (found == std::string_view::npos) return Error(absl::StrCat(what, " is not closed"));
    Advance(found + end.size() - at_);
    return absl::OkStatus();
  }

  absl::Status TakeText() {
    if (open_.empty() && !IsSpace(text_[at_])) {
      return Error("text outside of all elements; is this an XML file?");
    }
    Advance(1);
    return absl::OkStatus();
  }

  absl::Status TakeMarkup() {
    if (StartsWith("<!--")) {
      Advance(4);
      return SkipPast("-->", "a comment");
    }
    if (StartsWith("<![CDATA[")) {
      return open_.empty() ? Error("text outside of all elements") : SkipPast("]]>", "<![CDATA[");
    }
    if (StartsWith("<?")) return SkipPast("?>", "<?");
    if (StartsWith("<!")) return Error("document types are not supported; remove <!DOCTYPE ...>");
    return StartsWith("</") ? TakeEnd() : TakeStart();
  }

  std::string TakeName() {
    const size_t begin = at_;
    while (at_ < text_.size() && !EndsName(text_[at_])) ++at_;
    return std::string(text_.substr(begin, at_ - begin));
  }

  absl::Status TakeEnd() {
    Advance(2);
    const std::string name = TakeName();
    SkipSpace();
    if (at_ >= text_.size() || text_[at_] != '>') return Error("a tag </... is not closed by >");
    if (open_.empty()) return Error(absl::StrCat("</", name, "> has no matching start tag"));
    if (name != open_.back().name) {
      return Error(absl::StrCat("</", name, "> does not close <", open_.back().name, "> of line ",
                                open_.back().line));
    }
    Advance(1);
    open_.pop_back();
    return absl::OkStatus();
  }

  absl::Status TakeStart() {
    Advance(1);
    const uint64_t line = line_;
    const std::string name = TakeName();
    const bool starts_well =
        !name.empty() && (absl::ascii_isalpha(static_cast<unsigned char>(name[0])) ||
                          name[0] == '_' || static_cast<unsigned char>(name[0]) >= 0x80);
    if (!starts_well) return Error("expected a name after <; in text, write &lt;");
    // Macros needed no prefix before 2015.
    const bool is_old_macro = open_.size() == 1 && (name == "include" || name == "macro");
    if (name.rfind("xacro:", 0) == 0 || is_old_macro) {
      return Error(absl::StrCat("<", name, "> is a macro; expand the file with 'xacro' first"));
    }
    if (open_.empty() && ++roots_ > 1) return Error("a second root element");
    std::set<std::string> attributes;
    for (;;) {
      SkipSpace();
      if (at_ >= text_.size()) return Error(absl::StrCat("the tag <", name, " is not closed by >"));
      if (text_[at_] == '>') {
        if (open_.size() >= kMaxXmlDepth) {
          return Error(absl::StrCat("elements are nested deeper than ", kMaxXmlDepth));
        }
        open_.push_back({name, line});
        Advance(1);
        return absl::OkStatus();
      }
      if (StartsWith("/>")) {
        Advance(2);
        return absl::OkStatus();
      }
      if (absl::Status taken = TakeAttribute(name, &attributes); !taken.ok()) return taken;
    }
  }

  absl::Status TakeAttribute(const std::string& element, std::set<std::string>* known) {
    const std::string name = TakeName();
    SkipSpace();
    if (name.empty() || at_ >= text_.size() || text_[at_] != '=') {
      return Error(absl::StrCat("in <", element, ">, ", Quoted(name),
                                " is not an attribute; write NAME=\"VALUE\""));
    }
    if (!known->insert(name).second) {
      return Error(absl::StrCat("<", element, "> has the attribute ", name, " twice"));
    }
    Advance(1);
    SkipSpace();
    const char quote = at_ < text_.size() ? text_[at_] : ' ';
    if (quote != '"' && quote != '\'') {
      return Error(absl::StrCat("the value of ", name, " in <", element, "> needs quotes"));
    }
    Advance(1);
    const size_t end = text_.find(quote, at_);
    const std::string_view value = text_.substr(at_, end - at_);
    if (end == std::string_view::npos || value.find('<') != std::string_view::npos) {
      return Error(absl::StrCat("the value of ", name, " in <", element, "> is not closed"));
    }
    Advance(value.size() + 1);
    return absl::OkStatus();
  }

  const std::string_view text_;
  const std::string& name_;
  size_t at_ = 0;
  uint64_t line_ = 1;
  int roots_ = 0;
  std::vector<Open> open_;
};

// Converts ISO 8859-1, the most common encoding of files that are not UTF-8.
std::string Utf8FromLatin1(const std::string& text) {
  std::string utf8;
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    if (byte >= 0x80) utf8 += static_cast<char>(0xC0 | byte >> 6);
    utf8 += byte < 0x80 ? c : static_cast<char>(0x80 | (byte & 0x3F));
  }
  return utf8;
}

}  // namespace

int XmlDocument::LineOf(pugi::xml_node element) const {
  return 1 +
         static_cast<int>(std::count(text.begin(), text.begin() + element.offset_debug(), '\n'));
}

absl::Status XmlDocument::ErrorAt(pugi::xml_node element, const std::string& message) const {
  return absl::InvalidArgumentError(absl::StrCat(name, ":", LineOf(element), ": ", message));
}

absl::StatusOr<std::unique_ptr<XmlDocument>> ParseXml(const std::string& text,
                                                      const std::string& name,
                                                      const std::string& root) {
  if (absl::Status walked = TagWalk(text, name).Run(); !walked.ok()) return walked;
  auto document = std::make_unique<XmlDocument>();
  document->name = name;
  document->text = IsUtf8(text) ? text : Utf8FromLatin1(text);
  const pugi::xml_parse_result parsed = document->tree.load_buffer(
      document->text.data(), document->text.size(), pugi::parse_default, pugi::encoding_utf8);
  if (!parsed) {
    return absl::InvalidArgumentError(
        absl::StrCat(name, ": not valid XML: ", parsed.description()));
  }
  if (document->root().name() == root) return document;
  return document->ErrorAt(
      document->root(),
      absl::StrCat("the outermost element is <", document->root().name(), ">, not <", root, ">"));
}

absl::StatusOr<std::vector<double>> NumbersOf(const XmlDocument& document, pugi::xml_node element,
                                              const char* attribute, size_t count) {
  const std::string_view text = element.attribute(attribute).value();
  const auto error = [&](const std::string& problem) {
    return document.ErrorAt(element, absl::StrCat("<", element.name(), "> ", problem));
  };
  std::vector<double> numbers;
  std::string_view rest = text;
  for (std::string_view token; !(token = NextToken(&rest)).empty();) {
    const auto number = ParseFinite(token);
    if (!number.ok()) {
      const bool is_macro = text.find("${") != std::string_view::npos;
      return error(absl::StrCat(attribute, ": ", number.status().message(),
                                is_macro ? "; expand the file with 'xacro' first" : ""));
    }
    numbers.push_back(*number);
  }
  if (numbers.size() == count) return numbers;
  if (!element.attribute(attribute)) {
    return error(absl::StrCat("lacks ", attribute, "=\"...\""));
  }
  return error(absl::StrCat(attribute, " needs ", count, count == 1 ? " number" : " numbers",
                            ", got ", numbers.size()));
}

}  // namespace hulld
