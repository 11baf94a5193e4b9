#include "tests/fuzz/files/file_mutation.h"

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <functional>
#include <iterator>
#include <string>
#include <utility>
#include <vector>

namespace hulld::fuzz {
namespace {

// Returns the positions of all pieces of a kind: lines, runs of digits, aligned words, or tags with
// the text after them.
std::vector<std::pair<size_t, size_t>> Pieces(const std::string& content, size_t kind) {
  std::vector<std::pair<size_t, size_t>> pieces;
  for (size_t at = 0; at < content.size();) {
    size_t end = at + 1;
    if (kind == 0) {
      end = std::min(content.find('\n', at), content.size() - 1) + 1;
    } else if (kind == 3) {
      end = std::min(content.find('<', end), content.size());
    } else if (kind == 1) {
      while (end < content.size() && (content[at] >= '0' && content[at] <= '9') &&
             content[end] >= '0' && content[end] <= '9') {
        ++end;
      }
    } else {
      end = std::min(at + 4, content.size());
    }
    if (kind != 1 || (content[at] >= '0' && content[at] <= '9')) pieces.emplace_back(at, end - at);
    at = end;
  }
  return pieces;
}

}  // namespace

void ChangeStructure(const std::function<size_t(size_t)>& next, std::string* content) {
  static const auto* const kLimits =
      new std::vector<std::string>{"0",          "1",          "2",
                                   "3",          "255",        "65536",
                                   "4294967295", "4294967296", "18446744073709551615",
                                   "-1",         "1e999",      "1e-999",
                                   "nan"};
  constexpr uint32_t kWords[] = {0, 1, 2, 0xffffffff, 0x7fffffff, 0x80000000, 0x7f800000, 50, 84};
  const size_t kind = next(content->find('<') == std::string::npos ? 3 : 4);
  const auto pieces = Pieces(*content, kind);
  if (pieces.empty()) return;
  const auto [at, size] = pieces[next(pieces.size())];
  const auto [other, other_size] = pieces[next(pieces.size())];
  const std::string piece = content->substr(at, size);
  switch (next(5)) {
    case 0: {
      std::string swapped = content->substr(other, other_size);
      content->replace(std::max(at, other), at > other ? size : other_size,
                       at > other ? swapped : piece);
      if (at != other) {
        content->replace(std::min(at, other), at > other ? other_size : size,
                         at > other ? piece : swapped);
      }
      return;
    }
    case 1:
      content->insert(other, piece);
      return;
    case 2:
      content->erase(at, size);
      return;
    case 3:
      content->resize(at);
      return;
    default:
      if (kind == 1) {
        content->replace(at, size, (*kLimits)[next(kLimits->size())]);
      } else if (kind == 2 && size == 4) {
        std::memcpy(content->data() + at, &kWords[next(std::size(kWords))], 4);
      } else {
        content->insert(at + size, piece);
      }
  }
}

const std::vector<std::string>& FileTokens() {
  static const auto* const kTokens = new std::vector<std::string>{"nan",
                                                                  "1.#INF",
                                                                  "\"skin\":0,",
                                                                  "\"weights\":[1],",
                                                                  "\"JOINTS_0\":0,",
                                                                  "-inf",
                                                                  "1e308",
                                                                  "1e309",
                                                                  "-0",
                                                                  "5e-324",
                                                                  "0x1p3",
                                                                  "1,5",
                                                                  "\xef\xbb\xbf",
                                                                  "\r",
                                                                  "\r\n",
                                                                  "\\\n",
                                                                  "18446744073709551615",
                                                                  "4294967296",
                                                                  "-1",
                                                                  "#",
                                                                  "\"",
                                                                  ";",
                                                                  "\t",
                                                                  "element vertex 9\n",
                                                                  "property list uint double l\n",
                                                                  "property float x\n",
                                                                  "end_header\n",
                                                                  "format binary_big_endian 1.0\n",
                                                                  "DATA binary\n",
                                                                  "DATA binary_compressed\n",
                                                                  "type=\"planar\"",
                                                                  "type=\"floating\"",
                                                                  "POINTS 3\n",
                                                                  "COUNT 4000000000 1 1\n",
                                                                  "SIZE 8 8 8\n",
                                                                  "TYPE U F I\n",
                                                                  "f 1 2 3\n",
                                                                  "v 1 2\n",
                                                                  "f -9\n",
                                                                  "OFF\n",
                                                                  "STCOFF\n",
                                                                  "all\n",
                                                                  "place: {a: {id: b}}\n",
                                                                  "place a b 1 2\n",
                                                                  "ask: {pairs: [[a, a]]}\n",
                                                                  "{",
                                                                  "[",
                                                                  "}",
                                                                  "]",
                                                                  "\"NaN\"",
                                                                  "null",
                                                                  "\\u0000",
                                                                  "\\ud800",
                                                                  "\"hullId\":",
                                                                  "&a ",
                                                                  "*a",
                                                                  "<<: *p\n",
                                                                  "place: ",
                                                                  "  - ",
                                                                  "<link name=\"z\"/>",
                                                                  "<instance_node url=\"#m\"/>",
                                                                  "<instance_geometry url=\"#g\"/>",
                                                                  "<rotate>0 1 0 90</rotate>",
                                                                  "<polygons><ph><p>0 1 2</p>",
                                                                  "<h>0 1 2</h></ph></polygons>",
                                                                  "<!DOCTYPE a [<!ENTITY b 'c'>]>",
                                                                  "]]>",
                                                                  "<robot",
                                                                  "</",
                                                                  "/>",
                                                                  "<!--",
                                                                  "<![CDATA[",
                                                                  "&lt;",
                                                                  "&#x0;",
                                                                  "mimic joint=\"j\"",
                                                                  "x,y,z\n",
                                                                  std::string(1, '\0'),
                                                                  std::string(300, '1'),
                                                                  std::string(120, '[')};
  return *kTokens;
}

}  // namespace hulld::fuzz
