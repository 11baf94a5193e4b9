#ifndef HULLD_CLIENT_HULLCTL_PRINTING_TABLE_H_
#define HULLD_CLIENT_HULLCTL_PRINTING_TABLE_H_

#include <cstdint>
#include <ostream>
#include <string>
#include <vector>

namespace hulld {

// Returns "1 hull" or "2 hulls". plural: by default, the noun with an "s".
std::string Counted(uint64_t count, const std::string& noun, const std::string& plural = "");

// Rows of text in columns as wide as their widest cell.
class Table {
 public:
  Table& Row(std::vector<std::string> cells);
  void Print(std::ostream& out) const;

 private:
  std::vector<std::vector<std::string>> rows_;
};

}  // namespace hulld

#endif  // HULLD_CLIENT_HULLCTL_PRINTING_TABLE_H_
