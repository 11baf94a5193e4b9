#include "client/formats/dae/dae_document.h"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <optional>
#include <tuple>

namespace hulld {

absl::Status DaeDocument::Load() {
  text_ = source_->ReadRest();
  Keep(source_->status());
  if (!ok()) return status_;
  copy_ = text_.data();
  if (const size_t zero = text_.find('\0'); zero != std::string::npos) {
    FailAt(copy_ + zero, "a NUL byte; is the file text, and complete?");
    return status_;
  }
  // Preserves line ends, because LineAt counts them.
  const pugi::xml_parse_result parsed = xml_.load_buffer(
      text_.data(), text_.size(),
      pugi::parse_cdata | pugi::parse_escapes | pugi::parse_wconv_attribute, pugi::encoding_utf8);
  if (!parsed) {
    FailAt(copy_ + parsed.offset,
           absl::StrCat("not well-formed XML: ", parsed.description(), "; is it complete?"));
    return status_;
  }
  copy_ = root().name() - root().offset_debug();
  if (NameOf(root()) != "COLLADA") {
    Fail(root(), "is the outermost element, not <COLLADA>");
    return status_;
  }
  ReadUnit();
  // Depth first, in the order of the file.
  for (pugi::xml_node node = root(); node && ok();) {
    if (node.type() == pugi::node_element) Index(node);
    if (node.first_child()) {
      node = node.first_child();
      continue;
    }
    while (node && !node.next_sibling()) node = node.parent();
    node = node.next_sibling();
  }
  return status_;
}

void DaeDocument::Keep(const absl::Status& status) {
  if (ok()) status_ = status;
}

void DaeDocument::Fail(pugi::xml_node node, const std::string& predicate) {
  FailAt(node.name(), absl::StrCat("<", Printable(NameOf(node)), "> ", predicate));
}

void DaeDocument::FailAt(const char* place, const std::string& message) {
  Keep(
      absl::InvalidArgumentError(absl::StrCat(source_->name(), ":", LineAt(place), ": ", message)));
}

uint64_t DaeDocument::LineAt(const char* place) const {
  const size_t offset = std::min(static_cast<size_t>(place - copy_), text_.size());
  const auto end = text_.begin() + static_cast<std::ptrdiff_t>(offset);
  return 1 + static_cast<uint64_t>(std::count(text_.begin(), end, '\n'));
}

void DaeDocument::ReadUnit() {
  const pugi::xml_node unit = ChildOf(ChildOf(root(), "asset"), "unit");
  const pugi::xml_attribute meter = unit.attribute("meter");
  if (!meter) return;
  const std::string_view text = Trim(meter.value());
  const double meters = NumberOf(text, ParseDouble);
  const std::optional<LengthScale> scale = LengthScale::FromText(text);
  if (!scale || meters < 0) return Fail(unit, "is not a finite length above 0");
  unit_ = *scale;
}

void DaeDocument::Index(pugi::xml_node node) {
  const std::string_view name = NameOf(node);
  if (name == "geometry" || name == "node" || name == "visual_scene") {
    by_id_.emplace(std::pair(name, std::string_view(node.attribute("id").value())), node);
  }
  if (name == "unit" && NameOf(node.parent()) == "asset" && node.attribute("meter") &&
      node.parent().parent() != root()) {
    const double meter = NumberOf(Trim(node.attribute("meter").value()), ParseDouble);
    if (meter != unit_.Apply(1))
      Fail(node, "differs from the unit of the file; only one is supported");
  }
}

std::string_view DaeDocument::NameOf(pugi::xml_node node) {
  const std::string_view name = node.name();
  return name.substr(name.find(':') + 1);
}

pugi::xml_node DaeDocument::ChildOf(pugi::xml_node node, std::string_view name) {
  return node.find_child([name](pugi::xml_node child) { return NameOf(child) == name; });
}

bool DaeDocument::RefersTo(pugi::xml_node node, const char* attribute, pugi::xml_node target) {
  const std::string_view reference = node.attribute(attribute).value();
  return reference.substr(0, 1) == "#" && reference.substr(1) == target.attribute("id").value();
}

pugi::xml_node DaeDocument::TargetOf(pugi::xml_node node, const std::string& name) {
  const std::string url = node.attribute("url").value();
  if (url.substr(0, 1) != "#") {
    Fail(node, absl::StrCat("refers to ", Quoted(url), ", not in this file; merge the files"));
    return {};
  }
  auto [first, last] = by_id_.equal_range({name, std::string_view(url).substr(1)});
  if (first == last) {
    const std::string id = PercentDecoded(url.substr(1));
    std::tie(first, last) = by_id_.equal_range({name, id});
  }
  if (first == last || std::next(first) != last) {
    Fail(node, absl::StrCat("refers to ", Quoted(url), ", the ID of ",
                            first == last ? "no " : "more than one ", name));
    return {};
  }
  return first->second;
}

uint64_t DaeDocument::IntegerOf(pugi::xml_node node, const char* attribute, uint64_t absent) {
  const pugi::xml_attribute found = node.attribute(attribute);
  uint64_t number = 0;
  if (!found) return absent;
  if (ParseUnsigned(Trim(found.value()), &number) &&
      number <= std::numeric_limits<uint32_t>::max()) {
    return number;
  }
  Fail(node, absl::StrCat("has ", attribute, "=", Quoted(found.value()),
                          ", not a whole number below 2^32"));
  return 0;
}

std::vector<double> DaeDocument::NumbersOf(pugi::xml_node node, size_t count) {
  std::vector<double> numbers;
  const size_t words = ForEachWord(node, [&](std::string_view word) {
    if (numbers.size() < count) numbers.push_back(NumberOf(word, ParseDouble));
  });
  const bool finite = std::all_of(numbers.begin(), numbers.end(),
                                  [](double number) { return std::isfinite(number); });
  if (words != count || !finite) {
    Fail(node, absl::StrCat("is not ", count, " finite numbers"));
  }
  numbers.resize(count);
  return numbers;
}

}  // namespace hulld
