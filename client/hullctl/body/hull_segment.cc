#include "client/hullctl/body/hull_segment.h"

#include <absl/strings/ascii.h>
#include <absl/strings/str_cat.h>

namespace hulld {
namespace {

constexpr size_t kMaxNameBytes = 100;

}  // namespace

std::string HullSegment(std::string name) {
  if (name.size() > kMaxNameBytes) name.resize(kMaxNameBytes);
  for (char& c : name) {
    const bool allowed =
        absl::ascii_isalnum(static_cast<unsigned char>(c)) || c == '.' || c == '_' || c == '-';
    if (!allowed) c = '_';
  }
  const bool starts_well =
      !name.empty() && absl::ascii_isalnum(static_cast<unsigned char>(name[0]));
  return starts_well ? name : "x" + name;
}

std::string UniqueHullSegment(const std::string& name, std::set<std::string>* taken) {
  const std::string segment = HullSegment(name);
  std::string unique = segment;
  for (int number = 2; !taken->insert(unique).second; ++number) {
    unique = absl::StrCat(segment, "-", number);
  }
  return unique;
}

}  // namespace hulld
