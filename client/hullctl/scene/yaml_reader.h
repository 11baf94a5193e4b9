#ifndef HULLD_CLIENT_HULLCTL_SCENE_YAML_READER_H_
#define HULLD_CLIENT_HULLCTL_SCENE_YAML_READER_H_

#include <absl/status/statusor.h>
#include <yaml-cpp/yaml.h>

#include <string>
#include <utility>
#include <vector>

namespace hulld {

// Reads values of a YAML document. Errors are INVALID_ARGUMENT "NAME:LINE:COLUMN: message" at the
// value. The position of an alias is that of its anchor.
class YamlReader {
 public:
  // INVALID_ARGUMENT: not YAML, no document, or several.
  static absl::StatusOr<YamlReader> Parse(const std::string& text, const std::string& name);

  const YAML::Node& root() const { return root_; }

  // Returns "NAME:LINE:COLUMN".
  std::string PlaceOf(const YAML::Node& node) const;
  absl::Status ErrorAt(const YAML::Node& node, const std::string& message) const;

  // Returns the entries of a mapping in the order of the file. `what` names it in errors: not a
  // mapping, a key that is not text, or a duplicate key.
  using Entries = std::vector<std::pair<std::string, YAML::Node>>;
  absl::StatusOr<Entries> EntriesOf(const YAML::Node& node, const std::string& what) const;
  // Also rejects keys not in `known`, with the nearest known key as a suggestion.
  absl::StatusOr<Entries> EntriesOf(const YAML::Node& node, const std::string& what,
                                    const std::vector<std::string>& known) const;

  // Return values; `key` names them in errors.
  absl::StatusOr<std::string> Text(const YAML::Node& node, const std::string& key) const;
  absl::StatusOr<double> Number(const YAML::Node& node, const std::string& key) const;
  absl::StatusOr<bool> Truth(const YAML::Node& node, const std::string& key) const;
  // Returns a list of finite numbers. counts: allowed sizes; empty: any.
  absl::StatusOr<std::vector<double>> Numbers(const YAML::Node& node, const std::string& key,
                                              const std::vector<size_t>& counts) const;
  // Returns a list of texts.
  absl::StatusOr<std::vector<std::string>> Texts(const YAML::Node& node,
                                                 const std::string& key) const;

 private:
  YamlReader(const YAML::Node& root, std::string name) : root_(root), name_(std::move(name)) {}

  YAML::Node root_;
  std::string name_;
};

}  // namespace hulld

#endif  // HULLD_CLIENT_HULLCTL_SCENE_YAML_READER_H_
