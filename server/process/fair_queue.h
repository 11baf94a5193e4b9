#ifndef HULLD_SERVER_PROCESS_FAIR_QUEUE_H_
#define HULLD_SERVER_PROCESS_FAIR_QUEUE_H_

#include <cstddef>
#include <cstdint>
#include <deque>
#include <unordered_map>
#include <utility>

#include "core/base/check.h"

namespace hulld::server {

// The client that asks for work, as far as threads are shared: a token or, without tokens, an
// address.
using ClientId = uint64_t;
// The server itself.
inline constexpr ClientId kNoClient = 0;

// What waits, in turns: clients take turns, one item each, and the items of one client come in
// their order. So a client that asks for much waits for itself. All operations cost O(1). Not
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

  // The item whose turn it is. Requires that there is one.
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
  // Holds only clients that have something here.
  std::unordered_map<ClientId, std::deque<Item>> waiting_;
  std::deque<ClientId> turns_;
  size_t size_ = 0;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_PROCESS_FAIR_QUEUE_H_
