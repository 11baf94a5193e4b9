#ifndef HULLD_SERVER_PROCESS_FAIR_QUEUE_H_
#define HULLD_SERVER_PROCESS_FAIR_QUEUE_H_

#include <cstddef>
#include <cstdint>
#include <deque>
#include <unordered_map>
#include <utility>

#include "core/base/check.h"

namespace hulld::server {

// Unit of fair scheduling: a token or, without tokens, an address.
using ClientId = uint64_t;
// The server itself.
inline constexpr ClientId kNoClient = 0;

// A queue with fair scheduling: clients take turns, one item each, and the items of a client stay
// in order. A client with many items therefore delays only itself. All operations cost O(1). Not
// thread-safe.
template <typename Item>
class FairQueue {
 public:
  bool empty() const { return size_ == 0; }
  size_t size() const { return size_; }

  void Push(ClientId client, Item item) {
    std::deque<Item>& waiting = waiting_[client];
    if (waiting.empty()) turns_.push_back(client);
    waiting.push_back(std::move(item));
    ++size_;
  }

  // Removes and returns the next item. Requires a non-empty queue.
  Item Pop() {
    HULLD_CHECK(!turns_.empty());
    const ClientId client = turns_.front();
    turns_.pop_front();
    const auto waiting = waiting_.find(client);
    Item item = std::move(waiting->second.front());
    waiting->second.pop_front();
    if (waiting->second.empty()) {
      waiting_.erase(waiting);
    } else {
      turns_.push_back(client);
    }
    --size_;
    return item;
  }

 private:
  // Holds only clients with queued items.
  std::unordered_map<ClientId, std::deque<Item>> waiting_;
  std::deque<ClientId> turns_;
  size_t size_ = 0;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_PROCESS_FAIR_QUEUE_H_
