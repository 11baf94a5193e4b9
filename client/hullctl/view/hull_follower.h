#ifndef HULLD_CLIENT_HULLCTL_VIEW_HULL_FOLLOWER_H_
#define HULLD_CLIENT_HULLCTL_VIEW_HULL_FOLLOWER_H_

#include <atomic>
#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <unordered_set>

#include "client/client.h"

namespace hulld {

// Follows changes of hulls on its own thread until destroyed. When a watch ends because its server
// has been unreachable for too long, a new watch resumes from its position. If a watch restarts
// from scratch, hulls deleted in between are reported as DELETED.
class HullFollower {
 public:
  // `synced`: the initial state is complete.
  using Receiver = std::function<void(const v1::HullEvent& event, bool synced)>;
  // Receives the reason that hulls cannot be followed at the moment. Recovery is not reported.
  using ReportError = std::function<void(const std::string& message)>;

  HullFollower(const Client& client, v1::WatchHullsRequest request, Receiver receive,
               ReportError report_error);
  // Cancels and waits for the thread, which may be inside the receiver.
  ~HullFollower();

  // Asks the thread to end; does not wait for it.
  void Cancel();
  // Returns true if the thread has ended, so that the destructor does not wait.
  bool finished() const { return finished_; }

 private:
  void Run();
  // Follows one watch until it ends; returns its error.
  absl::Status Follow(HullWatch* watch);
  void Take(const v1::WatchHullsResponse& response);

  const Client& client_;
  v1::WatchHullsRequest request_;
  const Receiver receive_;
  const ReportError report_error_;
  // IDs reported and not deleted, and the subset reported since the watch restarted.
  std::unordered_set<std::string> present_;
  std::unordered_set<std::string> seen_since_restart_;
  bool synced_ = false;

  std::mutex mutex_;
  std::condition_variable changed_;
  // Guarded by the mutex where they change.
  std::unique_ptr<HullWatch> watch_;
  bool ended_ = false;
  std::atomic<bool> finished_ = false;
  std::thread thread_;
};

}  // namespace hulld

#endif  // HULLD_CLIENT_HULLCTL_VIEW_HULL_FOLLOWER_H_
