#ifndef HULLD_SERVER_COLLISIONS_WATCH_FOLLOWED_PIECES_H_
#define HULLD_SERVER_COLLISIONS_WATCH_FOLLOWED_PIECES_H_

#include <cstddef>
#include <cstdint>
#include <set>
#include <span>
#include <string>
#include <unordered_map>
#include <vector>

#include "server/store/hull_record.h"

namespace hulld::server {

// The hulls of the pieces of watched bodies, with the bodies that use each and the revision last
// sent to the client. The owner numbers the bodies. Not thread-safe.
class FollowedPieces {
 public:
  // Hulls to watch, and hulls to stop watching.
  struct Difference {
    std::vector<std::string> added;
    std::vector<std::string> dropped;

    // Removes hulls that are both added and dropped, because a piece moved between bodies. Cost:
    // O(n log n).
    void Settle();
  };

  // Sets the distinct hulls of a body's pieces; empty if the ID is not a body. Cost: O(log n) per
  // old or new hull, unless the set is unchanged.
  void Set(size_t body, std::span<const std::string> hull_ids, Difference* difference);

  // Returns the bodies with a piece of this hull, ascending.
  std::set<size_t> BodiesOf(const std::string& hull_id) const;

  // Returns true if the client lacks this version of a followed hull, and marks it as sent.
  bool IsNews(const HullRecord& hull);

  size_t MemoryBytes() const { return bytes_; }

 private:
  struct Followed {
    std::set<size_t> bodies;
    // The version last sent; 0 before.
    uint64_t create_revision = 0;
    uint64_t revision = 0;
  };

  std::unordered_map<std::string, Followed> hulls_;
  std::unordered_map<size_t, std::vector<std::string>> hulls_of_;
  size_t bytes_ = 0;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_COLLISIONS_WATCH_FOLLOWED_PIECES_H_
