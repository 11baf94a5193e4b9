#include "client/hullctl/scene/yaml_reader.h"

#include <absl/strings/ascii.h>
#include <absl/strings/match.h>
#include <absl/strings/numbers.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>
#include <absl/strings/str_join.h>
#include <yaml-cpp/depthguard.h>
#include <yaml-cpp/eventhandler.h>

#include <algorithm>
#include <exception>
#include <set>
#include <sstream>
#include <string_view>

#include "client/base/status_macros.h"
#include "client/formats/text_number.h"
#include "client/hullctl/help/suggestion.h"

namespace hulld {
namespace {

// Maximum size of a scene. Larger ones use the contract's packed form.
constexpr size_t kMaxSceneBytes = size_t{64} << 20;

std::string PlaceText(const std::string& name, const YAML::Mark& mark) {
  if (mark.is_null()) return name;
  return absl::StrCat(name, ":", mark.line + 1, ":", mark.column + 1);
}

// Records where the last document starts and ignores its content.
class DocumentStart : public YAML::EventHandler {
 public:
  const YAML::Mark& mark() const { return mark_; }

  void OnDocumentStart(const YAML::Mark& mark) override { mark_ = mark; }
  void OnDocumentEnd() override {}
  void OnNull(const YAML::Mark&, YAML::anchor_t) override {}
  void OnAlias(const YAML::Mark&, YAML::anchor_t) override {}
  void OnScalar(const YAML::Mark&, const std::string&, YAML::anchor_t,
                const std::string&) override {}
  void OnSequenceStart(const YAML::Mark&, const std::string&, YAML::anchor_t,
                       YAML::EmitterStyle::value) override {}
  void OnSequenceEnd() override {}
  void OnMapStart(const YAML::Mark&, const std::string&, YAML::anchor_t,
                  YAML::EmitterStyle::value) override {}
  void OnMapEnd() override {}

 private:
  YAML::Mark mark_;
};

// Returns advice if a line starts with a tab, which YAML does not allow as indentation.
std::string TabAdvice(const std::string& text) {
  const size_t tab = text.find("\n\t");
  if (tab == std::string::npos) return "";
  const auto end = text.begin() + static_cast<ptrdiff_t>(tab);
  return absl::StrCat("; line ", std::count(text.begin(), end, '\n') + 2,
                      " starts with a tab; indent with spaces");
}

// Returns the UTF-16 code unit whose JSON escape, such as \ud83d, starts the text; 0 if none does.
uint32_t EscapedUnit(std::string_view text) {
  uint32_t unit = 0;
  const bool is_escape = text.size() >= 6 && text.starts_with("\\u") &&
                         absl::SimpleHexAtoi({text.data() + 2, 4}, &unit);
  return is_escape ? unit : 0;
}

// Replaces the JSON escapes of characters beyond U+FFFF, such as \ud83d\ude00, by those of YAML,
// \U0001F600. All other JSON is YAML.
std::string WithYamlEscapes(std::string_view json) {
  std::string yaml;
  while (!json.empty()) {
    const uint32_t high = EscapedUnit(json);
    const uint32_t low = high >> 10 == 0xD800 >> 10 ? EscapedUnit(json.substr(6)) : 0;
    if (low >> 10 == 0xDC00 >> 10) {
      absl::StrAppendFormat(&yaml, "\\U%08X", 0x10000 + ((high & 0x3FF) << 10) + (low & 0x3FF));
      json.remove_prefix(12);
      continue;
    }
    // An escaped backslash starts no escape.
    const size_t size = json.starts_with("\\\\") ? 2 : 1;
    yaml.append(json.substr(0, size));
    json.remove_prefix(size);
  }
  return yaml;
}

}  // namespace

absl::StatusOr<YamlReader> YamlReader::Parse(const std::string& text, const std::string& name) {
  if (text.size() > kMaxSceneBytes) {
    return absl::InvalidArgumentError(absl::StrCat(
        name, ": more than ", kMaxSceneBytes, " bytes; write a larger scene as packedPlacements"));
  }
  if (!IsUtf8(text)) {
    return absl::InvalidArgumentError(
        absl::StrCat(name, ": is not UTF-8 text; convert it first: iconv -f ISO-8859-1 -t UTF-8"));
  }
  const bool is_json = absl::StartsWith(absl::StripLeadingAsciiWhitespace(text), "{");
  const std::string yaml = is_json ? WithYamlEscapes(text) : text;
  // Parses at most two documents: for text such as ",", yaml-cpp 0.7 never stops finding
  // documents.
  YAML::Node root;
  int documents = 0;
  DocumentStart last;
  try {
    std::istringstream input(yaml);
    YAML::Parser parser(input);
    while (documents < 2 && parser.HandleNextDocument(last)) ++documents;
    if (documents == 1) root = YAML::Load(yaml);
  } catch (const YAML::DeepRecursion& problem) {
    return absl::InvalidArgumentError(
        absl::StrCat(PlaceText(name, problem.mark), ": nested too deeply"));
  } catch (const YAML::Exception& problem) {
    return absl::InvalidArgumentError(absl::StrCat(
        PlaceText(name, problem.mark), ": not valid YAML: ", problem.msg, TabAdvice(text)));
  } catch (const std::exception& problem) {
    return absl::InvalidArgumentError(absl::StrCat(name, ": not valid YAML: ", problem.what()));
  }
  if (documents == 0) {
    return absl::InvalidArgumentError(absl::StrCat(name, ": contains no scene"));
  }
  if (documents > 1) {
    return absl::InvalidArgumentError(
        absl::StrCat(PlaceText(name, last.mark()),
                     ": a second document starts here; a scene file contains one"));
  }
  return YamlReader(root, name);
}

std::string YamlReader::PlaceOf(const YAML::Node& node) const {
  return PlaceText(name_, node.Mark());
}

absl::Status YamlReader::ErrorAt(const YAML::Node& node, const std::string& message) const {
  return absl::InvalidArgumentError(absl::StrCat(PlaceOf(node), ": ", message));
}

absl::StatusOr<YamlReader::Entries> YamlReader::EntriesOf(const YAML::Node& node,
                                                          const std::string& what) const {
  if (!node.IsMap())
    return ErrorAt(node, absl::StrCat(what, " is not a mapping of keys to values"));
  Entries entries;
  std::set<std::string> seen;
  for (const auto& entry : node) {
    if (!entry.first.IsScalar() || entry.first.Scalar().empty()) {
      return ErrorAt(entry.first, absl::StrCat("a key of ", what, " is not a string"));
    }
    const std::string& key = entry.first.Scalar();
    if (key == "<<") {
      return ErrorAt(entry.first, "merge keys (<<) are not supported; write out the merged keys");
    }
    if (!seen.insert(key).second) {
      return ErrorAt(entry.first, absl::StrCat(what, " has the key ", Quoted(key), " twice"));
    }
    entries.emplace_back(key, entry.second);
  }
  return entries;
}

absl::StatusOr<YamlReader::Entries> YamlReader::EntriesOf(
    const YAML::Node& node, const std::string& what, const std::vector<std::string>& known) const {
  auto entries = EntriesOf(node, what);
  if (!entries.ok()) return entries;
  for (const auto& entry : node) {
    const std::string& key = entry.first.Scalar();
    if (std::find(known.begin(), known.end(), key) != known.end()) continue;
    const std::string hint = Suggestion(key, known);
    return ErrorAt(entry.first, absl::StrCat(what, " has no key ", Quoted(key),
                                             hint.empty() ? absl::StrCat("; keys are ",
                                                                         absl::StrJoin(known, ", "))
                                                          : hint));
  }
  return entries;
}

absl::StatusOr<std::string> YamlReader::Text(const YAML::Node& node, const std::string& key) const {
  if (node.IsScalar() && !node.Scalar().empty()) return node.Scalar();
  return ErrorAt(node, absl::StrCat(key, " must be a string"));
}

absl::StatusOr<double> YamlReader::Number(const YAML::Node& node, const std::string& key) const {
  if (!node.IsScalar()) return ErrorAt(node, absl::StrCat(key, " must be a number"));
  auto number = ParseFinite(node.Scalar());
  if (number.ok()) return number;
  return ErrorAt(node, absl::StrCat(key, ": ", number.status().message()));
}

absl::StatusOr<bool> YamlReader::Truth(const YAML::Node& node, const std::string& key) const {
  const std::string text = node.IsScalar() ? absl::AsciiStrToLower(node.Scalar()) : "";
  if (text == "true" || text == "false") return text == "true";
  return ErrorAt(node, absl::StrCat(key, " must be true or false"));
}

absl::StatusOr<std::vector<double>> YamlReader::Numbers(const YAML::Node& node,
                                                        const std::string& key,
                                                        const std::vector<size_t>& counts) const {
  if (!node.IsSequence()) {
    return ErrorAt(node, absl::StrCat(key, " must be a list of numbers, as in [0, 0, 1]"));
  }
  std::vector<double> numbers;
  for (const YAML::Node& entry : node) {
    HULLD_ASSIGN_OR_RETURN(const auto number, Number(entry, key));
    numbers.push_back(number);
  }
  if (counts.empty() || std::find(counts.begin(), counts.end(), numbers.size()) != counts.end()) {
    return numbers;
  }
  return ErrorAt(node, absl::StrCat(key, " must have ", absl::StrJoin(counts, " or "),
                                    " numbers, got ", numbers.size()));
}

absl::StatusOr<std::vector<std::string>> YamlReader::Texts(const YAML::Node& node,
                                                           const std::string& key) const {
  if (!node.IsSequence()) return ErrorAt(node, absl::StrCat(key, " must be a list, as in [a, b]"));
  std::vector<std::string> texts;
  for (const YAML::Node& entry : node) {
    HULLD_ASSIGN_OR_RETURN(auto text, Text(entry, key));
    texts.push_back(std::move(text));
  }
  return texts;
}

}  // namespace hulld
