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

// Follows hulls as they change, on a thread of its own, for as long as it lives: when a watch ends
// because its server is gone for long, another one resumes where it ended. Where a watch starts
// anew, hulls that went meanwhile are told of as DELETED.
class HullFollower {
 public:
  // `synced`: what was there has been told.
  using Receiver = std::function<void(const v1::HullEvent& event, bool synced)>;
  // Told why hulls are not followed at present; nothing is said of it when they are again.
  using Complaint = std::function<void(const std::string& message)>;

  HullFollower(const Client& client, v1::WatchHullsRequest request, Receiver receive,
               Complaint complain);
  // Cancels and waits for the thread, which may be within a call of the receiver.
  ~HullFollower();

  // Has the thread end soon; does not wait.
  void Cancel();
  // Whether the thread has ended, so that the destructor does not wait.
  bool finished() const { return finished_; }

 private:
  void Run();
  // One watch, until it ends; returns why.
  absl::Status Follow(HullWatch* watch);
  void Take(const v1::WatchHullsResponse& response);

  const Client& client_;
  v1::WatchHullsRequest request_;
  const Receiver receive_;
  const Complaint complain_;
  // Those told of and not deleted, and those of them that were told of since the start anew.
  std::unordered_set<std::string> present_;
  std::unordered_set<std::string> told_anew_;
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
