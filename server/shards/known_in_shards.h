#ifndef HULLD_SERVER_SHARDS_KNOWN_IN_SHARDS_H_
#define HULLD_SERVER_SHARDS_KNOWN_IN_SHARDS_H_

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "server/registry/catalog/known_hulls.h"

namespace hulld::server {

// As KnownHulls, over shards: what is known of the hulls of each, apart. A caller that asks again
// and again for the same IDs keeps it (Shards::Refresh). Not thread-safe.
class KnownInShards {
 public:
  // About what it holds of each ID, in bytes, the ID and the hull apart. (Of IDs in several shards
  // it holds one more copy, which is not counted.)
  static constexpr size_t kBytesEach = KnownHulls::kBytesEach;

 private:
  friend class Shards;

  // What the call asks of one shard.
  struct Part {
    size_t shard = 0;
    // May be empty: then the call needs to know its revision alone.
    std::vector<std::string> ids = {};
    KnownHulls known = {};
  };

  bool has_begun_ = false;
  // One shard has all of them, and the caller's IDs are asked for as they are.
  size_t only_shard_ = 0;
  KnownHulls only_;
  // Otherwise several: ascending by shard. Where each ID is: its part, and the place within that.
  std::vector<Part> parts_;
  std::vector<std::pair<uint32_t, uint32_t>> place_of_;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_SHARDS_KNOWN_IN_SHARDS_H_
