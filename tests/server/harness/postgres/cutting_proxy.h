#ifndef HULLD_TESTS_SERVER_HARNESS_POSTGRES_CUTTING_PROXY_H_
#define HULLD_TESTS_SERVER_HARNESS_POSTGRES_CUTTING_PROXY_H_

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <list>
#include <map>
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
    // The connection to hulld is cut, and what is sent in one piece with BEGIN is delivered by
    // Deliver.
    kHold,
    // The same of what is sent in one piece with COMMIT and without BEGIN.
    kHoldCommit,
  };

  // socket_directory: that of the server.
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
  // Cuts the connections that asked to LISTEN, once; or keeps from them, as long as it is set, all
  // that the server sends, as a network does that lost a connection and tells nobody.
  void CutListeners();
  void SetDeaf(bool deaf);
  // Every piece of what the server answers comes this much later.
  void SetDelay(std::chrono::milliseconds delay);
  // From now on LISTEN is a statement that the server does not know.
  void RefuseToListen();
  // What the server has answered so far, in bytes, and how often it was asked for this text.
  uint64_t answered_bytes();
  int Asked(const std::string& text);
  // What was held arrives at the server; returns when that has ended the connection or answered
  // all.
  void Deliver();
  // The same as soon as something is held; if nothing was held after `longest`, holding ends.
  void DeliverOnceHeld(std::chrono::milliseconds longest);

 private:
  struct Connection;

  void Accept();
  void Serve(Connection& connection);
  bool PassRequests(Connection& connection);
  bool PassRequest(Connection& connection, const std::string& message);
  bool PassPiece(Connection& connection, const std::string& message);
  bool PassAnswers(Connection& connection);
  void AwaitDelay();
  bool IsNext(Cut cut);
  void NoteQuery(Connection& connection, std::string& message);
  bool NoteAnswer(const Connection& connection, size_t bytes);
  bool CutsHere(Cut cut);

  const std::string server_;
  std::string directory_;
  int listener_ = -1;

  std::mutex mutex_;
  // Guarded by mutex_.
  Cut next_ = Cut::kNone;
  bool down_ = false;
  bool down_with_cut_ = false;
  bool deaf_ = false;
  std::chrono::milliseconds delay_{0};
  bool refuses_to_listen_ = false;
  int cuts_ = 0;
  uint64_t answered_bytes_ = 0;
  // Simple queries, by their text.
  std::map<std::string, int> asked_;
  std::string held_;
  int held_server_ = -1;
  std::condition_variable is_held_;
  std::list<Connection> connections_;

  std::thread acceptor_;
};

}  // namespace hulld::server

#endif  // HULLD_TESTS_SERVER_HARNESS_POSTGRES_CUTTING_PROXY_H_
