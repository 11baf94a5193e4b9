#include "tests/server/endurance/hull_model.h"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <iterator>
#include <utility>

#include "core/base/check.h"
#include "core/hull/growth/hull_builder.h"

namespace hulld::server {
namespace {

Hull HullOf(std::span<const Vector> before, std::span<const Vector> points) {
  HullBuilder builder;
  HULLD_CHECK(builder.Add(before).ok());
  HULLD_CHECK(builder.Add(points).ok());
  return builder.Snapshot();
}

bool IsSame(const Hull& hull, const HullMesh& mesh) {
  if (mesh.vertex_count() != hull.vertices().size()) return false;
  for (size_t i = 0; i < hull.vertices().size(); ++i) {
    for (size_t k = 0; k < 3; ++k) {
      if (mesh.xyz[3 * i + k] != hull.vertices()[i][static_cast<Eigen::Index>(k)]) return false;
    }
  }
  return true;
}

}  // namespace

HullModel::Outcome HullModel::OutcomeOf(const absl::Status& status) {
  switch (status.code()) {
    case absl::StatusCode::kOk:
      return Outcome::kDone;
    case absl::StatusCode::kInvalidArgument:
    case absl::StatusCode::kNotFound:
    case absl::StatusCode::kAlreadyExists:
    case absl::StatusCode::kFailedPrecondition:
    case absl::StatusCode::kResourceExhausted:
    case absl::StatusCode::kAborted:
      return Outcome::kNothing;
    default:
      return Outcome::kUnknown;
  }
}

void HullModel::Create(Outcome outcome) {
  if (outcome == Outcome::kNothing) return;
  std::vector<State> changed;
  for (const State& state : states_) changed.push_back(state ? state : State(HullOf({}, {})));
  Become(std::move(changed), outcome);
}

void HullModel::Append(std::span<const Vector> points, Outcome outcome) {
  if (outcome == Outcome::kNothing) return;
  std::vector<State> changed;
  for (const State& state : states_) {
    // Appending to a missing hull has no effect.
    if (state) changed.emplace_back(HullOf(state->vertices(), points));
  }
  Become(std::move(changed), outcome);
}

void HullModel::Replace(std::span<const Vector> points, Outcome outcome) {
  if (outcome == Outcome::kNothing) return;
  std::vector<State> changed;
  changed.emplace_back(HullOf({}, points));
  Become(std::move(changed), outcome);
}

void HullModel::Delete(Outcome outcome) {
  if (outcome == Outcome::kNothing) return;
  Become(std::vector<State>(1), outcome);
}

void HullModel::Become(std::vector<State> changed, Outcome outcome) {
  if (outcome == Outcome::kDone) states_.clear();
  HULLD_CHECK(!changed.empty() || !states_.empty());
  std::move(changed.begin(), changed.end(), std::back_inserter(states_));
}

bool HullModel::Look(const Client& client, std::string* problem) {
  const auto mesh = client.GetHullMesh(hull_id_);
  const bool is_absent = absl::IsNotFound(mesh.status());
  if (!mesh.ok() && !is_absent) {
    if (OutcomeOf(mesh.status()) == Outcome::kUnknown) return true;
    *problem = absl::StrCat(hull_id_, ": ", mesh.status().ToString());
    return false;
  }
  for (State& state : states_) {
    if (is_absent ? state.has_value() : !state || !IsSame(*state, *mesh)) continue;
    State found = std::move(state);
    states_.clear();
    states_.push_back(std::move(found));
    return true;
  }
  *problem =
      absl::StrCat(hull_id_, is_absent ? " is absent" : " is there", is_absent ? "" : " with ",
                   is_absent ? "" : absl::StrCat(mesh->vertex_count(), " vertices"),
                   ", and should be one of ", states_.size(), " states, the first with ",
                   states_[0] ? absl::StrCat(states_[0]->vertices().size(), " vertices")
                              : std::string("no hull"));
  return false;
}

}  // namespace hulld::server
