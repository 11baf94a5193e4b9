#ifndef HULLD_CLIENT_HULLCTL_PRINTING_TABLE_H_
#define HULLD_CLIENT_HULLCTL_PRINTING_TABLE_H_

#include <ostream>
#include <string>
#include <vector>

#include "client/hullctl/printing/painter.h"

namespace hulld {

// Rows of text in columns as wide as their widest cell.
class Table {
 public:
  // Adds a row of titles.
  Table& Head(const Painter& paint, const std::vector<std::string>& titles);
  Table& Row(std::vector<std::string> cells);
  void Print(std::ostream& out) const;

 private:
  std::vector<std::vector<std::string>> rows_;
};

}  // namespace hulld

#endif  // HULLD_CLIENT_HULLCTL_PRINTING_TABLE_H_
