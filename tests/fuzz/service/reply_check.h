#ifndef HULLD_TESTS_FUZZ_SERVICE_REPLY_CHECK_H_
#define HULLD_TESTS_FUZZ_SERVICE_REPLY_CHECK_H_

#include <cstddef>
#include <cstdint>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "hulld/v1/collision.pb.h"
#include "hulld/v1/hull.pb.h"

namespace hulld::fuzz {

inline bool IsCollision(v1::Relation relation) {
  return relation == v1::RELATION_TOUCHING || relation == v1::RELATION_OVERLAPPING;
}

// Checks of OK replies against the API contract, for any request. Each function returns the fault
// of a reply, or empty.

std::string CheckHullInfo(const v1::HullInfo& hull);
std::string CheckHull(const v1::GetHullRequest& request, const v1::GetHullResponse& response);
std::string CheckPage(const v1::ListHullsRequest& request, const v1::ListHullsResponse& response);
std::string CheckMesh(const v1::GetHullMeshRequest& request,
                      std::span<const v1::GetHullMeshResponse> parts);
std::string CheckPair(const v1::CheckCollisionRequest& request,
                      const v1::CheckCollisionResponse& response);
// Every pair is answered exactly once, in order.
std::string CheckBatch(const v1::BatchCheckCollisionsRequest& request,
                       std::span<const v1::BatchCheckCollisionsResponse> parts);
// Pairs ascend without repetition, and the totals count them.
std::string CheckScene(const v1::FindCollisionsRequest& request,
                       std::span<const v1::FindCollisionsResponse> parts);

// Returns true if a scene includes this pair. Scene: FindCollisionsRequest, or its watch.
template <typename Scene>
bool Selects(const Scene& scene, int a, int b) {
  if (scene.has_movers() && static_cast<uint32_t>(a) >= scene.movers()) return false;
  if (scene.groups().empty()) return true;
  const uint32_t g = scene.groups(a);
  const uint32_t h = scene.groups(b);
  if (scene.ignore_same_group() && g == h) return false;
  for (int i = 0; i < scene.ignored_group_pairs_size(); i += 2) {
    const uint32_t first = scene.ignored_group_pairs(i);
    const uint32_t second = scene.ignored_group_pairs(i + 1);
    if ((first == g && second == h) || (first == h && second == g)) return false;
  }
  return true;
}

// Moves the placements named by an update to its poses.
template <typename Update, typename Placements>
void MovePlacements(const Update& update, Placements* placements) {
  for (int i = 0; i < update.placements_size(); ++i) {
    if (update.placements(i) >= static_cast<uint32_t>(placements->size()) ||
        update.poses_size() < 7 * (i + 1)) {
      continue;
    }
    v1::Pose* const pose =
        placements->Mutable(static_cast<int>(update.placements(i)))->mutable_pose();
    const double* const numbers = update.poses().data() + static_cast<ptrdiff_t>(7) * i;
    pose->mutable_rotation()->set_w(numbers[0]);
    pose->mutable_rotation()->set_x(numbers[1]);
    pose->mutable_rotation()->set_y(numbers[2]);
    pose->mutable_rotation()->set_z(numbers[3]);
    pose->mutable_translation()->set_x(numbers[4]);
    pose->mutable_translation()->set_y(numbers[5]);
    pose->mutable_translation()->set_z(numbers[6]);
  }
}

// Returns the relations of a batch, in the order of its pairs.
std::vector<v1::Relation> RelationsOf(std::span<const v1::BatchCheckCollisionsResponse> parts);

// Follows one ReplaceHull call.
class ReplaceCheck {
 public:
  // Records every message, sent successfully or not.
  void Sent(const v1::ReplaceHullRequest& request);
  // Returns the fault of a call that ended OK.
  std::string EndedOk(const v1::ReplaceHullResponse& response) const;

  const std::string& hull_id() const { return hull_id_; }
  // True if the call may end OK: an opening, points, and a final empty block.
  bool is_whole() const { return well_formed_ && ends_; }
  // True if only that block is missing.
  bool is_cut_short() const { return well_formed_ && !ends_; }

 private:
  std::string hull_id_;
  bool opened_ = false;
  bool well_formed_ = true;
  bool ends_ = false;
  uint64_t points_ = 0;
};

// Follows one AppendPoints call.
class AppendCheck {
 public:
  // Records the points of chunks in sending order.
  void Sent(const v1::AppendPointsRequest& request);
  std::string Received(const v1::AppendPointsResponse& response);
  // ok: the final status, after everything was read. is_certain: no chunk of an abandoned stream
  // can have been committed since this one was opened.
  std::string Ended(bool ok, bool is_certain) const;

  const v1::AppendOpened& opened() const { return opened_; }
  bool is_open() const { return open_; }
  // The hull in the last reply, except its dimension. Requires: is_open().
  const v1::HullInfo& hull() const { return hull_; }

 private:
  struct SentChunk {
    uint64_t sequence = 0;
    uint64_t points = 0;
  };

  std::vector<SentChunk> chunks_;
  v1::AppendOpened opened_;
  v1::HullInfo hull_;
  bool open_ = false;
  uint64_t received_ = 0;
  uint64_t revision_ = 0;
};

// Follows one StreamCollisions call and its client's knowledge of the pairs.
class CollisionStreamCheck {
 public:
  explicit CollisionStreamCheck(const v1::CollisionStreamOpen& open);

  // Messages are numbered from 0, the opening one.
  void Sent(const v1::CollisionStreamUpdate& update);
  std::string Received(const v1::StreamCollisionsResponse& response);

  // Returns a batch with the relations that the stream has reported so far. Requires: every message
  // was answered.
  v1::BatchCheckCollisionsRequest AsBatch() const;
  const std::vector<v1::Relation>& relations() const { return relations_; }
  bool has_tolerance() const { return open_.tolerance() != 0; }

 private:
  v1::CollisionStreamOpen open_;
  std::vector<v1::Relation> relations_;
  uint64_t sent_ = 0;
  // Position in the answer being received.
  uint64_t answering_ = 0;
  bool starts_ = true;
  uint32_t last_pair_ = 0;
  bool any_pair_ = false;
};

}  // namespace hulld::fuzz

#endif  // HULLD_TESTS_FUZZ_SERVICE_REPLY_CHECK_H_
