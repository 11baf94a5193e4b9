#ifndef HULLD_SERVER_REGISTRY_WATCH_DELETION_LOG_H_
#define HULLD_SERVER_REGISTRY_WATCH_DELETION_LOG_H_

#include <cstddef>
#include <cstdint>
#include <deque>
#include <string>
#include <string_view>
#include <unordered_map>

namespace hulld::server {

// The most recent deletions of hulls and bodies, in the order of their revisions, for watches that
// resume: a deletion leaves no trace in the store. Not thread-safe.
class DeletionLog {
 public:
  // Maximum number of deletions: 25 MiB with IDs of maximum length, outside the memory budget.
  static constexpr size_t kCapacity = 1 << 16;

  struct Deletion {
    uint64_t revision;
    std::string id;
    bool was_body;
  };

  // Starts an empty log at this revision.
  void Begin(uint64_t revision) { begin_ = revision; }
  // Adds a deletion. Requires a revision above that of the last deletion.
  void Add(const std::string& id, uint64_t revision, bool was_body);
  // Notes that a hull or body was created.
  void NoteCreation(const std::string& id, bool is_body);

  // Returns true if the log contains every deletion after this revision.
  bool IsCompleteAfter(uint64_t revision) const { return revision >= begin_; }
  // Returns the first deletion after this revision, or end().
  std::deque<Deletion>::const_iterator After(uint64_t revision) const;
  std::deque<Deletion>::const_iterator end() const { return log_.end(); }
  // Returns true if the ID has been unused since this deletion, or since later ones that a watch of
  // hulls does not report. bodies: bodies count, too. Requires a deletion in the log.
  bool IsFinal(const Deletion& deletion, bool bodies) const;

 private:
  // The last deletion of an ID without a hull created since.
  struct Last {
    uint64_t revision;
    // The last deletion of a hull since one was created; 0: none.
    uint64_t hull_revision;
    bool is_body_now = false;
  };

  std::deque<Deletion> log_;
  // The log is complete after this revision.
  uint64_t begin_ = 0;
  // Keys are the IDs in `log_`.
  std::unordered_map<std::string_view, Last> last_;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_REGISTRY_WATCH_DELETION_LOG_H_
