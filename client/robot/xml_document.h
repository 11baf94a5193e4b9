#ifndef HULLD_CLIENT_ROBOT_XML_DOCUMENT_H_
#define HULLD_CLIENT_ROBOT_XML_DOCUMENT_H_

#include <absl/status/statusor.h>
#include <tinyxml.h>

#include <memory>
#include <string>
#include <vector>

namespace hulld {

// An XML document in memory, and the name that errors call it by.
struct XmlDocument {
  std::string name;
  TiXmlDocument tree;

  // INVALID_ARGUMENT "NAME:LINE: message", at the element.
  absl::Status ErrorAt(const TiXmlElement& element, const std::string& message) const;
};

// Nested deeper than this, an element is refused: TinyXML recurses.
inline constexpr size_t kMostXmlDepth = 100;

// Parses a text that is well-formed XML without a document type. INVALID_ARGUMENT names the line:
// a tag that is not closed, or closed by another one; a document type; a macro of xacro, which is
// to be expanded first; a root other than `root`.
absl::StatusOr<std::unique_ptr<XmlDocument>> ParseXml(const std::string& text,
                                                      const std::string& name,
                                                      const std::string& root);

// The same of a file; - is standard input.
absl::StatusOr<std::unique_ptr<XmlDocument>> ReadXml(const std::string& path,
                                                     const std::string& root);

// The elements of that name below `parent`, in order.
std::vector<const TiXmlElement*> ChildrenOf(const TiXmlElement& parent, const char* name);

// The attribute, or nothing where it is missing.
std::string AttributeOf(const TiXmlElement& element, const char* name);

// `count` finite numbers with spaces between them. INVALID_ARGUMENT names line, element and
// attribute.
absl::StatusOr<std::vector<double>> NumbersOf(const XmlDocument& document,
                                              const TiXmlElement& element, const char* attribute,
                                              size_t count);

}  // namespace hulld

#endif  // HULLD_CLIENT_ROBOT_XML_DOCUMENT_H_
