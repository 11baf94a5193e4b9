#include "client/hullctl/printing/table.h"

#include <algorithm>
#include <utility>

namespace hulld {

Table& Table::Head(const Painter& paint, const std::vector<std::string>& titles) {
  std::vector<std::string>& row = rows_.emplace_back();
  for (const std::string& title : titles) row.push_back(paint(Hue::kHeading, title));
  return *this;
}

Table& Table::Row(std::vector<std::string> cells) {
  rows_.push_back(std::move(cells));
  return *this;
}

void Table::Print(std::ostream& out) const {
  std::vector<size_t> widths;
  for (const auto& row : rows_) {
    widths.resize(std::max(widths.size(), row.size()));
    // The last cell of a row needs no padding.
    for (size_t i = 0; i + 1 < row.size(); ++i)
      widths[i] = std::max(widths[i], VisibleWidth(row[i]));
  }
  for (const auto& row : rows_) {
    std::string line;
    for (size_t i = 0; i < row.size(); ++i) {
      line += row[i];
      if (i + 1 < row.size()) line.append(widths[i] + 2 - VisibleWidth(row[i]), ' ');
    }
    out << line << "\n";
  }
}

}  // namespace hulld
