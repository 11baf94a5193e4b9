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

// A proxy between hulld and PostgreSQL that injects network faults. It parses the messages of
// PostgreSQL's protocol as they pass.
class CuttingProxy {
 public:
  // Fault of the next transaction only.
  enum class Cut {
    kNone,
    // Cuts the connection at COMMIT, before forwarding it.
    kBeforeCommit,
    // PostgreSQL commits; the connection is cut before its answer is forwarded.
    kAfterCommit,
    // Cuts the connection to hulld, and holds the piece that contains BEGIN until Deliver.
    kHold,
    // Like kHold, but for the piece that contains COMMIT and no BEGIN.
    kHoldCommit,
  };

  // socket_directory: the server's.
  explicit CuttingProxy(const std::string& socket_directory);
  CuttingProxy(const CuttingProxy&) = delete;
  CuttingProxy& operator=(const CuttingProxy&) = delete;
  ~CuttingProxy();

  // Host for connections through the proxy.
  const std::string& directory() const { return directory_; }

  void CutNext(Cut cut);
  // While down, cuts all connections and rejects new ones.
  void SetDown(bool down);
  // Goes down at the next cut.
  void GoDownWithCut();
  // Cuts so far.
  int cuts();
  // CutListeners cuts the current connections that issued LISTEN. WithholdNotices withholds
  // everything the server sends to them, like a network that silently lost a connection.
  void CutListeners();
  void WithholdNotices(bool withhold);
  // Delays every piece of the server's answers.
  void SetDelay(std::chrono::milliseconds delay);
  // Replaces LISTEN by a statement that the server rejects, from now on.
  void RefuseToListen();
  // Bytes that the server has sent so far, and the number of queries with this text.
  uint64_t answered_bytes();
  int QueryCount(const std::string& text);
  // Delivers the held piece to the server. Returns after the server has answered all of it or
  // closed the connection.
  void Deliver();
  // Waits for a held piece, then delivers it. Stops holding if none arrives within `longest`.
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
  bool withholds_notices_ = false;
  std::chrono::milliseconds delay_{0};
  bool refuses_to_listen_ = false;
  int cuts_ = 0;
  uint64_t answered_bytes_ = 0;
  // Simple queries, by text.
  std::map<std::string, int> query_counts_;
  std::string held_;
  int held_server_ = -1;
  std::condition_variable is_held_;
  std::list<Connection> connections_;

  std::thread acceptor_;
};

}  // namespace hulld::server

#endif  // HULLD_TESTS_SERVER_HARNESS_POSTGRES_CUTTING_PROXY_H_
