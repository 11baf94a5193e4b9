#ifndef HULLD_SERVER_PROCESS_FAIR_QUEUE_H_
#define HULLD_SERVER_PROCESS_FAIR_QUEUE_H_

#include <cstddef>
#include <cstdint>
#include <deque>
#include <unordered_map>
#include <utility>

#include "core/base/check.h"

namespace hulld::server {

// Unit of fair scheduling: a client, which is a token or, without tokens, an address; and one of
// its connections, 0 if unknown.
struct ClientId {
  uint64_t number = 0;
  uint64_t connection = 0;
};
// The server itself.
inline constexpr ClientId kNoClient = {};

// A queue with fair scheduling: clients take turns, one item each, and so do the connections of a
// client. The items of a connection stay in order. A client with many items therefore delays only
// itself, and a connection with many items delays the other connections of its client by one item
// at a time. All operations cost O(1). Not thread-safe.
template <typename Item>
class FairQueue {
 public:
  bool empty() const { return size_ == 0; }
  size_t size() const { return size_; }

  void Push(ClientId client, Item item) {
    clients_.At(client.number).At(client.connection).push_back(std::move(item));
    ++size_;
  }

  // Removes and returns the next item. Requires a non-empty queue.
  Item Pop() {
    HULLD_CHECK(size_ > 0);
    auto& client = clients_.Next();
    auto& connection = client.Next();
    Item item = std::move(connection.front());
    connection.pop_front();
    client.EndTurn();
    clients_.EndTurn();
    --size_;
    return item;
  }

 private:
  // Queues that take turns. Contains only non-empty queues, except during Push and Pop.
  template <typename Queue>
  class Turns {
   public:
    bool empty() const { return turns_.empty(); }
    // Returns the queue of a key, to which the caller adds an item.
    Queue& At(uint64_t key) {
      Queue& queue = queues_[key];
      if (queue.empty()) turns_.push_back(key);
      return queue;
    }
    // Returns the queue whose turn it is.
    Queue& Next() { return queues_.find(turns_.front())->second; }
    // Advances to the next turn after an item was removed.
    void EndTurn() {
      const auto queue = queues_.find(turns_.front());
      if (queue->second.empty()) {
        queues_.erase(queue);
      } else {
        turns_.push_back(turns_.front());
      }
      turns_.pop_front();
    }

   private:
    std::unordered_map<uint64_t, Queue> queues_;
    std::deque<uint64_t> turns_;
  };

  Turns<Turns<std::deque<Item>>> clients_;
  size_t size_ = 0;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_PROCESS_FAIR_QUEUE_H_
