#ifndef HULLD_TESTS_SERVER_HARNESS_POSTGRES_CUTTING_PROXY_H_
#define HULLD_TESTS_SERVER_HARNESS_POSTGRES_CUTTING_PROXY_H_

#include <condition_variable>
#include <list>
#include <mutex>
#include <string>
#include <thread>

namespace hulld::server {

// Stands between hulld and PostgreSQL as a network does, and fails where a test says. It reads the
// messages of PostgreSQL's protocol as they pass.
class CuttingProxy {
 public:
  // What happens to the next transaction that comes, once.
  enum class Cut {
    kNone,
    // The connection is cut when COMMIT is asked for, before it is passed on.
    kBeforeCommit,
    // PostgreSQL commits, and the connection is cut before its answer is passed on.
    kAfterCommit,
    // The connection to hulld is cut, and all of the transaction is delivered by Deliver.
    kHold,
  };

  // socket_directory: of the server.
  explicit CuttingProxy(const std::string& socket_directory);
  CuttingProxy(const CuttingProxy&) = delete;
  CuttingProxy& operator=(const CuttingProxy&) = delete;
  ~CuttingProxy();

  // The host that reaches it.
  const std::string& directory() const { return directory_; }

  void CutNext(Cut cut);
  // Down: all connections are cut, and new ones at once.
  void SetDown(bool down);
  // Down from the next cut on.
  void GoDownWithCut();
  // Cuts so far.
  int cuts();
  // What was held arrives at the server; returns when that has ended the connection or answered
  // all.
  void Deliver();

 private:
  struct Connection;

  void Accept();
  void Serve(Connection& connection);
  bool PassRequests(Connection& connection);
  bool PassAnswers(Connection& connection);
  bool CutsHere(Cut cut);

  const std::string server_;
  std::string directory_;
  int listener_ = -1;

  std::mutex mutex_;
  // Guarded by mutex_.
  Cut next_ = Cut::kNone;
  bool down_ = false;
  bool down_with_cut_ = false;
  int cuts_ = 0;
  std::string held_;
  int held_server_ = -1;
  std::list<Connection> connections_;

  std::thread acceptor_;
};

}  // namespace hulld::server

#endif  // HULLD_TESTS_SERVER_HARNESS_POSTGRES_CUTTING_PROXY_H_
