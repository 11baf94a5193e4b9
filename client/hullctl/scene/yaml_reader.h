#ifndef HULLD_CLIENT_HULLCTL_SCENE_YAML_READER_H_
#define HULLD_CLIENT_HULLCTL_SCENE_YAML_READER_H_

#include <absl/status/statusor.h>
#include <yaml-cpp/yaml.h>

#include <string>
#include <utility>
#include <vector>

namespace hulld {

// Reads values out of one YAML document; errors are INVALID_ARGUMENT "NAME:LINE:COLUMN: message",
// where the value is. An alias stands where its anchor does.
class YamlReader {
 public:
  // INVALID_ARGUMENT: no YAML, no document or several.
  static absl::StatusOr<YamlReader> Parse(const std::string& text, const std::string& name);

  const YAML::Node& root() const { return root_; }

  // "NAME:LINE:COLUMN".
  std::string PlaceOf(const YAML::Node& node) const;
  absl::Status ErrorAt(const YAML::Node& node, const std::string& message) const;

  // The entries of a mapping, keys in the order of the file. `what` names it in errors: no mapping,
  // a key that is no text, one that is there twice.
  using Entries = std::vector<std::pair<std::string, YAML::Node>>;
  absl::StatusOr<Entries> EntriesOf(const YAML::Node& node, const std::string& what) const;
  // The same where only some keys are known; for one that is not, the nearest is suggested.
  absl::StatusOr<Entries> EntriesOf(const YAML::Node& node, const std::string& what,
                                    const std::vector<std::string>& known) const;

  // Values; `key` names them in errors.
  absl::StatusOr<std::string> Text(const YAML::Node& node, const std::string& key) const;
  absl::StatusOr<double> Number(const YAML::Node& node, const std::string& key) const;
  absl::StatusOr<bool> Truth(const YAML::Node& node, const std::string& key) const;
  // A list of finite numbers. counts: how many there may be; empty: any.
  absl::StatusOr<std::vector<double>> Numbers(const YAML::Node& node, const std::string& key,
                                              const std::vector<size_t>& counts) const;
  // A list of texts.
  absl::StatusOr<std::vector<std::string>> Texts(const YAML::Node& node,
                                                 const std::string& key) const;

 private:
  YamlReader(YAML::Node root, std::string name) : root_(std::move(root)), name_(std::move(name)) {}

  YAML::Node root_;
  std::string name_;
};

}  // namespace hulld

#endif  // HULLD_CLIENT_HULLCTL_SCENE_YAML_READER_H_
