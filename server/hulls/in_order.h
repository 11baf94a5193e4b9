#ifndef HULLD_SERVER_HULLS_IN_ORDER_H_
#define HULLD_SERVER_HULLS_IN_ORDER_H_

#include <cstdint>
#include <map>
#include <utility>

namespace hulld::server {

// Delivers results, which arrive in any order, in the order of their requests. Not thread-safe.
template <typename Result>
class InOrder {
 public:
  // Returns the number of the next request.
  uint64_t Number() { return requests_++; }

  // Accepts the result of a request, once per request. Delivers every result that no longer waits
  // for an earlier one.
  template <typename Pass>
  void Take(uint64_t number, Result result, const Pass& pass) {
    early_.emplace(number, std::move(result));
    while (!early_.empty() && early_.begin()->first == passed_) {
      ++passed_;
      pass(early_.extract(early_.begin()).mapped());
    }
  }

 private:
  uint64_t requests_ = 0;
  uint64_t passed_ = 0;
  std::map<uint64_t, Result> early_;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_HULLS_IN_ORDER_H_
