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

// What one hull must be that a single client changes. A call that ended without saying whether it
// changed anything leaves two possibilities; looking at the hull decides.
class HullModel {
 public:
  // What a call did.
  enum class Outcome { kDone, kNothing, kUnknown };
  // By the status that a change ended with: what refuses a request has changed nothing.
  static Outcome OutcomeOf(const absl::Status& status);

  explicit HullModel(std::string hull_id) : hull_id_(std::move(hull_id)), states_(1) {}

  const std::string& hull_id() const { return hull_id_; }
  // Unless it is there.
  void Create(Outcome outcome);
  void Append(std::span<const Vector> points, Outcome outcome);
  void Replace(std::span<const Vector> points, Outcome outcome);
  void Delete(Outcome outcome);

  // Asks the server; which of the possibilities is true holds from then on. False, with `problem`
  // set: none is. Nothing is decided, and true is returned, when the server does not answer.
  bool Look(const Client& client, std::string* problem);
  // Whether there is one possibility.
  bool is_known() const { return states_.size() == 1; }
  // The hull; requires that it is known. Null when there is none.
  const Hull* hull() const { return states_[0] ? &*states_[0] : nullptr; }

 private:
  // Absent: there is no hull.
  using State = std::optional<Hull>;
  void Become(std::vector<State> changed, Outcome outcome);

  const std::string hull_id_;
  // At least one.
  std::vector<State> states_;
};

}  // namespace hulld::server

#endif  // HULLD_TESTS_SERVER_ENDURANCE_HULL_MODEL_H_
