#ifndef HULLD_CLIENT_ROBOT_XML_DOCUMENT_H_
#define HULLD_CLIENT_ROBOT_XML_DOCUMENT_H_

#include <absl/status/statusor.h>

#include <memory>
#include <pugixml.hpp>
#include <string>
#include <vector>

namespace hulld {

// A parsed XML document, and its name in errors.
struct XmlDocument {
  std::string name;
  std::string text;
  pugi::xml_document tree;

  pugi::xml_node root() const { return tree.document_element(); }
  // Returns the line of an element, from 1.
  int LineOf(pugi::xml_node element) const;
  // Returns INVALID_ARGUMENT "NAME:LINE: message" for the element.
  absl::Status ErrorAt(pugi::xml_node element, const std::string& message) const;
};

// Maximum nesting depth of elements.
inline constexpr size_t kMaxXmlDepth = 100;

// Parses well-formed XML without a document type. INVALID_ARGUMENT names the line: a tag that is
// not closed, or closed by another one; an attribute that occurs twice; a document type; a macro of
// xacro, which must be expanded first; or a root other than `root`.
absl::StatusOr<std::unique_ptr<XmlDocument>> ParseXml(const std::string& text,
                                                      const std::string& name,
                                                      const std::string& root);

// Parses `count` finite numbers separated by spaces. INVALID_ARGUMENT names line, element, and
// attribute.
absl::StatusOr<std::vector<double>> NumbersOf(const XmlDocument& document, pugi::xml_node element,
                                              const char* attribute, size_t count);

}  // namespace hulld

#endif  // HULLD_CLIENT_ROBOT_XML_DOCUMENT_H_
