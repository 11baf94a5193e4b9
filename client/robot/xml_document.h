#ifndef HULLD_CLIENT_ROBOT_XML_DOCUMENT_H_
#define HULLD_CLIENT_ROBOT_XML_DOCUMENT_H_

#include <absl/status/statusor.h>
#include <tinyxml.h>

#include <memory>
#include <string>
#include <vector>

namespace hulld {

// A parsed XML document, and its name in errors.
struct XmlDocument {
  std::string name;
  TiXmlDocument tree;

  // Returns INVALID_ARGUMENT "NAME:LINE: message" for the element.
  absl::Status ErrorAt(const TiXmlElement& element, const std::string& message) const;
};

// Maximum nesting depth of elements. Bounds the recursion of TinyXML.
inline constexpr size_t kMaxXmlDepth = 100;

// Parses well-formed XML without a document type. INVALID_ARGUMENT names the line: a tag that is
// not closed, or closed by another one; a document type; a macro of xacro, which must be expanded
// first; or a root other than `root`.
absl::StatusOr<std::unique_ptr<XmlDocument>> ParseXml(const std::string& text,
                                                      const std::string& name,
                                                      const std::string& root);

// Parses a file; "-" is standard input.
absl::StatusOr<std::unique_ptr<XmlDocument>> ReadXml(const std::string& path,
                                                     const std::string& root);

// Returns the child elements of `parent` with that name, in order.
std::vector<const TiXmlElement*> ChildrenOf(const TiXmlElement& parent, const char* name);

// Returns the attribute, or an empty string if it is missing.
std::string AttributeOf(const TiXmlElement& element, const char* name);

// Parses `count` finite numbers separated by spaces. INVALID_ARGUMENT names line, element, and
// attribute.
absl::StatusOr<std::vector<double>> NumbersOf(const XmlDocument& document,
                                              const TiXmlElement& element, const char* attribute,
                                              size_t count);

}  // namespace hulld

#endif  // HULLD_CLIENT_ROBOT_XML_DOCUMENT_H_
