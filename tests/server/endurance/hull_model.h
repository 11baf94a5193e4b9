#ifndef HULLD_TESTS_SERVER_ENDURANCE_HULL_MODEL_H_
#define HULLD_TESTS_SERVER_ENDURANCE_HULL_MODEL_H_

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "client/client.h"
#include "core/hull/hull.h"
#include "core/numeric/vector.h"

namespace hulld::server {

// Expected state of a hull that a single client changes. A call of unknown outcome leaves two
// possible states; reading the hull decides.
class HullModel {
 public:
  // Effect of a call: applied, not applied, or unknown.
  enum class Outcome { kDone, kNothing, kUnknown };
  // Returns the outcome by the status of a change: a refused request has changed nothing.
  static Outcome OutcomeOf(const absl::Status& status);

  explicit HullModel(std::string hull_id) : hull_id_(std::move(hull_id)), states_(1) {}

  const std::string& hull_id() const { return hull_id_; }
  // Has no effect if the hull exists.
  void Create(Outcome outcome);
  void Append(std::span<const Vector> points, Outcome outcome);
  void Replace(std::span<const Vector> points, Outcome outcome);
  void Delete(Outcome outcome);

  // Reads the hull and keeps the possible state that matches. Returns false and sets `problem` if
  // none matches. If the server does not answer, returns true and keeps all states.
  bool Look(const Client& client, std::string* problem);
  // True if exactly one state is possible.
  bool is_known() const { return states_.size() == 1; }
  // Returns the hull, or null if none exists. Requires: is_known().
  const Hull* hull() const { return states_[0] ? &*states_[0] : nullptr; }

 private:
  // nullopt if the hull does not exist.
  using State = std::optional<Hull>;
  void Become(std::vector<State> changed, Outcome outcome);

  const std::string hull_id_;
  // At least one.
  std::vector<State> states_;
};

}  // namespace hulld::server

#endif  // HULLD_TESTS_SERVER_ENDURANCE_HULL_MODEL_H_
