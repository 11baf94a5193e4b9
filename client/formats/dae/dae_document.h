#ifndef HULLD_CLIENT_FORMATS_DAE_DAE_DOCUMENT_H_
#define HULLD_CLIENT_FORMATS_DAE_DAE_DOCUMENT_H_

#include <absl/status/status.h>

#include <cstddef>
#include <cstdint>
#include <map>
#include <pugixml.hpp>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "client/formats/byte_source.h"
#include "client/formats/length_scale.h"
#include "client/formats/text_number.h"

namespace hulld {

// A COLLADA document: XML elements that refer to each other by ID. Ignores namespace prefixes.
// Expands only the entities that XML predefines. Sources: Khronos, COLLADA 1.4.1 and 1.5 (2008).
//
// Keeps the first error. After an error, functions return empty or zero results, and callers stop.
class DaeDocument {
 public:
  // source: must outlive this.
  explicit DaeDocument(ByteSource* source) : source_(source) {}

  // Reads and parses the file. INVALID_ARGUMENT: it is not well-formed, or not COLLADA.
  absl::Status Load();

  const absl::Status& status() const { return status_; }
  bool ok() const { return status_.ok(); }
  // Store an error unless an earlier one is stored. node: not null; the subject of the message.
  // place: a position in a name or text of the document, which determines the line.
  void Fail(pugi::xml_node node, const std::string& predicate);
  void FailAt(const char* place, const std::string& message);
  void Keep(const absl::Status& status);
  // Returns the line of an element, from 1.
  uint64_t LineOf(pugi::xml_node node) const { return LineAt(node.name()); }

  pugi::xml_node root() const { return xml_.document_element(); }
  // Meters per unit of length.
  const LengthScale& unit() const { return unit_; }

  // Returns the name of an element without its prefix.
  static std::string_view NameOf(pugi::xml_node node);
  // Returns the first child element of that name, or null.
  static pugi::xml_node ChildOf(pugi::xml_node node, std::string_view name);
  // Returns true if the attribute refers to `target`: "#" and its ID.
  static bool RefersTo(pugi::xml_node node, const char* attribute, pugi::xml_node target);
  // Returns the geometry, node, or visual_scene (name) to which the attribute `url` refers. Error:
  // no such element exists, or several have this ID.
  pugi::xml_node TargetOf(pugi::xml_node node, const std::string& name);

  // Returns an attribute that is a number below 2^32. absent: the result if the attribute is
  // missing.
  uint64_t IntegerOf(pugi::xml_node node, const char* attribute, uint64_t absent);
  // Returns the text of an element as `count` finite numbers; zeros on error.
  std::vector<double> NumbersOf(pugi::xml_node node, size_t count);
  // Parses a word of a text with `parse`, for example ParseDouble.
  template <typename Parse>
  double NumberOf(std::string_view word, const Parse& parse) {
    double number = 0;
    if (const NumberText kind = parse(word, &number); kind != NumberText::kNumber) {
      FailAt(word.data(), NumberProblem(kind, word));
    }
    return number;
  }

  // Calls take(word) for each word in the text of an element, until the first error. Returns the
  // number of calls.
  template <typename Take>
  size_t ForEachWord(pugi::xml_node node, const Take& take) {
    size_t count = 0;
    for (const pugi::xml_node text : node.children()) {
      if (text.type() != pugi::node_pcdata && text.type() != pugi::node_cdata) continue;
      std::string_view rest = text.value();
      for (std::string_view word; ok() && !(word = NextToken(&rest)).empty(); ++count) take(word);
    }
    return count;
  }

 private:
  uint64_t LineAt(const char* place) const;
  void Index(pugi::xml_node node);
  void ReadUnit();

  ByteSource* source_;
  absl::Status status_;
  std::string text_;
  pugi::xml_document xml_;
  // The parser's copy of the text; names and texts have the same offsets there.
  const char* copy_ = nullptr;
  LengthScale unit_;
  // Elements by name and ID.
  std::multimap<std::pair<std::string_view, std::string_view>, pugi::xml_node> by_id_;
};

}  // namespace hulld

#endif  // HULLD_CLIENT_FORMATS_DAE_DAE_DOCUMENT_H_
