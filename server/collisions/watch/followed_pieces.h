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

// The hulls of the pieces of watched bodies: which bodies each concerns, and at which revision the
// client was told of it. Bodies are numbered by the owner. Not thread-safe.
class FollowedPieces {
 public:
  // What came to be of concern, and what is no longer.
  struct Difference {
    std::vector<std::string> added;
    std::vector<std::string> dropped;

    // Leaves out what one body gave up and another took, in either order: it is of concern all the
    // while. Cost: O(n log n).
    void Settle();
  };

  // The hulls of the pieces of a body from now on, each once; none where it is no body. Cost:
  // O(log n) for each hull that it has or had, unless these are the same.
  void Set(size_t body, std::span<const std::string> hull_ids, Difference* difference);

  // The bodies of which this is the hull of a piece, ascending.
  std::set<size_t> BodiesOf(const std::string& hull_id) const;

  // Whether the client is to be told of this hull, which is one that is followed; notes that it is.
  bool IsNews(const HullRecord& hull);

  size_t MemoryBytes() const { return bytes_; }

 private:
  struct Followed {
    std::set<size_t> bodies;
    // As told; 0 before.
    uint64_t create_revision = 0;
    uint64_t revision = 0;
  };

  std::unordered_map<std::string, Followed> hulls_;
  std::unordered_map<size_t, std::vector<std::string>> hulls_of_;
  size_t bytes_ = 0;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_COLLISIONS_WATCH_FOLLOWED_PIECES_H_
