#ifndef HULLD_TESTS_CLIENT_HULLCTL_XML_CHECK_H_
#define HULLD_TESTS_CLIENT_HULLCTL_XML_CHECK_H_

#include <string>
#include <vector>

namespace hulld {

// Returns empty if `text` is one well-formed XML element, optionally after a declaration; otherwise
// the fault. Supports the subset used by the pictures: elements, attributes in double quotes, text
// with the predefined entities.
inline std::string XmlProblem(const std::string& text) {
  std::vector<std::string> open;
  size_t at = 0;
  bool root_closed = false;
  const auto where = [&at] { return " at " + std::to_string(at); };
  if (text.rfind("<?xml ", 0) == 0) at = text.find("?>") + 2;
  while (at < text.size()) {
    if (text[at] == '&') {
      bool known = false;
      for (const char* entity : {"&amp;", "&lt;", "&gt;"}) {
        known = known || text.compare(at, std::string(entity).size(), entity) == 0;
      }
      if (!known) return "unknown entity" + where();
    }
    if (text[at] != '<') {
      if (open.empty() && text[at] != '\n') return "text outside of the root" + where();
      ++at;
      continue;
    }
    const size_t end = text.find('>', at);
    if (end == std::string::npos) return "tag does not end" + where();
    std::string tag = text.substr(at + 1, end - at - 1);
    if (tag.find('<') != std::string::npos) return "'<' within a tag" + where();
    if (tag[0] == '/') {
      if (open.empty() || open.back() != tag.substr(1)) return "wrong end tag" + where();
      open.pop_back();
      root_closed = open.empty();
    } else {
      if (root_closed) return "two roots" + where();
      const bool empty_element = tag.back() == '/';
      if (empty_element) tag.pop_back();
      size_t quotes = 0;
      for (const char c : tag) quotes += c == '"';
      if (quotes % 2 != 0) return "odd quotes" + where();
      if (!empty_element) open.push_back(tag.substr(0, tag.find(' ')));
    }
    at = end + 1;
  }
  return root_closed && open.empty() ? "" : "an element is not closed";
}

}  // namespace hulld

#endif  // HULLD_TESTS_CLIENT_HULLCTL_XML_CHECK_H_
